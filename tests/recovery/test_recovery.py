"""The loop, driven by scripted agents through every way it can end."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

import pytest

from homeostat.agents.roles import NoAdmissiblePlan, Proposer
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.events.guard import Armed
from homeostat.domain.events.recovery import Attempted, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.verdict import Approve, FallbackNeeded, NoActionNeeded, Released, RolloutResult
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import (
    SYMPTOM,
    ScriptedAction,
    ScriptedMonitoring,
    ScriptedPlanning,
    ScriptedReprompting,
    ScriptedValidation,
)
from tests.recovery.line import BAD, DRAIN, GOOD, HALF, MACHINE, OFF, Stage, feed, monitoring, run, safe


def test_what_is_approved_the_first_time_is_released() -> None:
    stage = run(Stage(ScriptedAction(GOOD), start=305.0))
    (outcome,) = monitoring(stage).outcomes
    assert isinstance(outcome, Released) and outcome.actions == GOOD
    assert [commands for _, commands in stage.plant.written] == [GOOD.commands]
    assert stage.guard.latched is None
    assert stage.kinds == [
        "state-entered", "noticed", "diagnosed", "fallback-armed", "attempted", "state-entered", "released",
    ]  # fmt: skip
    (released,) = stage.trace.of(ReleasedActions)
    assert (released.proposer, released.target, released.digest) == ("scripted", "reduced", GOOD.digest)
    assert released.min_margin >= 0.0


def test_what_is_released_recovers_the_plant() -> None:
    stage = run(Stage(ScriptedAction(GOOD), start=305.0))
    assert stage.plant.hottest <= 313.0 and stage.plant.readings[-1].values["F.sp"] == HALF


def test_a_refused_proposal_is_reprompted_with_its_findings() -> None:
    action = ScriptedAction(BAD, BAD, GOOD)
    stage = run(Stage(action, start=305.0))
    assert isinstance(monitoring(stage).outcomes[0], Released)
    attempts = stage.trace.of(Attempted)
    assert [(a.number, a.approved) for a in attempts] == [(1, False), (2, False), (3, True)]
    advices = [advice for _, _, advice in action.asked]
    assert advices[0].findings == () and [a.tries for a in advices] == [0, 1, 2]
    assert {f.criterion for f in advices[1].findings} == {"ACC-CALM", "LIM-HOT"}
    assert all(f.margin < 0.0 for f in advices[1].findings)
    assert [commands for _, commands in stage.plant.written] == [GOOD.commands]


@pytest.mark.parametrize("attempts", [1, 3])
def test_what_is_never_approved_is_handed_over_within_the_attempts(attempts: int) -> None:
    stage = run(Stage(ScriptedAction(BAD), start=305.0, attempts=attempts))
    (outcome,) = monitoring(stage).outcomes
    assert isinstance(outcome, FallbackNeeded) and f"in {attempts} attempts" in outcome.reason
    assert len(stage.trace.of(Attempted)) == attempts
    assert safe(stage) and stage.trace.of(ReleasedActions) == ()


def test_after_a_hand_over_nothing_is_tried_again() -> None:
    watching = ScriptedMonitoring(50.0, 60.0, 70.0)
    stage = run(Stage(ScriptedAction(BAD), start=305.0, monitoring=watching))
    assert watching.diagnosed == [50.0] and len(watching.outcomes) == 1
    assert len(stage.plant.written) == 1
    assert watching.seen == [float(k) for k in range(1, 121)], "watching goes on"


def test_proposers_are_asked_in_their_order_while_there_is_something_to_win() -> None:
    second = ScriptedAction(GOOD)
    others = (Proposer("second", ScriptedPlanning(MACHINE, ("reduce",)), second, ScriptedReprompting()),)
    stage = run(Stage(ScriptedAction(BAD), others=others, start=305.0, attempts=2))
    assert [a.proposer for a in stage.trace.of(Attempted)] == ["scripted", "scripted", "second"]
    assert stage.trace.of(ReleasedActions)[0].proposer == "second"
    dearer = ScriptedAction(feed(0.9 * HALF, "reduced"))
    others = (Proposer("second", ScriptedPlanning(MACHINE, ("reduce",)), dearer, ScriptedReprompting()),)
    stage = run(Stage(ScriptedAction(GOOD), others=others, start=305.0))
    assert [a.proposer for a in stage.trace.of(Attempted)] == ["scripted", "second"], "half of the product may be won"
    assert [r.proposer for r in stage.trace.of(ReleasedActions)] == ["scripted"], "and was not"


def test_where_no_path_is_left_the_reason_is_said() -> None:
    planning = ScriptedPlanning(MACHINE, NoAdmissiblePlan("every target was refused"))
    stage = run(Stage(ScriptedAction(GOOD), planning=planning, start=305.0))
    assert stage.trace.of(FallbackActivated)[0].reason == "every target was refused" and safe(stage)


# --- bugs -------------------------------------------------------------------------------------------------------


class Bug(Exception):
    """Something that nobody expects."""


def broken(role: str, error: Callable[[str], BaseException] = Bug, times: int = 1) -> Stage:
    """A stage on which one role has a bug: it raises ``error``; release checks of what was approved do so ``times``."""
    stage = Stage(ScriptedAction(BAD, GOOD), start=305.0)
    match role:
        case "monitoring":
            stage.monitoring = ScriptedMonitoring(50.0, bug=error(role))
        case "planning":
            stage.planning = ScriptedPlanning(MACHINE, error(role))
        case "action":
            stage.action = ScriptedAction(error(role))
        case "simulation":
            stage.twin.bug = lambda actions: error(role)
        case "simulation of the proposal":
            stage.twin.bug = lambda actions: error(role) if actions == BAD else None
        case "validation":

            def fail(*_: object) -> Approve:
                raise error(role)

            stage.validation = ScriptedValidation(fail)
        case "reprompting":
            stage.reprompting = ScriptedReprompting(error(role))
        case "release check":
            stage.action = ScriptedAction(GOOD)
            tried: list[object] = []

            def second(actions: object) -> BaseException | None:
                tried.append(actions)
                return error(role) if actions == GOOD and tried.count(GOOD) in range(2, 2 * times + 1, 2) else None

            stage.twin.bug = second
    return stage


ROLES = (
    "monitoring", "planning", "action", "simulation", "simulation of the proposal", "validation", "reprompting",
    "release check",
)  # fmt: skip


@pytest.mark.parametrize("role", ROLES)
def test_a_bug_is_an_alarm_and_the_guard_goes_on(role: str) -> None:
    """Whatever fails, the plant ends up inside its limit: by a later try, by the time that was left, or by the trip."""
    stage = run(broken(role))
    assert stage.alarms and all("Bug" in text and role in text for text in stage.alarms)
    assert len(stage.plant.readings) == 120, "the run goes to its end"
    assert stage.plant.hottest <= 313.5
    assert safe(stage) or stage.trace.of(ReleasedActions)


def test_a_bug_that_does_not_go_away_ends_recovery_and_the_fallback_acts_in_time() -> None:
    stage = run(broken("planning"))
    assert len(stage.alarms) == 3 and len(stage.lost) == 1 and stage.trace.of(ReleasedActions) == ()
    (fell,) = stage.trace.of(FallbackActivated)
    assert "has not acted in the time that physics leaves" in fell.reason
    assert safe(stage) and stage.plant.hottest <= 313.0


class Ends(BaseException):
    """Something that is no Exception."""


@pytest.mark.parametrize("error", [asyncio.CancelledError, SystemExit, StopIteration, KeyboardInterrupt, Ends])
@pytest.mark.parametrize("role", ["planning", "action", "simulation of the proposal", "validation", "release check"])
def test_whatever_does_not_go_away_the_fallback_acts_at_the_first_time_that_was_armed(
    role: str, error: Callable[[str], BaseException]
) -> None:
    stage = broken(role, error, times=3)
    if role == "simulation of the proposal":
        stage.action = ScriptedAction(BAD)
    run(stage)
    assert len(stage.alarms) == 3 and len(stage.lost) == 1 and stage.trace.of(ReleasedActions) == ()
    times_s = [armed.act_by_s for armed in stage.trace.of(Armed)]
    assert times_s[0] is not None and times_s == sorted(times_s, reverse=True), "it only comes nearer"
    acted_s, _ = stage.plant.written[0]
    assert times_s[-1] <= acted_s <= times_s[-1] + 1.0 and safe(stage) and stage.plant.hottest <= 313.0
    assert len(stage.plant.readings) == 120, "the run goes to its end"


@pytest.mark.parametrize("error", [asyncio.CancelledError, SystemExit, StopIteration])
@pytest.mark.parametrize("role", ["monitoring", "simulation"])
def test_whatever_ends_a_diagnosis_or_the_first_prediction_is_told_three_times_and_the_limit_trips(
    role: str, error: Callable[[str], BaseException]
) -> None:
    stage = run(broken(role, error))
    assert len(stage.alarms) == 3 and len(stage.lost) == 1 and safe(stage) and stage.plant.hottest <= 313.5


def test_a_bug_while_watching_is_an_alarm() -> None:
    class Blind(ScriptedMonitoring):
        def notices(self, snapshot) -> bool:  # type: ignore[no-untyped-def]
            if snapshot.at_s == 40.0:
                raise Bug("feature")
            return super().notices(snapshot)

    stage = run(Stage(ScriptedAction(GOOD), start=305.0, monitoring=Blind(50.0)))
    assert stage.alarms == ["recovery failed (1 of 3): Bug: feature"]
    assert [commands for _, commands in stage.plant.written] == [GOOD.commands], "the next fault is attended to"


# --- the plant meanwhile -----------------------------------------------------------------------------------------


def test_a_hard_limit_that_breaks_while_thinking_prevents_the_release() -> None:
    """0.3 s of thought are 60 s of the process: T rises from 308.5 K through the limit, then half feed is too late."""
    stage = Stage(
        ScriptedAction(GOOD, delay_s=0.3), start=303.5, clock=ThinkingClock(200.0), monitoring=ScriptedMonitoring(50.0)
    )
    stage.bounds = Bounds(intervention=InterventionBounds(waits=0))
    run(stage)
    assert stage.trace.of(ReleasedActions) == () and safe(stage)
    assert isinstance(monitoring(stage).outcomes[0], FallbackNeeded)


def test_a_hard_limit_that_breaks_unnoticed_is_handed_over() -> None:
    stage = run(Stage(ScriptedAction(GOOD), start=305.0, monitoring=ScriptedMonitoring()))
    (fell,) = stage.trace.of(FallbackActivated)
    assert "'T <= 313' is violated" in fell.reason and safe(stage)
    acted_s, commands = stage.plant.written[0]
    assert commands == DRAIN.actions.commands
    assert 80.0 < acted_s <= 86.0, "80 s of heating reach the limit"
    (outcome,) = monitoring(stage).outcomes
    assert isinstance(outcome, FallbackNeeded) and outcome.at_s == acted_s, "monitoring is told at the tick of the trip"


def test_start_up_is_not_judged() -> None:
    stage = Stage(ScriptedAction(GOOD), start=330.0, end_s=20.0, monitoring=ScriptedMonitoring())
    stage.plant.level = 1.0
    run(stage)
    assert stage.plant.written == [] and stage.kinds == []


def test_the_end_of_the_plant_while_thinking_ends_the_watch() -> None:
    action = ScriptedAction(GOOD, delay_s=0.1)
    stage = run(Stage(action, start=300.0, clock=ThinkingClock(1000.0), end_s=60.0))
    assert stage.ended and stage.plant.written == [] and stage.alarms == []
    assert monitoring(stage).outcomes == [], "what was thought about is over"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_blindness_trips_after_its_grace_time(value: float) -> None:
    stage = Stage(ScriptedAction(GOOD), monitoring=ScriptedMonitoring())

    def fail(at_s: float, values: dict[str, float]) -> None:
        values["T"] = value if at_s >= 60.0 else values["T"]

    stage.plant.disturb = fail
    run(stage)
    (fell,) = stage.trace.of(FallbackActivated)
    assert "could not be judged for 4 s; 3 s are allowed" in fell.reason
    assert stage.plant.written[0][0] == 63.0 and safe(stage)


def test_a_reading_that_fails_while_thinking_prevents_the_release() -> None:
    stage = Stage(ScriptedAction(GOOD, delay_s=0.1), start=305.0, clock=ThinkingClock(50.0))

    def fail(at_s: float, values: dict[str, float]) -> None:
        values["T"] = math.nan if at_s >= 52.0 else values["T"]

    stage.plant.disturb = fail
    run(stage)
    assert stage.trace.of(ReleasedActions) == () and safe(stage)


def test_a_plant_that_does_not_answer_is_made_safe() -> None:
    stage = Stage(ScriptedAction(GOOD, delay_s=0.3), start=305.0, clock=ThinkingClock(50.0))
    stage.plant.read_error = TimeoutError()
    run(stage)
    assert stage.trace.of(ReleasedActions) == () and safe(stage) and stage.ended


# --- the twin ----------------------------------------------------------------------------------------------------


def test_a_twin_that_breaks_down_without_action_is_handed_over() -> None:
    stage = Stage(ScriptedAction(GOOD), start=305.0)
    stage.twin.result = lambda actions: RolloutResult.BROKE_DOWN
    run(stage)
    assert safe(stage) and isinstance(monitoring(stage).outcomes[0], FallbackNeeded)


def test_a_proposal_on_which_the_twin_breaks_down_is_only_refused() -> None:
    stage = Stage(ScriptedAction(BAD, GOOD), start=305.0)
    stage.twin.result = lambda actions: RolloutResult.BROKE_DOWN if actions == BAD else RolloutResult.COMPLETED
    run(stage)
    assert [a.approved for a in stage.trace.of(Attempted)] == [False, True]
    assert [commands for _, commands in stage.plant.written] == [GOOD.commands]


def test_a_recovered_plant_whose_twin_breaks_down_is_not_left_alone() -> None:
    watching = ScriptedMonitoring(20.0, 100.0)
    stage = Stage(ScriptedAction(GOOD, BAD), start=305.0, monitoring=watching, attempts=1)
    broken_from = 60.0
    stage.twin.result = lambda actions: (
        RolloutResult.BROKE_DOWN
        if stage.twin.last is not None and stage.twin.last.at_s > broken_from
        else RolloutResult.COMPLETED
    )
    run(stage)
    assert isinstance(watching.outcomes[0], Released)
    assert isinstance(watching.outcomes[1], FallbackNeeded) and safe(stage)


# --- what a proposer may not do ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("transitions", "actions", "wrong"),
    [
        (("adjust",), GOOD, "starts in a state where the plant is not"),
        (("when_cold",), GOOD, "its guard does not hold"),
        (("reduce",), feed(OFF, "still"), "its commands lead elsewhere"),
        (("start",), feed(HALF, "running"), "not an answer to a fault, and no state to recover to"),
    ],
)
def test_a_proposal_that_the_machine_does_not_admit_is_not_released(
    transitions: tuple[str, ...], actions: object, wrong: str
) -> None:
    planning = ScriptedPlanning(MACHINE, transitions)
    stage = run(Stage(ScriptedAction(actions), planning=planning, start=305.0))  # type: ignore[arg-type]
    assert stage.trace.of(ReleasedActions) == (), wrong
    assert safe(stage)


def test_healthy_means_no_thinking() -> None:
    watching = ScriptedMonitoring(50.0, answer=lambda at_s: Diagnosis(at_s, (), ()))
    stage = run(Stage(ScriptedAction(GOOD), heating=0.01, monitoring=watching))
    assert watching.outcomes == [] and stage.plant.written == []


def test_a_plant_that_is_fine_as_it_is_is_left_alone() -> None:
    stage = run(Stage(ScriptedAction(BAD), heating=0.0))
    (outcome,) = monitoring(stage).outcomes
    assert isinstance(outcome, NoActionNeeded) and outcome.min_margin >= 0.0
    assert stage.plant.written == [] and "no-action" in stage.kinds


def test_the_situation_is_fresh() -> None:
    action = ScriptedAction(GOOD)
    run(Stage(action, start=305.0, clock=DeclaredClock(7.0)))
    situation, path, _ = action.asked[0]
    assert situation.snapshot.at_s == 57.0, "seven seconds of thought have passed"
    assert situation.state == "running" and path.target == "reduced"
    assert situation.diagnosis.hypotheses == (Hypothesis((FaultState("runaway", 1.0, 50.0),), 1.0),)
    assert situation.diagnosis.symptoms == (SYMPTOM,)


def test_the_same_run_leaves_the_same_trace() -> None:
    traces = {run(Stage(ScriptedAction(BAD, GOOD), start=305.0)).trace.last for _ in range(2)}
    assert len(traces) == 1
