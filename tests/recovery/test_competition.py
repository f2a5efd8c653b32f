"""Proposers compete: who is asked, how long, and that the cheapest of what was approved is released, come what may.

Over 100 s the line makes 3 EUR at full feed. At half feed it loses 1.5 EUR, 0.03 EUR for the state and 0.27 EUR for the
release: GOOD costs 1.80 EUR, and to hold 3.00 + 0.06 + 0.27 = 3.33 EUR.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest

from homeostat.agents.roles import NoAdmissiblePlan, Proposer, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Attempted, Compared, GaveUp, NoActionTaken, ReleasedActions, ReleaseRefused
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import Price, PriceKind
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Revise, RolloutResult
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, ScriptedPlanning, ScriptedReprompting
from tests.recovery.desk import DOOMED, FINE, FREE, Recovery, ticks
from tests.recovery.line import BAD, COOLING, GOOD, HALF, OFF, feed
from tests.safety.world import CALM, HOT, criterion

HELD = feed(OFF, "still")
GOOD_EUR, HELD_EUR = 1.80, 3.33
SAVING = feed(0.8 * HALF, "reduced")
"""Costs 2.10 EUR: less than to hold, more than GOOD."""
SAVING_EUR = 2.10
DEARER = feed(0.7 * HALF, "reduced")


def proposer(
    name: str, action: ScriptedAction, *paths: str | BaseException, thorough: bool = False, **more: Any
) -> Proposer:
    """One that knows ``paths`` as names of transitions, the last one for ever; by default the way to reduced."""
    ways = [(p,) if isinstance(p, str) else p for p in paths or ("reduce",)]
    reprompting = more.pop("reprompting", ScriptedReprompting())
    made = {"attempts": 4, "improves": True, **more}
    return Proposer(name, ScriptedPlanning(COOLING, *ways), action, reprompting, thorough=thorough, **made)


NO_OTHER = NoAdmissiblePlan("no other path")


def thorough(action: ScriptedAction, *paths: str | BaseException, **more: Any) -> Proposer:
    return proposer("thorough", action, *(paths or ("reduce", NO_OTHER)), thorough=True, **more)


def doomed(*answers: ActionSet | BaseException, others: tuple[Proposer, ...] = (), **more: Any) -> Recovery:
    """A line that runs through its limit if nothing is done; a first proposer with ``answers``, and others after it."""
    made = {"attempts": len(answers), **more}
    return Recovery(ticks(1, 20, DOOMED), action=ScriptedAction(*answers), others=others, **made)


def safe(*answers: ActionSet | BaseException, others: tuple[Proposer, ...] = (), **more: Any) -> Recovery:
    """A line that may stay at half feed for 1.53 EUR."""
    made = {"attempts": len(answers), "improves": True, **more}
    seen = ticks(1, 20, FINE, "reduced", feed=HALF)
    return Recovery(seen, action=ScriptedAction(*answers), others=others, **made)


def by(done: Recovery) -> list[tuple[str, str]]:
    """Who had something released, and its digest."""
    return [(r.proposer, r.digest) for r in done.trace.of(ReleasedActions)]


def asked(done: Recovery) -> list[str]:
    """Who proposed, in order."""
    return [a.proposer for a in done.trace.of(Attempted)]


# --- the list ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("first", "second"), [(SAVING, GOOD), (GOOD, SAVING)])
def test_the_cheapest_is_released_whoever_found_it(first: ActionSet, second: ActionSet) -> None:
    done = doomed(first, others=(proposer("second", ScriptedAction(second)),)).run()
    winner = "scripted" if first == GOOD else "second"
    assert by(done) == [(winner, GOOD.digest)] and asked(done) == ["scripted", "second"]
    assert done.released == [10.0] and not done.trace.of(GaveUp)


def test_all_that_could_be_done_is_recorded_with_its_cost_and_why_not() -> None:
    done = doomed(SAVING, others=(proposer("second", ScriptedAction(GOOD)),)).run()
    (compared,) = done.trace.of(Compared)
    assert compared.currency == "EUR" and compared.chosen == GOOD.digest
    leave, good, saving, fall = compared.alternatives
    assert leave.kind is AlternativeKind.LEAVE and leave.cost.total == pytest.approx(0.0) and "T <= 31" in leave.refused
    assert [a.kind for a in (good, saving)] == [AlternativeKind.RELEASE] * 2
    assert (good.proposer, saving.proposer, good.refused) == ("second", "scripted", "")
    assert [a.cost.total for a in (good, saving)] == pytest.approx([GOOD_EUR, SAVING_EUR])
    assert (fall.kind, fall.name) == (AlternativeKind.FALLBACK, "drain")
    assert fall.refused == "it acts where nothing else may be done" and fall.cost.total == pytest.approx(HELD_EUR)
    order = [k for k in done.kinds if k in ("attempted", "compared", "released")]
    assert order == ["attempted", "attempted", "compared", "released"]


def test_what_an_attempt_costs_is_said() -> None:
    done = doomed(BAD, GOOD).run()
    refused, approved = done.trace.of(Attempted)
    assert not refused.approved and refused.cost is not None, "what it would have cost is known"
    assert approved.cost is not None and approved.cost.total == pytest.approx(GOOD_EUR)


def test_where_nothing_may_be_done_the_list_says_so_before_the_fallback() -> None:
    done = Recovery(ticks(1, 20, 313.5), action=ScriptedAction(GOOD)).run()
    (compared,) = done.trace.of(Compared)
    assert compared.chosen == "" and not any(a.admitted for a in compared.alternatives)
    assert {a.kind: a.refused for a in compared.alternatives}[AlternativeKind.FALLBACK] == "it does not help"
    assert done.released == [] and len(done.handed_over) == 1


def test_a_plant_that_may_be_left_alone_is_left_alone_where_that_costs_less() -> None:
    done = safe(SAVING, others=(proposer("second", ScriptedAction(DEARER), "adjust"),)).run()
    assert done.released == [] and done.when(NoActionTaken) == [10.0] and done.handed_over == []
    assert asked(done) == ["scripted", "second"]
    (compared,) = done.trace.of(Compared)
    assert compared.chosen == "" and compared.alternatives[0].kind is AlternativeKind.LEAVE
    assert compared.alternatives[0].admitted and compared.alternatives[0].cost.total == pytest.approx(1.53)


def test_a_step_that_is_asked_for_is_released_although_leaving_costs_less() -> None:
    bounds = Bounds(every_step=True)
    done = Recovery(ticks(1, 6, FINE), action=ScriptedAction(GOOD), bounds=bounds).run()
    assert done.released == [5.0]
    leave = done.trace.of(Compared)[0].alternatives[0]
    assert leave.kind is AlternativeKind.LEAVE and leave.refused == "a step is asked for"


# --- who is asked ------------------------------------------------------------------------------------------------

NEARLY = Limits((HOT,), (CALM, criterion("ACC-LESS", "always (F.sp <= 0.0298)", hard=True)))
CHEAP = (*FREE, Price(PriceKind.RELEASE, "release", 0.0))


@pytest.mark.parametrize(("rate", "needed"), [(0.0297, False), (0.0293, True)])
def test_the_next_one_is_asked_only_where_there_is_something_to_win(rate: float, needed: bool) -> None:
    """One percent of production is not worth waiting for; 2.3 % are."""
    unneeded = ScriptedAction(feed(0.0296, "reduced"))
    done = Recovery(
        ticks(1, 20, FINE), action=ScriptedAction(feed(rate, "reduced")), limits=NEARLY, rows=CHEAP,
        others=(proposer("second", unneeded),),
    ).run()  # fmt: skip
    assert [name for name, _ in by(done)] == ["second" if needed else "scripted"]
    assert len(unneeded.asked) == needed


def test_an_improvement_gets_so_many_proposals_and_no_more() -> None:
    bounds = Bounds(intervention=InterventionBounds(improvements=2))
    answers = [feed(rate, "reduced") for rate in (0.029, 0.028, 0.027)]  # all run through the limit from 308 K
    done = Recovery(
        ticks(1, 20, 308.0, "reduced", feed=HALF), action=ScriptedAction(*answers), attempts=3, improves=True,
        bounds=bounds,
    ).run()  # fmt: skip
    assert [a.approved for a in done.trace.of(Attempted)] == [False, False] and done.when(NoActionTaken) == [10.0]


# --- a thorough proposer -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("is_thorough", "chosen"), [(True, GOOD), (False, HELD)])
def test_a_thorough_proposer_goes_on_to_other_paths_and_another_one_stops(
    is_thorough: bool, chosen: ActionSet
) -> None:
    one = proposer("one", ScriptedAction(HELD, GOOD), "hold", "reduce", NO_OTHER, thorough=is_thorough)
    done = doomed(NoAdmissiblePlan("first: nothing"), others=(one,)).run()
    assert by(done) == [("one", chosen.digest)]
    assert [a.number for a in done.trace.of(Attempted)] == ([1, 2] if is_thorough else [1])
    assert [g.proposer for g in done.trace.of(GaveUp)] == ["scripted"], "who found something has not given up"


def test_a_thorough_proposer_is_told_what_it_has_found() -> None:
    one = thorough(ScriptedAction(GOOD, HELD), "reduce", "hold", NO_OTHER)
    done = doomed(NoAdmissiblePlan("first: nothing"), others=(one,)).run()
    _, then, last = (advice for _, advice in one.planning.asked)  # type: ignore[attr-defined]
    assert then.refused_paths == (("reduced",),) and last.refused_paths == (("reduced",), ("still",))
    (found,) = then.attempts
    assert isinstance(found.verdict, Approve) and found.cost.total == pytest.approx(GOOD_EUR)
    assert by(done) == [("thorough", GOOD.digest)], "the first one is the cheapest"


def test_a_thorough_proposer_has_no_more_attempts_than_another_one() -> None:
    one = thorough(ScriptedAction(HELD, GOOD), "hold", "reduce", attempts=1)
    done = doomed(NoAdmissiblePlan("first: nothing"), others=(one,)).run()
    assert by(done) == [("thorough", HELD.digest)]


# --- time --------------------------------------------------------------------------------------------------------


class SlowLater(ScriptedAction):
    """The first answer comes at once, the next ones after a while."""

    def __init__(self, delay_s: float, *answers: ActionSet) -> None:
        super().__init__(*answers)
        self._later_s = delay_s

    async def act(self, situation: Situation, path: Any, advice: Advice) -> ActionSet | Revise:
        if self.asked:
            await asyncio.sleep(self._later_s)
        return await super().act(situation, path, advice)


LATENCY = Bounds(Budget(latency_s=2.0))


def test_half_of_the_time_is_kept_where_the_plant_may_not_be_left_alone() -> None:
    slow = proposer("slow", ScriptedAction(GOOD, delay_s=1.4))
    begin = time.monotonic()
    done = doomed(SAVING, others=(slow,), bounds=LATENCY).run()
    assert time.monotonic() - begin < 1.4, "it was not waited for"
    assert by(done) == [("scripted", SAVING.digest)]
    (late,) = done.trace.of(GaveUp)
    assert late.proposer == "slow" and "in the time that was left" in late.reason


def test_all_of_the_time_is_used_where_the_plant_may_be_left_alone() -> None:
    more, most = feed(0.7 * 0.03, "reduced"), feed(0.8 * 0.03, "reduced")
    slow = proposer("slow", ScriptedAction(most, delay_s=1.4), "adjust")
    done = safe(more, others=(slow,), bounds=LATENCY).run()
    assert by(done) == [("slow", most.digest)]


def test_all_of_the_time_is_used_where_nothing_was_found() -> None:
    slow = proposer("slow", ScriptedAction(GOOD, delay_s=1.4))
    assert by(doomed(BAD, others=(slow,), bounds=LATENCY).run()) == [("slow", GOOD.digest)]


def test_a_thorough_proposer_keeps_half_of_the_time_as_well_once_it_found_something() -> None:
    one = thorough(SlowLater(1.4, HELD, GOOD), "hold", "reduce", NO_OTHER)
    begin = time.monotonic()
    done = doomed(BAD, others=(one,), bounds=LATENCY).run()
    assert time.monotonic() - begin < 1.4 and by(done) == [("thorough", HELD.digest)]
    assert [g.proposer for g in done.trace.of(GaveUp)] == ["scripted"]


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


def test_one_refusal_after_the_other_ends_with_the_fallback() -> None:
    others = (proposer("second", ScriptedAction(SAVING), attempts=1),)
    done = refusing(doomed(GOOD, others=others), GOOD, SAVING).run()
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
