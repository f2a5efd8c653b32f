"""Thinking time: bounded by the budget and by what the process leaves, and the fallback is ready before it begins."""

from __future__ import annotations

import math
import time

import pytest

from homeostat.domain.events.recovery import FallbackArmed
from homeostat.domain.verdict import FallbackNeeded
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, ScriptedMonitoring
from tests.recovery.line import BAD, GOOD, Stage, run, safe

AT_ONCE = Bounds(Budget(latency_s=1.0), InterventionBounds(waits=0))
"""Nobody waits after the proposers."""


@pytest.mark.parametrize(
    "action", [ScriptedAction(GOOD, delay_s=30.0), ScriptedAction(GOOD, thread_s=60.0)], ids=["waits", "computes"]
)
def test_a_slow_proposer_is_cut_off_at_the_deadline(action: ScriptedAction) -> None:
    stage = Stage(action, start=301.0, clock=ThinkingClock(), bounds=AT_ONCE)
    stage.monitoring = FirstHandOver(50.0, action)
    run(stage)
    assert isinstance(stage.monitoring.outcomes[0], FallbackNeeded)
    assert stage.monitoring.after_s >= 0.7, "all but the quarter that is kept for waits"
    assert not stage.monitoring.finished, "the fallback does not wait for a thread that computes on"
    assert safe(stage) and "within 1.0 s" in str(stage.guard.latched)
    acted_s, _ = stage.plant.written[0]
    assert stage.clock.total_s >= 0.7
    assert acted_s == pytest.approx(51.0 + stage.clock.total_s, abs=1.0), "the plant ran on for the time of thinking"


@pytest.mark.parametrize("scale", [5.0, 50.0])
def test_the_deadline_holds_however_fast_the_process_is(scale: float) -> None:
    """The limit is 66 s away when thinking begins; 1 s of wall clock may be 50 s of the process."""
    stage = Stage(ScriptedAction(GOOD, delay_s=20.0), start=301.0, clock=ThinkingClock(scale), end_s=200.0)
    stage.monitoring = ScriptedMonitoring(50.0)
    stage.bounds = AT_ONCE
    run(stage)
    assert isinstance(stage.monitoring.outcomes[0], FallbackNeeded) and safe(stage)
    assert stage.plant.hottest <= 313.0


@pytest.mark.parametrize("scale", [5.0, 50.0])
def test_waits_after_a_proposer_that_never_answers_end_in_time_for_the_fallback(scale: float) -> None:
    stage = Stage(ScriptedAction(GOOD, delay_s=20.0), start=301.0, clock=ThinkingClock(scale), end_s=200.0)
    stage.monitoring, stage.bounds = ScriptedMonitoring(50.0), Bounds(Budget(latency_s=1.0))
    run(stage)
    assert safe(stage) and stage.guard.latched and stage.plant.hottest <= 313.0


class FirstHandOver(ScriptedMonitoring):
    """Notes how long after the beginning the first outcome came [s], and whether ``action`` had answered by then."""

    def __init__(self, notice_s: float, action: ScriptedAction) -> None:
        super().__init__(notice_s)
        self._action, self._begun = action, time.monotonic()
        self.after_s = math.nan
        self.finished = False

    def follow(self, outcome) -> None:  # type: ignore[no-untyped-def]
        super().follow(outcome)
        if math.isnan(self.after_s):
            self.after_s, self.finished = time.monotonic() - self._begun, self._action.computed.is_set()
            self._action.compute_on.set()


@pytest.mark.parametrize(
    ("start", "heating", "latency_s", "expected"),
    [
        # at 50 s T = start + 5; what is left to 313 K at 1.01 heating, minus the reserve of 5 s
        (300.0, 0.1, 1000.0, None),
        (300.0, 0.2, 1000.0, (313.0 - 300.0 - 10.2) / 0.202 - 5.0),
        (302.5, 0.1, 1000.0, (313.0 - 302.5 - 5.1) / 0.101 - 5.0),
        (302.5, 0.1, 20.0, 20.0),
        (307.5, 0.1, 1000.0, 1.0),
        (307.5, 0.1, 0.5, 0.5),
    ],
)
def test_the_deadline_comes_from_what_happens_without_action(
    start: float, heating: float, latency_s: float, expected: float | None
) -> None:
    stage = run(Stage(ScriptedAction(GOOD), start=start, heating=heating, bounds=Bounds(Budget(latency_s=latency_s))))
    deadline_s = stage.trace.of(FallbackArmed)[0].deadline_s
    if expected is None:
        assert deadline_s == pytest.approx((313.0 - 305.1) / 0.101 - 5.0, abs=1.0)
    else:
        assert deadline_s == pytest.approx(expected, abs=1.0) and deadline_s >= min(1.0, latency_s)


def test_the_fallback_is_armed_before_anything_is_proposed() -> None:
    stage = run(Stage(ScriptedAction(RuntimeError("never asked")), heating=0.0, monitoring=ScriptedMonitoring()))
    assert stage.kinds == ["state-entered"]
    asking = Asking()
    stage = Stage(asking, start=305.0)
    asking.stage = stage
    run(stage)
    assert asking.kinds[-1] == "fallback-armed"


class Asking(ScriptedAction):
    """Notes the trace at the moment it is asked."""

    def __init__(self) -> None:
        super().__init__(GOOD)
        self.stage: Stage | None = None
        self.kinds: list[str] = []

    async def act(self, situation, path, advice):  # type: ignore[no-untyped-def]
        assert self.stage is not None
        self.kinds = self.stage.kinds
        return await super().act(situation, path, advice)


def test_declared_thinking_costs_what_is_declared_however_long_it_takes() -> None:
    """A slow machine must not change the run: the deadline of 1 s is not a matter of the wall clock."""
    stage = run(Stage(ScriptedAction(BAD, GOOD, delay_s=0.6), start=307.4, clock=DeclaredClock(1.0)))
    assert stage.trace.of(FallbackArmed)[0].deadline_s == 1.0
    assert stage.guard.latched is None and stage.plant.written[0] == (52.0, GOOD.commands)
