"""The guard acts at its tick whatever recovery is doing: slow, hanging, or never letting go."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import pytest

from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.guard import Armed
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.recovery import ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import Observation
from homeostat.domain.verdict import FallbackNeeded, NoActionNeeded, Released
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.recovery.bounds import Budget
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, ScriptedMonitoring, diagnosis
from tests.recovery.line import GOOD, Stage, monitoring, run, safe

TRIP_S = 84.0
"""From 305 K at 0.1 K/s the limit of 313 K is passed after 80 s; then 0.5 K s are used up."""


def endless(stop: threading.Event) -> Callable[[float], Diagnosis]:
    """A diagnosis that never lets go of its thread."""

    def answer(at_s: float) -> Diagnosis:
        while not stop.is_set():
            time.sleep(0.001)
        return diagnosis(at_s)

    return answer


@pytest.mark.parametrize("scale", [100.0, 1000.0])
def test_the_fallback_acts_at_the_tick_of_the_violation_while_a_diagnosis_hangs(scale: float) -> None:
    stop = threading.Event()
    watching = ScriptedMonitoring(50.0, answer=endless(stop))
    stage = Stage(
        ScriptedAction(GOOD), start=305.0, monitoring=watching, clock=ThinkingClock(scale),
        bounds=Bounds(Budget(diagnosis_s=1e6)),
    )  # fmt: skip
    try:
        run(stage)
    finally:
        stop.set()
    acted_s, _ = stage.plant.written[0]
    assert 80.0 < acted_s <= TRIP_S and safe(stage)
    assert watching.diagnosed == [50.0] and stage.trace.of(ReleasedActions) == ()
    assert len(stage.plant.readings) == 120


def test_a_proposer_that_never_yields_does_not_keep_the_guard_from_tripping() -> None:
    stop = threading.Event()

    class Stubborn(ScriptedAction):
        async def act(self, situation, path, advice):  # type: ignore[no-untyped-def]
            while not stop.is_set():
                time.sleep(0.001)
            return GOOD

    stage = Stage(Stubborn(), start=305.0, clock=ThinkingClock(200.0))
    try:
        run(stage)
    finally:
        stop.set()
    acted_s, _ = stage.plant.written[0]
    assert acted_s <= TRIP_S and safe(stage) and len(stage.plant.written) == 1


def test_a_late_diagnosis_counts_as_none_and_calls_a_person() -> None:
    """The plant stands while it thinks; after the time for a diagnosis nothing is known, and the trip remains."""
    stop = threading.Event()
    watching = ScriptedMonitoring(50.0, answer=endless(stop))
    stage = Stage(
        ScriptedAction(GOOD), start=305.0, monitoring=watching, clock=ThinkingClock(0.0),
        bounds=Bounds(Budget(diagnosis_s=0.1)),
    )  # fmt: skip
    try:
        run(stage)
    finally:
        stop.set()
    causes = [a.cause for a in stage.trace.of(AlarmRaised) if a.alarm == "recovery:diagnosis"]
    assert causes == ["the diagnosis took longer than 0.1 s; nothing counts as known"]
    assert stage.trace.of(Armed)[0].strategies[0] == "drain", "as in the tables"
    assert watching.seen[-1] == 50.0, "what thinks is not called again"
    assert 80.0 < stage.plant.written[0][0] <= TRIP_S and safe(stage)


def test_what_monitoring_was_not_shown_while_it_thought_is_shown_afterwards() -> None:
    class Slow(ScriptedMonitoring):
        def diagnose(self, deviates: bool = False) -> Diagnosis:
            time.sleep(0.15)
            return super().diagnose(deviates)

    watching = Slow(50.0)
    stage = Stage(
        ScriptedAction(GOOD), heating=0.0, monitoring=watching, clock=ThinkingClock(100.0), end_s=2000.0,
        bounds=Bounds(Budget(diagnosis_s=5.0)),
    )  # fmt: skip
    run(stage)
    assert watching.seen == [float(k) for k in range(1, 2001)]


def ordering(
    at_s: float, verb: Verb, subject: str = "", role: Role = Role.ENGINEER
) -> Callable[[Observation], list[PersonCommand]]:
    """What a person orders after the tick at ``at_s``."""
    order = PersonCommand(f"{verb.value}-{at_s:.0f}", "anna", role, verb, subject, reason="as tested")
    return lambda seen: [order] if seen.now_s == at_s else []


def told(stage: Stage, *orders: Callable[[Observation], list[PersonCommand]]) -> Stage:
    """``stage`` with somebody who orders things."""

    def hook(seen: Observation) -> None:
        for order in orders:
            for command in order(seen):
                stage.guard.mailbox.put(command)

    stage.hook = hook
    return stage


def test_a_change_of_mode_cancels_thinking_which_begins_again_under_the_new_one() -> None:
    stage = Stage(ScriptedAction(GOOD), heating=0.05, start=308.0, clock=DeclaredClock(10.0))
    run(told(stage, ordering(54.0, Verb.MODE, Mode.ADVISE.value)))
    assert monitoring(stage).diagnosed == [50.0, 55.0]
    assert stage.plant.written == []
    (outcome,) = monitoring(stage).outcomes
    assert isinstance(outcome, NoActionNeeded), "what passed was shown, and nobody wrote"


def test_in_mode_approve_the_release_waits_for_a_person() -> None:
    stage = Stage(ScriptedAction(GOOD), heating=0.04, start=308.0, mode=Mode.APPROVE)

    def hook(seen: Observation) -> None:
        if seen.now_s == 70.0:
            (offered,) = stage.guard.offered
            order = PersonCommand(
                "yes", "anna", Role.OPERATOR, Verb.APPROVE, offered.id, offered.actions.digest, "looks right"
            )
            stage.guard.mailbox.put(order)

    stage.hook = hook
    run(stage)
    assert stage.plant.written == [(71.0, GOOD.commands)]
    assert isinstance(monitoring(stage).outcomes[0], Released)


def test_after_a_reset_recovery_goes_on() -> None:
    watching = ScriptedMonitoring(50.0, 100.0)
    stage = Stage(ScriptedAction(GOOD), start=305.0, monitoring=watching, end_s=150.0)
    run(told(stage, ordering(40.0, Verb.FALL_BACK), ordering(80.0, Verb.RESET)))
    assert isinstance(watching.outcomes[0], FallbackNeeded) and isinstance(watching.outcomes[1], NoActionNeeded)
    assert watching.diagnosed == [100.0], "while the latch stands nobody thinks"
    assert len(stage.trace.of(FallbackActivated)) == 1
