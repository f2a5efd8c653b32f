"""Postponing: where nobody has an answer, the fallback acts when it must; until then the plant is looked at again.

From 305 K the line runs through its limit of 313 K in 80 s if nothing is done, and no feed cools it by 0.1 K/s.
"""

from __future__ import annotations

from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Compared, Waited
from homeostat.domain.observation import NoAction
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction
from tests.recovery.desk import AT_ONCE, DOOMED, Recovery, ticks
from tests.recovery.line import GOOD

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


def test_the_fallback_stays_armed_with_its_time_to_act_by() -> None:
    done = at_a_loss().run()
    assert done.armed[-1].act_by_s is not None and not done.sent(NoAction)


def test_whoever_finds_something_later_is_heard() -> None:
    done = at_a_loss(DOOMED, 60, QUICK, GOOD).run()
    assert done.when(Waited) == [10.0] and done.released == [55.0] and done.handed_over == []


def test_what_is_at_hand_at_once_is_not_put_off() -> None:
    done = at_a_loss(312.5).run()
    assert done.handed_over == ["nothing"] and not done.trace.of(Waited)


def test_where_nobody_may_wait_the_fallback_acts() -> None:
    assert at_a_loss(bounds=AT_ONCE).run().handed_over == ["nothing"]
