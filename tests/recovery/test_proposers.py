"""Several proposers: answers that are none, proposals that were judged before, and time that is shared out."""

from __future__ import annotations

import asyncio
import math
import time
from dataclasses import replace
from itertools import pairwise

import pytest

from homeostat.agents.checks import CLOSED
from homeostat.agents.roles import NoAdmissiblePlan, Proposer, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.events.recovery import Attempted, GaveUp, ReleasedActions, ReleaseRefused
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.mode import PersonCommand, Role, Verb
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.domain.verdict import REPEATED, FallbackNeeded, Finding, Released, Revise, RolloutResult
from homeostat.links.clock import ThinkingClock
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, ScriptedPlanning, ScriptedReprompting
from tests.recovery.line import BAD, GOOD, HALF, MACHINE, Stage, feed, monitoring, run, safe

WRONG = Revise((Finding("CHK-ANSWER", Owner.ACTION, -math.inf, "1", 0.0, 0, "not a JSON object"),))
"""An answer that is none of those that were asked for."""
NOTICED_S = 50.0
HOST_LATE_S = 0.5  # by which a host that is busy with other work may wake a thread too late


def second(action: ScriptedAction | None = None, name: str = "second") -> Proposer:
    return Proposer(name, ScriptedPlanning(MACHINE, ("reduce",)), action or ScriptedAction(GOOD), ScriptedReprompting())


def searching(action: ScriptedAction | None = None) -> Proposer:
    """A second one that is thorough, and knows one path."""
    planning = ScriptedPlanning(MACHINE, ("reduce",), NoAdmissiblePlan("no other path"))
    return Proposer("second", planning, action or ScriptedAction(GOOD), ScriptedReprompting(), thorough=True)


def tried(stage: Stage) -> list[ActionSet]:
    """Every action set that the twin rolls out from now on, in order."""
    found: list[ActionSet] = []
    stage.twin.bug = found.append
    return found


# --- paths that close --------------------------------------------------------------------------------------------


def closing(action: ScriptedAction, planning: ScriptedPlanning) -> Stage:
    """A plant at 287.5 K that heats by a quarter kelvin per second, so ``when_cold`` is open for ten seconds more."""
    return Stage(action, planning=planning, heating=0.25, start=275.0, clock=ThinkingClock(20.0))


def test_a_path_that_closes_while_the_commands_are_thought_about_is_not_taken() -> None:
    """It is open up to 290 K; the plant passes that while the answer is awaited."""
    planning = ScriptedPlanning(MACHINE, ("when_cold",), ("reduce",))
    stage = closing(ScriptedAction(GOOD, delay_s=0.6), planning)
    run(stage)
    first, then, *_ = stage.trace.of(Attempted)
    assert [f.criterion for f in first.findings] == [CLOSED] and not first.approved and first.members == 0
    assert first.findings[0].owner is Owner.PLANNING
    assert then.members == 2, "the same commands by another path were never judged, and are tried"


class Keeping(ScriptedReprompting):
    """Reprompting that keeps the path whatever happens."""

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        return Advice(route=Owner.ACTION, keep_path=attempt.path)


def test_a_kept_path_that_closed_is_planned_anew() -> None:
    planning = ScriptedPlanning(MACHINE, ("when_cold",), ("reduce",))
    action = ScriptedAction(BAD, GOOD, delay_s=0.3)
    stage = closing(action, planning)
    stage.reprompting = Keeping()
    run(stage)
    assert [path.transitions[0].name for _, path, _ in action.asked[:3]] == ["when_cold", "when_cold", "reduce"]


# --- answers that are none --------------------------------------------------------------------------------------


def test_an_answer_of_planning_that_is_none_counts_and_is_fed_back() -> None:
    planning, action = ScriptedPlanning(MACHINE, WRONG, ("reduce",)), ScriptedAction(GOOD)
    stage = run(Stage(action, planning=planning, start=305.0))
    first, then = stage.trace.of(Attempted)
    assert (first.number, first.path, first.commands, first.digest, first.members) == (1, (), (), "", 0)
    assert not first.approved and first.findings == WRONG.findings
    assert (then.number, then.approved) == (2, True)
    (_, before), (_, after) = planning.asked
    assert before.attempts == () and after.attempts == (Attempt(1, None, None, WRONG),)
    assert len(action.asked) == 1, "where there is no path nobody is asked for commands"
    assert isinstance(monitoring(stage).outcomes[0], Released)


