"""Recognition: the state that the accepted targets and the readings fit, and no other."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.behaviour import SetpointRange, StateMachine
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.recognition import recognise
from tests.guard.vessel import state

STATES = (
    state("idle", initial=True),
    state("heating", SetpointRange("T.sp", 300.0, 310.0, 305.0), SetpointRange("V.man", 0.0, 1.0, None)),
    state("pouring", SetpointRange("T.sp", 0.0, 1.0, 0.5), settled="F.sp >= 0.5"),
    state("drained", SetpointRange("T.sp", 0.0, 1.0, 0.5), SetpointRange("F.sp", 0.0, 0.25, 0.0)),
)
MACHINE = StateMachine("oven", STATES, ())


def seen(believed: str = "idle", flow: float = 0.0, **accepted: float | None) -> str:
    targets = {tag.replace("_", "."): value for tag, value in accepted.items()}
    return recognise(MACHINE, Snapshot(1.0, {"F.sp": flow}, accepted=targets), believed)


@pytest.mark.parametrize(
    ("target", "fits"),
    [
        (305.0, True), (300.0 - 1e-6, True), (310.0 + 1e-6, True), (300.0 - 1.5e-6, False), (310.0 + 1.5e-6, False),
        (299.5, False), (310.5, False), (None, False), (math.nan, False),
    ],
)  # fmt: skip
def test_a_state_is_recognised_by_the_targets_that_it_admits(target: float | None, fits: bool) -> None:
    assert seen(T_sp=target, V_man=None) == ("heating" if fits else "idle")


def test_automatic_fits_where_it_is_by_design_and_so_does_a_value() -> None:
    assert seen(T_sp=305.0, V_man=0.5) == "heating"
    assert seen(T_sp=305.0, V_man=1.5) == "idle"
    assert seen(T_sp=0.5, F_sp=None) == "idle"


def test_a_target_that_the_plant_does_not_tell_fits_nothing() -> None:
    assert seen(T_sp=305.0) == "idle" and seen(V_man=None) == "idle" and seen() == "idle"


def test_a_state_without_targets_is_recognised_by_nobody() -> None:
    assert seen(believed="pouring", T_sp=-5.0) == "pouring"


def test_what_settles_a_state_must_hold() -> None:
    assert seen(T_sp=0.5, flow=0.5) == "pouring"
    assert seen(T_sp=0.5, flow=0.25) == "idle"
    assert seen(T_sp=0.5, flow=math.nan) == "idle"
    bad = Snapshot(1.0, {"F.sp": 0.5}, bad=frozenset({"F.sp"}), accepted={"T.sp": 0.5})
    assert recognise(MACHINE, bad, "idle") == "idle"


def test_of_several_that_fit_the_believed_one_counts() -> None:
    assert seen(believed="drained", T_sp=0.5, F_sp=0.0, flow=0.5) == "drained"
    assert seen(believed="pouring", T_sp=0.5, F_sp=0.0, flow=0.5) == "pouring"
    assert seen(believed="heating", T_sp=0.5, F_sp=0.0, flow=0.5) == "pouring"
