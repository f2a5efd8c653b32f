"""Proposers compete: who is asked, how long, and that the cheapest of what was approved is released."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from homeostat.agents.roles import NoAdmissiblePlan, Situation, Wait
from homeostat.domain.advice import Advice
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Attempted, Compared, GaveUp, NoActionTaken, NotAsked
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import Price, PriceKind
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Revise
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction
from tests.recovery.desk import FINE, FREE, Recovery, ticks
from tests.recovery.line import BAD, GOOD, HALF, feed
from tests.recovery.rivals import (
    DEARER,
    GOOD_EUR,
    HELD,
    HELD_EUR,
    LATENCY,
    MORE_THAN_HALF_S,
    NO_OTHER,
    SAVING,
    SAVING_EUR,
    Polish,
    asked,
    by,
    doomed,
    proposer,
    safe,
    thorough,
)
from tests.safety.world import CALM, HOT, criterion

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
    assert leave.kind is AlternativeKind.LEAVE and leave.refused == "a step is asked for, or the way back"


# --- who is asked ------------------------------------------------------------------------------------------------

NEARLY = Limits((HOT,), (CALM, criterion("ACC-LESS", "always (F.sp <= 0.0298)", hard=True)))
CHEAP = (*FREE, Price(PriceKind.RELEASE, "release", 0.0))


def test_the_next_one_is_asked_where_it_may_win_anything() -> None:
    """Waiting costs nothing where leaving the line alone is as cheap: one percent of production is worth it."""
    other = ScriptedAction(feed(0.0296, "reduced"))
    done = Recovery(
        ticks(1, 20, FINE), action=ScriptedAction(feed(0.0293, "reduced")), limits=NEARLY, rows=CHEAP,
        others=(proposer("second", other),),
    ).run()  # fmt: skip
    assert [name for name, _ in by(done)] == ["second"] and not done.trace.of(NotAsked)


def test_nobody_else_is_asked_where_nothing_can_cost_less() -> None:
    """The first costs a release and nothing else, and leaving the line alone is forbidden."""
    unneeded = ScriptedAction(GOOD)
    more = Limits((HOT,), (CALM, criterion("ACC-MORE", "always (F.sp >= 0.0301)", hard=True)))
    done = Recovery(
        ticks(1, 20, FINE), action=ScriptedAction(feed(0.031, "reduced")), limits=more, rows=FREE,
        others=(proposer("second", unneeded),),
    ).run()  # fmt: skip
    (ended,) = done.trace.of(NotAsked)
    assert not unneeded.asked and [name for name, _ in by(done)] == ["scripted"]
    assert ended.gain == 0.0 and ended.reason.endswith("nothing can cost less than what is approved")


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
def test_a_thorough_proposer_goes_on_to_other_paths_and_another_one_stops(is_thorough: bool, chosen: ActionSet) -> None:
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


# --- whose proposal is dearer ------------------------------------------------------------------------------------


def test_who_is_approved_but_dearer_goes_on_and_may_win() -> None:
    second = proposer("second", ScriptedAction(HELD, GOOD), "hold", "reduce")
    done = doomed(SAVING, others=(second,)).run()
    assert by(done) == [("second", GOOD.digest)] and not done.trace.of(GaveUp)
    assert [(a.proposer, a.number) for a in done.trace.of(Attempted)] == [("scripted", 1), ("second", 1), ("second", 2)]


def test_it_is_told_what_its_own_costs_and_what_the_best_so_far_costs() -> None:
    second = proposer("second", ScriptedAction(HELD, GOOD), "hold", "reduce")
    done = doomed(SAVING, others=(second,))
    done.run()
    (first, _), (then, advice) = second.planning.asked  # type: ignore[attr-defined]
    for situation in (first, then):
        assert situation.best is not None and situation.best.told == "release running > reduced by scripted"
        assert situation.best.cost.total == pytest.approx(SAVING_EUR)
    (own,) = advice.attempts
    assert isinstance(own.verdict, Approve) and own.cost.total == pytest.approx(HELD_EUR)
    assert advice.refused_paths == (), "the path is no worse for it, and may be held for a while"
    (scripted, *_) = done.action.asked
    assert scripted[0].best is None


END: list[tuple[Any, ...]] = [
    ("reduce", NO_OTHER), ("reduce",), ("reduce", Wait(2.0), NO_OTHER), ("reduce", ZeroDivisionError("a bug")),
]  # fmt: skip


@pytest.mark.parametrize("paths", END, ids=["names none", "says the same", "a wait is refused", "breaks"])
def test_who_has_nothing_better_than_what_is_approved_of_its_own_has_not_given_up(paths: tuple[Any, ...]) -> None:
    bounds = Bounds(intervention=InterventionBounds(waits=0))
    done = doomed(GOOD, others=(proposer("second", ScriptedAction(SAVING), *paths),), bounds=bounds).run()
    assert by(done) == [("scripted", GOOD.digest)]
    assert [g.reason for g in done.trace.of(GaveUp)] == [
        f"second failed: {path!r}" for path in paths if isinstance(path, ZeroDivisionError)
    ], "a bug is told all the same"


def test_who_is_dearer_has_no_more_attempts_than_it_was_given() -> None:
    answers = [feed(rate * HALF, "reduced") for rate in (0.7, 0.8, 0.9)]
    second = proposer("second", ScriptedAction(*answers), attempts=2)
    done = doomed(GOOD, others=(second,)).run()
    assert asked(done) == ["scripted", "second", "second"] and not done.trace.of(GaveUp)


def test_who_is_dearer_gets_no_time_that_is_kept() -> None:
    second = proposer("second", SlowLater(MORE_THAN_HALF_S, HELD, GOOD), "hold", "reduce")
    done = doomed(SAVING, others=(second,), bounds=LATENCY).run()
    assert by(done) == [("scripted", SAVING.digest)] and not done.trace.of(GaveUp), "half of the time is kept"
    assert asked(done) == ["scripted", "second"]


def test_who_costs_no_more_than_the_cheapest_stops_once_its_numbers_are_bettered() -> None:
    second = proposer("second", ScriptedAction(DEARER, HELD), "reduce", "hold")
    done = doomed(SAVING, others=(second,), polishing=Polish(GOOD)).run()
    assert by(done) == [("scripted", GOOD.digest)], "of equals the first"
    assert len(second.action.asked) == 1  # type: ignore[attr-defined]


def test_a_path_whose_numbers_the_search_has_bettered_is_not_asked_about_again() -> None:
    """It may still be held for a while; for good there is nothing to win on it."""
    second = proposer("second", ScriptedAction(DEARER, GOOD), attempts=4)
    done = doomed(GOOD, others=(second,), polishing=Polish(DEARER)).run()
    assert asked(done).count("second") == 1 and len(second.action.asked) == 1  # type: ignore[attr-defined]
    assert not done.trace.of(GaveUp)


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


def test_half_of_the_time_is_kept_where_the_plant_may_not_be_left_alone() -> None:
    slow = proposer("slow", ScriptedAction(GOOD, delay_s=MORE_THAN_HALF_S))
    done = doomed(SAVING, others=(slow,), bounds=LATENCY).run()
    assert by(done) == [("scripted", SAVING.digest)], "the cheaper one was not waited for"
    (late,) = done.trace.of(GaveUp)
    assert late.proposer == "slow" and "in the time that was left" in late.reason


def test_all_of_the_time_is_used_where_the_plant_may_be_left_alone() -> None:
    more, most = feed(0.7 * 0.03, "reduced"), feed(0.8 * 0.03, "reduced")
    slow = proposer("slow", ScriptedAction(most, delay_s=MORE_THAN_HALF_S), "adjust")
    done = safe(more, others=(slow,), bounds=LATENCY).run()
    assert by(done) == [("slow", most.digest)]


def test_all_of_the_time_is_used_where_nothing_was_found() -> None:
    slow = proposer("slow", ScriptedAction(GOOD, delay_s=MORE_THAN_HALF_S))
    assert by(doomed(BAD, others=(slow,), bounds=LATENCY).run()) == [("slow", GOOD.digest)]


def test_a_thorough_proposer_keeps_half_of_the_time_as_well_once_it_found_something() -> None:
    one = thorough(SlowLater(MORE_THAN_HALF_S, HELD, GOOD), "hold", "reduce", NO_OTHER)
    done = doomed(BAD, others=(one,), bounds=LATENCY).run()
    assert by(done) == [("thorough", HELD.digest)], "the cheaper one was not waited for"
    assert [g.proposer for g in done.trace.of(GaveUp)] == ["scripted"]