def test_an_answer_of_action_that_is_none_counts_and_is_fed_back() -> None:
    action = ScriptedAction(WRONG, BAD, GOOD)
    stage = run(Stage(action, start=305.0))
    attempts = stage.trace.of(Attempted)
    assert [(a.number, a.approved, a.members) for a in attempts] == [(1, False, 0), (2, False, 2), (3, True, 2)]
    assert attempts[0].path == ("running", "reduced") and attempts[0].commands == ()
    fed_back = action.asked[2][2].attempts
    assert [a.number for a in fed_back] == [1, 2]
    assert (fed_back[0].actions, fed_back[0].verdict) == (None, WRONG) and fed_back[1].actions == BAD
    assert [commands for _, commands in stage.plant.written] == [GOOD.commands]


@pytest.mark.parametrize("where", ["planning", "action"])
def test_a_proposer_that_never_answers_properly_uses_its_attempts_up(where: str) -> None:
    planning = ScriptedPlanning(MACHINE, WRONG if where == "planning" else ("reduce",))
    others = (second(),)
    stage = Stage(ScriptedAction(WRONG), planning=planning, others=others, start=305.0, attempts=3)
    rolled_out = tried(stage)
    run(stage)
    assert [a.proposer for a in stage.trace.of(Attempted)] == ["scripted"] * 3 + ["second"]
    (gave_up,) = stage.trace.of(GaveUp)
    assert (gave_up.proposer, gave_up.reason) == ("scripted", "scripted: no proposal was approved in 3 attempts")
    assert stage.trace.of(ReleasedActions)[0].proposer == "second"
    assert rolled_out.index(GOOD) == 3, "after what follows without action and two fallbacks: nothing for no answer"


def test_the_same_proposal_is_refused_before_it_is_simulated() -> None:
    stage = Stage(ScriptedAction(BAD, BAD, GOOD), start=305.0)
    rolled_out = tried(stage)
    run(stage)
    attempts = stage.trace.of(Attempted)
    assert [a.approved for a in attempts] == [False, False, True]
    (finding,) = attempts[1].findings
    assert finding.criterion == REPEATED and "attempt 1" in finding.message and attempts[1].members == 0
    assert attempts[1].digest == attempts[0].digest and rolled_out.count(BAD) == 1


def test_every_earlier_attempt_counts_not_only_the_last() -> None:
    other = feed(0.028, "reduced")
    stage = Stage(ScriptedAction(BAD, other, BAD, other, GOOD), start=305.0)
    rolled_out = tried(stage)
    run(stage)
    repeated = [a for a in stage.trace.of(Attempted) if a.findings[0].criterion == REPEATED]
    assert [a.number for a in repeated] == [3, 4]
    assert ["attempt 1" in repeated[0].findings[0].message, "attempt 2" in repeated[1].findings[0].message] == [
        True
    ] * 2
    assert (rolled_out.count(BAD), rolled_out.count(other)) == (1, 1)


def test_the_same_commands_for_another_state_are_another_proposal() -> None:
    planning = ScriptedPlanning(MACHINE, ("reduce",), ("hold",), ("reduce",))
    action = ScriptedAction(feed(0.03, "reduced"), feed(0.03, "still"), GOOD)
    stage = run(Stage(action, planning=planning, start=305.0))
    assert [a.members for a in stage.trace.of(Attempted)] == [2, 2, 2]


def test_what_one_proposer_had_refused_the_next_may_try() -> None:
    """It has not seen it, and its own reprompting must learn from it."""
    others = (second(ScriptedAction(BAD, GOOD)),)
    stage = run(Stage(ScriptedAction(BAD), others=others, start=305.0, attempts=1))
    assert [(a.proposer, a.members) for a in stage.trace.of(Attempted)] == [
        ("scripted", 2), ("second", 2), ("second", 2),
    ]  # fmt: skip


class Hanging(ScriptedReprompting):
    """Reprompting that never comes back."""

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        await asyncio.Event().wait()
        raise AssertionError


class Timed(ScriptedAction):
    """Notes when it is asked, in wall-clock seconds."""

    def __init__(self, *answers: ActionSet | Revise | Exception) -> None:
        super().__init__(*answers)
        self.asked_s: list[float] = []

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Revise:
        self.asked_s.append(time.monotonic())
        return await super().act(situation, path, advice)


