"""A fallback as fast as its equipment permits: what may be written, how long it takes, and who else may not hurry."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.mode import Side
from homeostat.domain.plant.rules import GuardRules, WriteRule
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.fallback import Chosen, Fallbacks
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.requests.verification import command_finding
from homeostat.guard.writing.ramp import Ramps
from tests.guard.vessel import DRAIN, RULES

pytestmark = pytest.mark.quick

FAST = 0.05
"""Ten times the ordinary rate of F.sp [L/s per s]."""
READY = Snapshot(1.0, {"L": 8.0, "F.sp": 0.03, "X.cmd": 1.0})


def permitting(fastest: float | None) -> GuardRules:
    """The vessel's rules with equipment that permits F.sp to change so fast [L/s per s]."""
    return replace(RULES, writables={**RULES.writables, "F.sp": WriteRule("F.sp", 0.0005, 2.0, fastest=fastest)})


def hurried(rate: float | None) -> FallbackStrategy:
    """The drain with a rate of its own for F.sp [L/s per s]."""
    commands = tuple(replace(c, rate=rate) if c.tag == "F.sp" else c for c in DRAIN.actions.commands)
    return replace(DRAIN, actions=ActionSet(commands, DRAIN.actions.target))


@pytest.mark.parametrize(
    ("fastest", "rate", "limit"),
    [
        (None, 0.005, None),
        (None, 0.0051, 0.005),
        (FAST, 0.005, None),
        (FAST, FAST, None),
        (FAST, 0.0501, FAST),
        (FAST, None, FAST),
    ],
)
def test_a_fallback_is_as_fast_as_its_equipment_permits_and_no_faster(
    fastest: float | None, rate: float | None, limit: float | None
) -> None:
    found = Fallbacks(permitting(fastest)).checked(hurried(rate), READY, frozenset(RULES.writables))
    if limit is None:
        assert isinstance(found, Chosen)
    else:
        told = "inf" if rate is None else f"{rate:.6g}"
        assert found == f"'F.sp' ramps at {told} L/s/s; limit {limit:g} L/s/s"


def test_whoever_else_commands_the_tag_keeps_to_its_ordinary_rate() -> None:
    rules = permitting(FAST)
    admitted = rules.machine.state("running").setpoint("F.sp")
    found = command_finding(Command("F.sp", 0.0, FAST), admitted, "running", rules)
    assert found is not None and found.criterion == "CHK-RATE" and found.margin == pytest.approx(0.005 - FAST)
    assert command_finding(Command("F.sp", 0.0, FAST), admitted, "running", rules, fallback=True) is None


def test_a_tag_that_may_step_needs_no_rate_whatever_its_equipment_is_said_to_permit() -> None:
    rules = replace(RULES, writables={**RULES.writables, "X.cmd": WriteRule("X.cmd", 0.01, 2.0, fastest=0.5)})
    assert isinstance(Fallbacks(rules).checked(DRAIN, READY, frozenset(RULES.writables)), Chosen)


@pytest.mark.parametrize(("rate", "seconds"), [(0.005, 6), (0.01, 3), (0.03, 1), (FAST, 1)])
def test_a_ramp_of_the_guard_is_over_in_the_time_that_its_rate_says(rate: float, seconds: int) -> None:
    ramps, held = Ramps(), {"F.sp": 0.03}
    rules = {"F.sp": WriteRule("F.sp", 0.0005, 2.0, fastest=FAST, ramped_by=Side.GUARD)}
    ramps.present(held)
    assert ramps.first((Command("F.sp", 0.0, rate),), rules, anyway=True) == (Command("F.sp", 0.03, None),)
    took = 0
    for second in range(20):
        sent = ramps.step(float(second), held, lambda tag, told, own: told == own, anyway=True)
        ramps.took(sent, float(second), held)
        held |= {c.tag: c.value for c in sent if c.value is not None}
        if held["F.sp"] == 0.0:
            took = second
            break
    assert took == seconds


def test_what_came_late_is_put_right_as_fast_as_the_fallback_moved_it() -> None:
    latch = object.__new__(Latch)
    latch.strategy = hurried(FAST)
    latch._parts = type("Parts", (), {"rules": permitting(FAST)})()
    assert (latch.rate("F.sp"), latch.rate("T.sp")) == (FAST, 0.5)
    latch.strategy = None
    assert latch.rate("F.sp") == 0.005
