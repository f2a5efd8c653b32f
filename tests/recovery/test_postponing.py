"""Postponing: where nobody has an answer, the fallback acts when it must; until then the plant is looked at again.

From 305 K the line runs through its limit of 313 K in 80 s if nothing is done, and no feed cools it by 0.1 K/s.
"""

from __future__ import annotations

from typing import Any

import pytest

from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import Compared, Waited
from homeostat.domain.observation import NoAction
from homeostat.domain.plant.prices import Price
from homeostat.domain.recovery import ActionSet
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, diagnosis
from tests.recovery.desk import AT_ONCE, DEAR, DOOMED, FINE, SOFT, Recovery, Watching, ticks, watching
from tests.recovery.line import BAD, GOOD
from tests.recovery.rivals import proposer

QUICK = Bounds(intervention=InterventionBounds(answer_s=5.0))


def at_a_loss(hot: float = DOOMED, last: int = 20, bounds: Bounds = QUICK, *then: object) -> Recovery:
    """A line that must not be left alone, whose proposer has nothing at first and ``then`` something."""
    answers = (NoAdmissiblePlan("nothing"), *then)
    return Recovery(ticks(1, last, hot), action=ScriptedAction(*answers), bounds=bounds)  # type: ignore[arg-type]


def test_the_longest_wait_that_is_as_safe_stands_in_the_list_and_is_taken() -> None:
    done = at_a_loss().run()
    (wait,) = done.trace.of(Waited)
    assert (wait.proposer, wait.seconds, wait.follows) == ("search", 45.0, "drain")
    assert done.handed_over == [] and done.released == []
    (compared,) = done.trace.of(Compared)
    (one,) = [a for a in compared.alternatives if a.digest == compared.chosen]
    assert one.kind is AlternativeKind.WAIT and one.seconds == 45.0


def test_a_wait_counts_beside_the_fallback_only_where_that_violates_a_limit_as_well() -> None:
    sound = at_a_loss().run()
    (compared,) = sound.trace.of(Compared)
    kinds = {a.kind: a.certificate for a in compared.alternatives}
    wait, falls = kinds[AlternativeKind.WAIT], kinds[AlternativeKind.FALLBACK]
    assert falls is not None and falls.violations == 0 and wait is not None and not wait.beside


def test_the_fallback_stays_armed_with_its_time_to_act_by() -> None:
    done = at_a_loss().run()
    assert done.armed[-1].act_by_s is not None and not done.sent(NoAction)


@pytest.mark.parametrize("answers", [(), (BAD,) * 9], ids=["never answers", "is refused again and again"])
def test_who_uses_all_the_time_that_there_is_takes_no_wait_away(answers: tuple[ActionSet, ...]) -> None:
    """It costs time at worst: the fallback acts no sooner than if nobody else had been asked."""
    alone = at_a_loss().run().trace.of(Waited)
    slow = proposer("slow", ScriptedAction(*answers or (GOOD,), delay_s=0.3 if answers else 60.0), attempts=9)
    bounds = Bounds(Budget(latency_s=2.0), InterventionBounds(answer_s=5.0))
    nothing = ScriptedAction(NoAdmissiblePlan("nothing"))
    done = Recovery(ticks(1, 20, DOOMED), action=nothing, others=(slow,), bounds=bounds).run()
    assert done.handed_over == [] and [w.seconds for w in done.trace.of(Waited)] == [w.seconds for w in alone]


def test_whoever_finds_something_later_is_heard() -> None:
    done = at_a_loss(DOOMED, 60, QUICK, GOOD).run()
    assert done.when(Waited) == [10.0] and done.released == [55.0] and done.handed_over == []


def test_what_is_at_hand_at_once_is_not_put_off() -> None:
    done = at_a_loss(312.5).run()
    assert done.handed_over == ["nothing"] and not done.trace.of(Waited)


def test_where_nobody_may_wait_the_fallback_acts() -> None:
    assert at_a_loss(bounds=AT_ONCE).run().handed_over == ["nothing"]


PASSING = frozenset({"runaway"})
"""What is diagnosed at the line's desk is of nobody's list: it need not last."""


def with_an_answer(last: int, passing: frozenset[str] = PASSING, **more: Any) -> Recovery:
    """A line that must not be left alone, and whose proposer knows what helps: half the feed, for half the product."""
    made = {"bounds": QUICK, **more}
    return Recovery(ticks(1, last, DOOMED), action=ScriptedAction(GOOD, GOOD), passing=passing, **made)