def failing(how: str) -> Stage:
    """A stage whose first proposer fails in one way, with a second one that knows what to do."""
    stage = Stage(ScriptedAction(GOOD), others=(searching(),), start=301.0, attempts=2,
                  clock=ThinkingClock(), bounds=Bounds(Budget(latency_s=1.0, last_s=0.5)))  # fmt: skip
    match how:
        case "planning hangs":
            stage.planning = ScriptedPlanning(MACHINE, ("reduce",), delay_s=60.0)
        case "action hangs":
            stage.action = ScriptedAction(GOOD, delay_s=60.0)
        case "action computes":
            stage.action = ScriptedAction(GOOD, thread_s=0.8)
        case "reprompting hangs":
            stage.action, stage.reprompting = ScriptedAction(BAD), Hanging()
        case "has no plan":
            stage.planning = ScriptedPlanning(MACHINE, NoAdmissiblePlan("scripted: the model refused"))
        case "has no commands":
            stage.action = ScriptedAction(NoAdmissiblePlan("scripted: the key was not accepted"))
        case "is never right":
            stage.action = ScriptedAction(BAD, feed(0.028, "reduced"))
        case "wants what is not open":
            stage.planning = ScriptedPlanning(MACHINE, ("when_cold",))
        case "breaks":
            stage.action = ScriptedAction(ZeroDivisionError("scripted: a mean of nothing"))
        case "has a bug":
            stage.action = ScriptedAction(None)
    return stage


WAYS = {
    "planning hangs": "in the time that was left", "action hangs": "in the time that was left",
    "action computes": "in the time that was left", "reprompting hangs": "in the time that was left",
    "has no plan": "the model refused", "has no commands": "the key was not accepted",
    "is never right": "in 2 attempts", "wants what is not open": "is not open now",
    "breaks": "a mean of nothing", "has a bug": "failed: AttributeError",
}  # fmt: skip


@pytest.mark.parametrize("how", WAYS)
def test_whatever_becomes_of_the_first_proposer_the_next_one_acts_in_time(how: str) -> None:
    stage = run(failing(how))
    (gave_up,) = stage.trace.of(GaveUp)
    assert gave_up.proposer == "scripted" and "scripted" in gave_up.reason and WAYS[how] in gave_up.reason
    assert stage.trace.of(ReleasedActions)[0].proposer == "second"
    assert stage.guard.latched is None and stage.plant.written[0][1] == GOOD.commands
    assert stage.plant.written[0][0] <= NOTICED_S + math.ceil(stage.clock.total_s) + 1.0, "right after thinking"


def test_what_the_release_check_refuses_is_fed_back_to_the_proposer() -> None:
    careful = feed(0.8 * HALF, "reduced")
    action = ScriptedAction(GOOD, careful)
    stage = Stage(action, start=305.0)
    rolled_out = tried(stage)
    stage.twin.result = lambda actions: (
        RolloutResult.BROKE_DOWN if rolled_out.count(GOOD) == 2 and actions == GOOD else RolloutResult.COMPLETED
    )
    run(stage)
    (refused,) = stage.trace.of(ReleaseRefused)
    assert (refused.proposer, refused.digest) == ("scripted", GOOD.digest)
    advice = action.asked[1][2]
    assert [f.criterion for f in advice.findings] == ["CHK-ROLLOUT"] and advice.attempts[0].actions == GOOD
    assert [commands for _, commands in stage.plant.written] == [careful.commands] and not stage.trace.of(GaveUp)


def test_what_the_guard_refuses_is_fed_back_to_the_proposer() -> None:
    """The twin knows nothing of who has taken a valve out of service; the guard does, and says so."""
    with_valve = replace(GOOD, commands=(*GOOD.commands, Command("V.man", 0.5, 0.2)))
    action = ScriptedAction(with_valve, GOOD)
    stage = Stage(action, start=305.0)
    order = PersonCommand("1", "anna", Role.OPERATOR, Verb.OUT_OF_SERVICE, "V.man", reason="it sticks")
    stage.hook = lambda seen: stage.guard.mailbox.put(order) if seen.now_s == 10.0 else None
    run(stage)
    (finding,) = action.asked[1][2].findings
    assert finding.criterion == "CHK-SERVICE" and "'V.man' is out of service" in finding.message
    assert action.asked[1][2].attempts[0].verdict == Revise((finding,))
    assert [commands for _, commands in stage.plant.written] == [GOOD.commands]


