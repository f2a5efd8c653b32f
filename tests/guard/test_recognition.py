"""Recognition: the state that the accepted targets and the readings fit, and no other."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from homeostat.domain.plant.rules import WriteRule
from homeostat.domain.plant.state_machine import SetpointRange, StateMachine, Transition
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.sequence.recognition import (
    Evidence,
    Found,
    admits_all,
    followed,
    holds_targets,
    recognise,
    step_made,
)
from tests.guard.vessel import awaited, decided, state

RULES = {tag: WriteRule(tag, 0.25, 2.0) for tag in ("T.sp", "V.man")}
"""F.sp is known to no table of writable tags, and has no tolerance."""

STATES = (
    state("idle", initial=True),
    state("heating", SetpointRange("T.sp", 300.0, 310.0, 305.0), SetpointRange("V.man", 0.0, 1.0, None)),
    state("pouring", SetpointRange("T.sp", 0.0, 1.0, 0.5), settled="F.sp >= 0.5"),
    state("drained", SetpointRange("T.sp", 0.0, 1.0, 0.5), SetpointRange("F.sp", 0.0, 0.25, 0.0)),
)
MACHINE = StateMachine("oven", STATES, ())


def seen(believed: str = "idle", flow: float = 0.0, **accepted: float | None) -> str:
    targets = {tag.replace("_", "."): value for tag, value in accepted.items()}
    return recognise(MACHINE, evidence(Snapshot(1.0, {"F.sp": flow}, accepted=targets)), believed).state


def evidence(readings: Snapshot, *out: str) -> Evidence:
    return Evidence(readings, RULES, frozenset(out))


@pytest.mark.parametrize(
    ("target", "fits"),
    [
        (305.0, True), (299.75, True), (310.25, True), (299.75 - 1e-6, False), (310.25 + 1e-6, False),
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
    assert recognise(MACHINE, evidence(bad), "idle") == Found("idle")


def test_of_several_that_fit_the_believed_one_counts() -> None:
    assert seen(believed="drained", T_sp=0.5, F_sp=0.0, flow=0.5) == "drained"
    assert seen(believed="pouring", T_sp=0.5, F_sp=0.0, flow=0.5) == "pouring"
    assert seen(believed="heating", T_sp=0.5, F_sp=0.0, flow=0.5) == "pouring"


def told(*out: str, flow: float = 0.0, **accepted: float | None) -> Evidence:
    targets = {tag.replace("_", "."): value for tag, value in accepted.items()}
    return evidence(Snapshot(1.0, {"F.sp": flow}, accepted=targets), *out)


def test_a_plant_that_runs_by_itself_is_where_it_was_as_long_as_it_holds_the_targets() -> None:
    assert followed(MACHINE, told(T_sp=0.5, F_sp=0.0, flow=0.5), "drained") == "drained"
    assert followed(MACHINE, told(T_sp=0.5, F_sp=0.0, flow=0.0), "pouring") == "pouring", "it need not have settled"
    assert followed(MACHINE, told(), "heating") == "heating", "a plant that tells no target is taken at its word"


def test_else_one_state_and_no_other_must_fit() -> None:
    assert followed(MACHINE, told(T_sp=0.5, F_sp=0.0, flow=0.0), "heating") == "drained"
    assert followed(MACHINE, told(T_sp=0.5, F_sp=1.0, flow=0.5), "heating") == "pouring"
    assert followed(MACHINE, told(T_sp=0.5, F_sp=0.0, flow=0.5), "heating") is None, "it may be pouring or drained"
    assert followed(MACHINE, told(T_sp=99.0), "heating") is None


HELD = {"T_sp": 0.5, "F_sp": 0.0}
WAYS = StateMachine(
    "ways", tuple(replace(s, risk=risk) for s, risk in zip(STATES, (0, 0, 2, 1), strict=True)),
    (
        awaited("pour", "heating", "pouring", "F.sp >= 0.25"), awaited("drain", "heating", "drained", "F.sp >= 0.75"),
        decided("give up", "heating", "drained"), awaited("heat", "drained", "heating", "true"),
    ),
)  # fmt: skip


@pytest.mark.parametrize(
    ("flow", "held", "made"),
    [
        (0.0, HELD, None), (0.5, HELD, "pour"), (0.75, HELD, "drain"), (0.75, {"T_sp": 0.5, "F_sp": 1.0}, "pour"),
        (0.75, {"T_sp": 5.0, "F_sp": 0.0}, None), (0.75, {}, "drain"), (math.nan, HELD, None),
    ],
)  # fmt: skip
def test_a_step_was_made_where_its_guard_and_its_targets_hold_and_of_several_the_least_risky(
    flow: float, held: dict[str, float], made: str | None
) -> None:
    found = step_made(WAYS, told(flow=flow, **held), "heating")
    assert (found.name if found else None) == made
    assert step_made(WAYS, told(flow=flow, **held), "idle") is None


def test_targets_are_held_where_every_one_is_told_and_admitted() -> None:
    heating = MACHINE.state("heating")
    assert holds_targets(heating, told(T_sp=305.0, V_man=None)) and holds_targets(heating, told())
    assert holds_targets(MACHINE.state("drained"), told(T_sp=None, F_sp=0.0)), "it was handed back to automatic"
    assert not holds_targets(heating, told(T_sp=305.0)) and not holds_targets(heating, told(T_sp=5.0, V_man=None))


def test_a_state_admits_nothing_that_it_does_not_state() -> None:
    heating, nothing = MACHINE.state("heating"), told()
    assert not nothing.admits(heating, "F.sp", 0.0) and not nothing.admits(heating, "F.sp", None)
    assert nothing.admits(heating, "V.man", None) and nothing.admits(heating, "V.man", 0.5)
    assert not nothing.admits(heating, "T.sp", None)


@pytest.mark.parametrize(("value", "admitted"), [(0.25, True), (0.25 + 1e-6, False), (-1e-6, False)])
def test_a_tag_without_a_row_of_its_own_has_no_tolerance(value: float, admitted: bool) -> None:
    assert told().admits(MACHINE.state("drained"), "F.sp", value) is admitted


def test_of_a_state_only_the_tags_in_service_count_as_long_as_there_is_one() -> None:
    drained, held = MACHINE.state("drained"), {"T_sp": 0.5, "F_sp": 0.9}
    assert admits_all(drained, told("F.sp", **held)) and not admits_all(drained, told("T.sp", **held))
    assert not admits_all(drained, told(**held)) and not admits_all(drained, told("F.sp"))
    assert not admits_all(drained, told("T.sp", "F.sp", **held)), "no other evidence is left"
    assert admits_all(drained, told("T.sp", "F.sp", T_sp=0.5, F_sp=0.1))
    assert holds_targets(drained, told("F.sp", **held)) and not holds_targets(drained, told("T.sp", **held))
    assert followed(MACHINE, told("V.man", T_sp=305.0, V_man=9.0), "idle") == "idle"
    assert recognise(MACHINE, told("V.man", T_sp=305.0, V_man=9.0), "pouring") == Found("heating")


def test_a_step_is_open_also_where_its_guard_held_lately() -> None:
    assert step_made(WAYS, told(flow=0.0, **HELD), "heating") is None
    found = step_made(WAYS, told(flow=0.0, **HELD), "heating", {"drain"})
    assert found is not None and found.name == "drain"
    assert step_made(WAYS, told(flow=0.0, **HELD), "heating", {"give up"}) is None, "nobody has decided that"


BOTH = {"T_sp": 0.5, "F_sp": 0.0, "flow": 0.5}
"""What pouring and drained fit alike."""


@pytest.mark.parametrize(
    ("ways", "wide", "risks", "found"),
    [
        ((), (), (0, 0), Found("pouring", ("pouring", "drained"))),
        ((), (), (0, 1), Found("drained", ("pouring", "drained"))),
        ((), ("drained",), (0, 1), Found("pouring", ("pouring", "drained"))),
        ((), ("pouring",), (1, 0), Found("drained", ("pouring", "drained"))),
        ((awaited("on", "drained", "idle", "true"),), (), (0, 1), Found("pouring", ("pouring", "drained"))),
        ((decided("on", "drained", "idle"),), (), (0, 1), Found("drained", ("pouring", "drained"))),
        ((awaited("on", "pouring", "idle", "true"),), ("drained",), (0, 1), Found("pouring", ("pouring", "drained"))),
        ((decided("in", "idle", "pouring"),), (), (0, 1), Found("pouring")),
        ((awaited("in", "idle", "drained", "false"),), (), (1, 0), Found("drained")),
        ((decided("in", "heating", "pouring"),), (), (0, 1), Found("drained", ("pouring", "drained"))),
    ],
)
def test_of_several_that_fit_what_follows_on_the_believed_one_counts_and_then_the_most_cautious(
    ways: tuple[Transition, ...], wide: tuple[str, ...], risks: tuple[int, int], found: Found
) -> None:
    states = (*STATES[:2], *(replace(s, risk=risk) for s, risk in zip(STATES[2:], risks, strict=True)))
    machine = StateMachine("oven", states, ways)
    assert recognise(machine, told(**BOTH), "idle", wide) == found  # type: ignore[arg-type]
    assert ("'pouring' and 'drained' fit" in str(found)) is bool(found.candidates) is bool(str(found))
