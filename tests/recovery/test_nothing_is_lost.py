"""Nothing that was found is lost: by a proposer that fails, by a refusal, by a plant that goes on to another state."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest

from homeostat.agents.roles import Approved, NoAdmissiblePlan, Proposer, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import Attempted, Compared, GaveUp, NoActionTaken, ReleasedActions, ReleaseRefused
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.request import Answer, Request, RequestStatus
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import REPEATED, Approve, Revise, RolloutResult
from homeostat.guard.requests.permissives import refusal
from homeostat.guard.requests.seal import Sealer
from homeostat.recovery.release_check import Checked, ReleaseCheck
from homeostat.recovery.releasing import Overtaken
from tests.agents.scripted import ScriptedAction, ScriptedPlanning, ScriptedReprompting
from tests.recovery.desk import AT_ONCE, Recovery
from tests.recovery.line import BAD, GOOD, HALF, KEY, MACHINE, Stage, feed, run
from tests.recovery.rivals import (
    DEARER,
    HELD,
    LATENCY,
    NO_OTHER,
    SAVING,
    Polish,
    asked,
    by,
    doomed,
    proposer,
    safe,
    thorough,
)
from tests.safety.world import TAGS

# --- what goes wrong does not lose what was found ------------------------------------------------------------------


class Mute(ScriptedReprompting):
    """Reprompting that fails in a way of its own."""

    def __init__(self, how: Callable[[], Any]) -> None:
        super().__init__()
        self._how = how

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        result = self._how()
        if isinstance(result, BaseException):
            raise result
        await asyncio.sleep(60.0)
        raise AssertionError


FAILURES = {
    "breaks": (ZeroDivisionError("a mean of nothing"), "failed: ZeroDivisionError"),
    "quits": (NoAdmissiblePlan("the key was not accepted"), "the key was not accepted"),
    "times out": (TimeoutError("the model took too long"), "the model took too long"),
}


@pytest.mark.parametrize("how", FAILURES)
@pytest.mark.parametrize("order", ["before", "after"])
def test_a_proposer_that_fails_loses_nothing_that_another_one_found(how: str, order: str) -> None:
    error, text = FAILURES[how]
    if order == "before":
        done = doomed(error, others=(proposer("second", ScriptedAction(GOOD)),)).run()
        failed, good = "scripted", "second"
    else:
        done = doomed(GOOD, others=(proposer("second", ScriptedAction(error)),)).run()
        failed, good = "second", "scripted"
    assert by(done) == [(good, GOOD.digest)] and done.handed_over == []
    (gave_up,) = done.trace.of(GaveUp)
    assert gave_up.proposer == failed and text in gave_up.reason


@pytest.mark.parametrize("how", FAILURES)
def test_a_thorough_proposer_that_fails_later_loses_nothing_that_it_found(how: str) -> None:
    one = thorough(ScriptedAction(HELD, FAILURES[how][0]), "hold", "reduce")
    assert by(doomed(BAD, others=(one,)).run()) == [("thorough", HELD.digest)]


def test_a_bug_in_who_may_only_improve_leaves_the_plant_as_it_is_and_recovery_goes_on() -> None:
    done = safe(ZeroDivisionError("a mean of nothing"))
    done.run()
    assert done.released == [] and done.when(NoActionTaken) == [10.0] and len(done.monitoring.seen) == 20
    assert "ZeroDivisionError" in done.trace.of(GaveUp)[0].reason


@pytest.mark.parametrize(
    ("answer", "released", "attempts"),
    [(GOOD, GOOD, 2), (DEARER, SAVING, 2), (BAD, SAVING, 2), (SAVING, SAVING, 1), (None, SAVING, 1)],
    ids=["cheaper", "dearer", "not approved", "the same", "never"],
)
def test_numbers_that_are_bettered_lose_nothing(answer: ActionSet | None, released: ActionSet, attempts: int) -> None:
    done = doomed(SAVING, polishing=Polish(answer), bounds=LATENCY).run()
    assert by(done) == [("scripted", released.digest)] and len(asked(done)) == attempts
    listed = {a.digest: a.polished for a in done.trace.of(Compared)[0].alternatives if a.proposer}
    assert listed[SAVING.digest] is False and listed.get(GOOD.digest, True) is True


def test_what_is_held_by_hand_is_judged_and_released_and_what_the_search_proposes_is_left_to_it() -> None:
    polish = Polish(SAVING, {BAD.digest: SAVING, HELD.digest: BAD})
    done = doomed(BAD, others=(thorough(ScriptedAction(HELD), "hold", NO_OTHER),), polishing=polish).run()
    tried = [(a.proposer, a.digest) for a in done.trace.of(Attempted)]
    assert tried[:2] == [("scripted", SAVING.digest), ("thorough", HELD.digest)] and by(done)


def test_the_same_answer_is_the_same_proposal_however_it_is_held_by_hand() -> None:
    """What its controller would do is worked out of readings, and differs by a little each time."""
    polish = Polish(BAD, {BAD.digest: BAD})
    places = iter((feed(0.97, "reduced"), feed(0.98, "reduced"), feed(0.99, "reduced")))

    async def tracked(situation: Situation, path: RecoveryPath, actions: ActionSet) -> ActionSet:
        return next(places)

    polish.tracked = tracked  # type: ignore[method-assign]
    done = doomed(BAD, BAD, BAD, polishing=polish).run()
    first, *again = [each for each in done.trace.of(Attempted) if each.proposer == "scripted"]
    assert all(each.digest == first.digest for each in again) and again
    assert all([f.criterion for f in each.findings] == [REPEATED] for each in again)


@pytest.mark.parametrize("how", FAILURES)
def test_what_cannot_be_held_by_hand_loses_nothing_that_another_one_found(how: str) -> None:
    polish = Polish(SAVING, {SAVING.digest: FAILURES[how][0]})
    done = doomed(SAVING, others=(thorough(ScriptedAction(HELD), "hold", NO_OTHER),), polishing=polish).run()
    assert by(done) == [("thorough", HELD.digest)] and done.handed_over == []


@pytest.mark.parametrize("how", FAILURES)
def test_a_bettering_that_fails_loses_nothing_that_was_found(how: str) -> None:
    assert by(doomed(SAVING, polishing=Polish(FAILURES[how][0])).run()) == [("scripted", SAVING.digest)]


# --- what is refused at the release ------------------------------------------------------------------------------


def refusing(done: Recovery, *sets: ActionSet, nth: int = 2) -> Recovery:
    """The twin breaks down on the ``nth`` rollout of each of ``sets``, which is that of the release check."""
    tried: list[ActionSet] = []

    def bug(actions: ActionSet) -> None:
        tried.append(actions)

    def result(actions: ActionSet) -> RolloutResult:
        broken = actions in sets and tried.count(actions) == nth
        return RolloutResult.BROKE_DOWN if broken else RolloutResult.COMPLETED

    done.twin.bug, done.twin.result = bug, result
    return done


def test_what_the_release_check_refuses_is_followed_by_the_next_best() -> None:
    others = (proposer("second", ScriptedAction(DEARER)), proposer("third", ScriptedAction(SAVING)))
    done = refusing(doomed(GOOD, others=others), GOOD).run()
    assert by(done) == [("third", SAVING.digest)] and len(done.trace.of(ReleaseRefused)) == 1
    before, after = done.trace.of(Compared)
    assert (before.chosen, after.chosen) == (GOOD.digest, SAVING.digest)
    refused = {a.digest: a.refused for a in after.alternatives if a.proposer}
    assert refused[GOOD.digest] and refused[SAVING.digest] == refused[DEARER.digest] == ""


@pytest.mark.parametrize(("times", "released"), [(1, GOOD), (2, GOOD), (3, SAVING)])
def test_what_circumstances_alone_refuse_is_tried_again_before_anything_dearer(times: int, released: ActionSet) -> None:
    done = doomed(GOOD, others=(proposer("second", ScriptedAction(SAVING)),))
    ask, left = done.desk.ask, [times]

    async def without_a_lease(request: Request, within_s: float) -> Answer:
        answer = await ask(request, within_s)
        if request.actions != GOOD or not left[0]:
            return answer
        left[0] -= 1
        return replace(answer, status=RequestStatus.REFUSED, finding=refusal("CHK-LEASE", "the lease is over"))

    done.desk.ask = without_a_lease  # type: ignore[method-assign]
    done.run()
    assert by(done)[-1][1] == released.digest and not done.handed_over


def test_one_refusal_after_the_other_ends_with_the_fallback() -> None:
    others = (proposer("second", ScriptedAction(SAVING), attempts=1),)
    done = refusing(doomed(GOOD, others=others, bounds=AT_ONCE), GOOD, SAVING).run()
    assert by(done) == [] and len(done.trace.of(ReleaseRefused)) == 2 and len(done.handed_over) == 1
    chosen = [c.chosen for c in done.trace.of(Compared)]
    assert chosen == [GOOD.digest, SAVING.digest, ""]


def test_who_was_refused_learns_from_it_and_may_win_again() -> None:
    better = feed(0.9 * HALF, "reduced")
    others = (proposer("second", ScriptedAction(SAVING)),)
    done = refusing(doomed(GOOD, better, others=others), GOOD).run()
    assert by(done) == [("scripted", better.digest)] and asked(done) == ["scripted", "second", "scripted"]
    advice = done.action.asked[1][2]
    assert [f.criterion for f in advice.findings] == ["CHK-ROLLOUT"]
    (attempt,) = advice.attempts
    assert attempt.actions == GOOD and isinstance(attempt.verdict, Revise) and attempt.number == 1


def test_a_path_that_was_refused_at_the_release_may_be_taken_again_by_who_is_thorough() -> None:
    """What it has found is not to be found again; what was refused may be cured, and keeps its number."""
    better = feed(0.9 * HALF, "reduced")
    one = thorough(ScriptedAction(GOOD, HELD, better), "reduce", "hold", NO_OTHER, "reduce", NO_OTHER)
    done = refusing(doomed(BAD, others=(one,)), GOOD).run()
    assert by(done) == [("thorough", better.digest)]
    advice = one.planning.asked[3][1]  # type: ignore[attr-defined]
    assert [a.number for a in advice.attempts] == [2, 1] and [f.criterion for f in advice.findings] == ["CHK-ROLLOUT"]
    assert [isinstance(a.verdict, Approve) for a in advice.attempts] == [True, False]


@pytest.mark.parametrize("how", [*FAILURES, "hangs"])
def test_who_cannot_learn_from_a_refusal_loses_nothing_that_another_one_found(how: str) -> None:
    reprompting = Mute(lambda: FAILURES[how][0] if how in FAILURES else None)
    first = proposer("first", ScriptedAction(GOOD), reprompting=reprompting)
    done = doomed(NO_OTHER, others=(first, proposer("second", ScriptedAction(SAVING))), bounds=LATENCY)
    refusing(done, GOOD).run()
    assert by(done) == [("second", SAVING.digest)] and done.handed_over == []
    assert [g.proposer for g in done.trace.of(GaveUp)] == ["scripted", "first"]


# --- what the plant overtakes ------------------------------------------------------------------------------------


class Late(ReleaseCheck):
    """A release check during which the plant goes on, the first time."""

    def __init__(self, stage: Stage) -> None:
        super().__init__(stage.twin, stage.limits, TAGS, Sealer("check", KEY).seal)  # type: ignore[arg-type]
        self.states: list[str] = []

    def check(self, fresh: Sequence[Snapshot], found: Approved, diagnosis: Diagnosis) -> Checked:
        self.states.append(found.path.states[0])
        if len(self.states) == 1:
            raise Overtaken("the plant went on meanwhile")
        return super().check(fresh, found, diagnosis)


@pytest.mark.parametrize(("again", "by"), [(0.9 * HALF, "scripted"), (0.7 * HALF, "second")])
def test_what_the_plant_has_overtaken_is_found_again_and_compared_anew(again: float, by: str) -> None:
    """What was approved in the former state does not win any more, not even as the cheapest."""
    others = (
        Proposer("second", ScriptedPlanning(MACHINE, ("reduce",)), ScriptedAction(SAVING), ScriptedReprompting()),
    )
    stage = Stage(ScriptedAction(GOOD, feed(again, "reduced")), others=others, start=305.0)
    stage.check = late = Late(stage)
    run(stage)
    assert late.states == ["running", "running"] and not stage.trace.of(GaveUp)
    assert [a.number for a in stage.trace.of(Attempted)] == [1, 1, 1, 1], "everybody begins anew"
    assert [r.proposer for r in stage.trace.of(ReleasedActions)] == [by] and stage.guard.latched is None