def test_what_need_not_last_is_waited_for_before_something_dear_is_released() -> None:
    done = with_an_answer(20).run()
    (wait,) = done.trace.of(Waited)
    assert (wait.seconds, wait.follows) == (45.0, "running > reduced") and done.released == []
    assert done.armed[-1].act_by_s is not None and not done.sent(NoAction)


def test_what_is_still_there_after_as_many_waits_as_there_may_be_is_answered() -> None:
    bounds = Bounds(intervention=InterventionBounds(answer_s=5.0, waits=3))
    done = with_an_answer(150, bounds=bounds).run()
    assert done.when(Waited) == [10.0, 55.0, 100.0] and done.released == [145.0] and done.handed_over == []


def test_a_wait_that_news_have_cut_short_counts_for_as_much_as_there_was_of_it() -> None:
    """A ninth of two that may be, and a ninth, leave one and a part of one."""
    bounds = Bounds(intervention=InterventionBounds(answer_s=5.0, waits=2))
    done = with_an_answer(200, bounds=bounds, monitoring=watching(10.0, 15.0, 20.0)).run()
    assert done.when(Waited) == [10.0, 15.0, 20.0, 65.0] and done.released == [110.0]


def test_news_without_end_do_not_put_off_what_is_to_be_done_without_end() -> None:
    often = [float(at_s) for at_s in range(10, 600, 40)]
    bounds = Bounds(intervention=InterventionBounds(answer_s=5.0, waits=2))
    done = with_an_answer(600, bounds=bounds, monitoring=watching(*often)).run()
    assert done.when(Waited) == [10.0, 50.0, 90.0] and done.released[0] == 130.0


def test_what_a_wait_has_shown_says_how_long_there_is_now() -> None:
    """What is known while it goes on only comes nearer; once it is over, what the twin says then takes its place."""
    done = at_a_loss(DOOMED, 60, QUICK, GOOD).run()
    assert [(a.act_by_s, a.anew) for a in done.armed] == [(84.0, False), (129.0, True)]
    cut = with_an_answer(20, monitoring=watching(10.0, 15.0)).run()
    assert [a.anew for a in cut.armed] == [False, False]


@pytest.mark.parametrize(("passing", "rows"), [(frozenset[str](), ()), (PASSING, DEAR)])
def test_what_lasts_or_is_cheaper_than_leaving_alone_is_answered_at_once(
    passing: frozenset[str], rows: tuple[Price, ...]
) -> None:
    done = with_an_answer(20, passing, rows=rows, limits=SOFT).run()
    assert done.released == [10.0] and not done.trace.of(Waited)


@pytest.mark.parametrize(("share", "waited"), [(0.04, [10.0]), (0.1, [10.0]), (0.11, []), (0.6, [])])
def test_what_is_unlikely_to_do_harm_is_waited_for_before_something_dear_is_released(
    share: float, waited: list[float]
) -> None:
    """Nothing heats the line, but for a second member of this weight."""
    recovery = with_an_answer(20, frozenset())
    recovery.twin.weights, recovery.twin.off = (1.0 - share, share), (-1.0, 0.01)
    done = recovery.run()
    assert done.when(Waited) == waited and done.released == ([] if waited else [10.0])


def test_what_has_ended_before_need_not_last_where_it_comes_again() -> None:
    def answer(at_s: float) -> Diagnosis:
        over = Diagnosis(at_s, (), (), ended=diagnosis(5.0).hypotheses[0].faults, ended_s=at_s)
        return over if at_s < 10.0 else diagnosis(at_s)

    seen = (*ticks(1, 9, FINE), *ticks(10, 20, DOOMED))
    done = Recovery(seen, Watching(6.0, 10.0, answer=answer), ScriptedAction(GOOD), bounds=QUICK).run()
    assert done.when(Waited) == [10.0] and done.released == []


def test_a_fallback_that_may_not_be_needed_is_put_off_until_just_before_the_guard_falls_back() -> None:
    """At 312 K 10 s are left. Where what is wrong lasts, they are kept for thinking."""
    for passing, seconds in ((frozenset[str](), []), (PASSING, [5.0])):
        answers = ScriptedAction(NoAdmissiblePlan("nothing"))
        bounds = Bounds(intervention=InterventionBounds(answer_s=30.0))
        done = Recovery(ticks(1, 12, 310.9), action=answers, bounds=bounds, passing=passing).run()
        assert [w.seconds for w in done.trace.of(Waited)] == seconds