def test_the_last_seconds_are_kept_for_a_thorough_proposer() -> None:
    last = Timed(GOOD)
    stage = Stage(ScriptedAction(GOOD, delay_s=60.0), others=(searching(last),), start=301.0, clock=ThinkingClock(),
                  bounds=Bounds(Budget(latency_s=1.2, last_s=0.7)))  # fmt: skip
    begin = time.monotonic()
    run(stage)
    assert last.asked_s[0] - begin >= 0.4, "after 0.5 s, with 0.7 s left, which are enough"
    assert stage.trace.of(ReleasedActions)[0].proposer == "second"


def test_every_attempt_is_told_the_time_that_is_left() -> None:
    action = ScriptedAction(BAD, BAD, GOOD, delay_s=0.6)
    stage = Stage(action, start=301.0, clock=ThinkingClock(10.0), bounds=Bounds(Budget(latency_s=60.0)))
    run(stage)
    told = [(situation.snapshot.at_s, situation.deadline_s) for situation, *_ in action.asked]
    assert len(told) >= 2
    for (before_s, before), (at_s, left) in pairwise(told):
        assert at_s > before_s and left == pytest.approx(before - (at_s - before_s))


def test_where_there_is_no_more_time_than_that_the_first_is_not_waited_for() -> None:
    slow = ScriptedAction(GOOD, delay_s=0.3)
    stage = Stage(
        slow,
        others=(searching(),),
        start=301.0,
        clock=ThinkingClock(),
        bounds=Bounds(Budget(latency_s=1.0, last_s=4.0)),
    )
    run(stage)  # had the first been waited for, it would have acted
    assert stage.trace.of(GaveUp)[0].proposer == "scripted"
    assert stage.trace.of(ReleasedActions)[0].proposer == "second"


@pytest.mark.parametrize(("scale", "latency_s", "hang"), [
    (0.0, 0.8, "waits"), (1.0, 1.0, "waits"), (5.0, 5.0, "waits"), (1.0, 1.0, "computes"),
])  # fmt: skip
def test_when_all_fail_the_fallback_acts_two_ticks_after_the_deadline(
    scale: float, latency_s: float, hang: str
) -> None:
    """Both proposers hang for real; what counts is the process time at which the fallback was written.

    One tick has begun when the deadline passes, and in the next one the guard hears of it. A host that is
    late by the clock is late by `scale` times as much in process time.
    """

    def slow() -> ScriptedAction:
        return ScriptedAction(GOOD, delay_s=30.0) if hang == "waits" else ScriptedAction(GOOD, thread_s=1.5)

    stage = Stage(slow(), others=(second(slow()),), start=301.0, clock=ThinkingClock(scale),
                  bounds=Bounds(Budget(latency_s=latency_s), InterventionBounds(waits=0)))  # fmt: skip
    run(stage)
    (outcome,) = monitoring(stage).outcomes
    assert isinstance(outcome, FallbackNeeded) and safe(stage)
    assert [g.proposer for g in stage.trace.of(GaveUp)] == ["scripted", "second"]
    acted_s, _ = stage.plant.written[0]
    assert acted_s <= NOTICED_S + (latency_s if scale else 0.0) + 2.0 + scale * HOST_LATE_S
    (fell,) = stage.trace.of(FallbackActivated)
    at_s = next(e.at_s for e in stage.trace.entries if e.event is fell)
    assert f"within {latency_s:.1f} s" in fell.reason and at_s == pytest.approx(acted_s, abs=1.0)


def test_when_all_give_up_the_reason_is_the_last_one_s() -> None:
    quits = second(ScriptedAction(NoAdmissiblePlan("second: nothing is left")))
    third = second(ScriptedAction(BAD), "third")
    stage = run(Stage(ScriptedAction(BAD), others=(quits, third), start=305.0, attempts=1))
    assert [g.proposer for g in stage.trace.of(GaveUp)] == ["scripted", "second", "third"]
    (fell,) = stage.trace.of(FallbackActivated)
    assert fell.reason.startswith("third: no proposal was approved") and safe(stage)
