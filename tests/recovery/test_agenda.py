"""What was done before decides what is due: once recovered, once the batch is over, step by step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from homeostat.agents.roles import NoAdmissiblePlan
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.deviations import Deviated
from homeostat.domain.events.recovery import Attempted, NoActionTaken
from homeostat.domain.observation import Observation
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import Price
from homeostat.domain.verdict import NoActionNeeded, StepBand
from homeostat.recovery.bounds import Budget, InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import SYMPTOM, ScriptedAction, diagnosis
from tests.recovery.desk import (
    AT_ONCE,
    CALM_20,
    DEAR,
    DOOMED,
    FINE,
    FREE,
    MILD,
    MORE,
    NEXT,
    SOFT,
    Recovery,
    Watching,
    at_first,
    late,
    nothing,
    ticks,
    watching,
)
from tests.recovery.line import FULL, GOOD, HALF, OFF, feed
from tests.safety.world import criterion

# --- once recovered ----------------------------------------------------------------------------------------------


def recovered(hot: float, action: ScriptedAction, limits: Limits = MILD, **more: Any) -> Recovery:
    """A line that was recovered at 10 s, runs at half feed and holds ``hot`` [K]; noticed again at 30 s."""
    first, later = ticks(1, 10, DOOMED), ticks(11, 40, hot, "reduced", feed=HALF)
    return Recovery((*first, *later), watching(10.0, 30.0), action, limits=limits, **more).run()


def test_a_recovered_plant_that_misses_what_does_not_protect_it_is_left_alone_where_nothing_helps() -> None:
    left = recovered(306.4, ScriptedAction(GOOD, NoAdmissiblePlan("nothing better")), improves=True)
    assert left.when(NoActionTaken) == [30.0] and left.handed_over == [] and len(left.action.asked) == 2
    assert left.trace.of(NoActionTaken)[0].min_margin == pytest.approx(-0.4, abs=0.11)


def test_a_recovered_plant_is_left_alone_where_what_helps_costs_more() -> None:
    """The first second with less feed would bring it back, at a greater loss."""
    left = recovered(306.01, ScriptedAction(GOOD, feed(0.011, "reduced")), improves=True)
    assert [a.approved for a in left.trace.of(Attempted)] == [True, True]
    assert left.released == [10.0] and left.when(NoActionTaken) == [30.0] and left.handed_over == []


def test_a_plant_that_was_never_recovered_is_not_left_alone_where_anything_forbids_it() -> None:
    nobody = ScriptedAction(NoAdmissiblePlan("nothing"))
    done = Recovery(ticks(1, 20, FINE), action=nobody, limits=MILD, bounds=AT_ONCE).run()
    assert done.handed_over == ["nothing"] and done.when(NoActionTaken) == []


@pytest.mark.parametrize("hot", [306.4, 309.0])
def test_a_wish_that_is_missed_forbids_nothing_and_the_release_settles_first(hot: float) -> None:
    done = recovered(hot, ScriptedAction(GOOD, feed(OFF, "reduced")), limits=SOFT, rows=DEAR, improves=True)
    assert done.released == [10.0] and done.when(NoActionTaken) == [30.0] and len(done.action.asked) == 1
    assert done.trace.of(NoActionTaken)[0].min_margin >= 0.0, "nothing that forbids is missed"


@pytest.mark.parametrize(("rows", "released"), [((), []), (DEAR, [10.0])])
def test_a_wish_is_worth_its_price(rows: tuple[Price, ...], released: list[float]) -> None:
    """At full feed the line gets 4 K too warm within the horizon: for 4 % of what it makes, or four times that."""
    done = Recovery(ticks(1, 20, FINE), action=ScriptedAction(GOOD), limits=SOFT, rows=rows, improves=True).run()
    assert done.released == released and done.handed_over == []
    assert len(done.action.asked) == len(released), "what costs less than a release is not thought about"


def test_a_wish_that_nobody_can_keep_hands_nothing_over() -> None:
    quits = ScriptedAction(NoAdmissiblePlan("nothing"))
    done = Recovery(ticks(1, 20, FINE), action=quits, limits=SOFT, rows=DEAR, improves=True).run()
    assert len(quits.asked) == 1 and done.handed_over == [] and done.when(NoActionTaken) == [10.0]


def test_that_nothing_was_found_in_time_is_no_claim_that_nothing_is_needed() -> None:
    hangs, bounds = ScriptedAction(GOOD, delay_s=5.0), Bounds(Budget(latency_s=0.2))
    told = {"action": hangs, "limits": SOFT, "rows": DEAR, "improves": True, "bounds": bounds}
    done = Recovery(ticks(1, 20, FINE), **told).run()  # type: ignore[arg-type]
    (left,), (outcome,) = done.trace.of(NoActionTaken), done.monitoring.outcomes
    assert isinstance(outcome, NoActionNeeded) and outcome.late and left.late
    assert done.released == [] and done.handed_over == []


def test_a_recovered_plant_that_runs_into_a_limit_is_handed_over() -> None:
    done = recovered(312.95, ScriptedAction(GOOD, NoAdmissiblePlan("nothing")))
    assert done.handed_over == ["nothing"] and done.when(NoActionTaken) == []


# --- improvement -------------------------------------------------------------------------------------------------


def reviewed(at_s: float, improves: bool = True) -> Recovery:
    """A line that was recovered at 10 s, stands well at half feed, and is noticed again at ``at_s``."""
    seen = (*ticks(1, 10, DOOMED), *ticks(11, 60, FINE, "reduced", feed=HALF))
    action = ScriptedAction(GOOD, MORE)
    return Recovery(seen, watching(10.0, at_s), action, bounds=CALM_20, improves=improves).run()


@pytest.mark.parametrize(("at_s", "improved"), [(29.0, False), (30.0, True), (31.0, True)])
def test_a_plant_that_stands_well_is_improved_once_the_release_has_settled(at_s: float, improved: bool) -> None:
    done = reviewed(at_s)
    assert done.released == ([10.0, at_s] if improved else [10.0])
    assert done.when(NoActionTaken) == ([] if improved else [at_s])


def test_a_plant_that_stands_well_is_improved_by_those_whose_business_that_is() -> None:
    done = reviewed(40.0, improves=False)
    assert done.released == [10.0] and done.when(NoActionTaken) == [40.0] and len(done.action.asked) == 1


def test_a_release_begins_the_calm_time_anew() -> None:
    seen = (*ticks(1, 10, DOOMED), *ticks(11, 60, FINE, "reduced", feed=HALF))
    done = Recovery(seen, watching(10.0, 35.0, 50.0, 55.0), ScriptedAction(GOOD, MORE, feed(0.018, "reduced")),
                    bounds=CALM_20, improves=True)  # fmt: skip
    done.run()
    assert done.released == [10.0, 35.0, 55.0] and done.when(NoActionTaken) == [50.0]


@pytest.mark.parametrize("faulty", [True, False])
def test_a_plant_that_was_never_touched_is_improved_where_a_fault_explains_what_it_costs(faulty: bool) -> None:
    seen = ticks(1, 60, FINE, "reduced", feed=HALF)
    watcher = watching(40.0, answer=diagnosis if faulty else lambda at_s: Diagnosis(at_s, (SYMPTOM,), ()))
    done = Recovery(seen, watcher, ScriptedAction(MORE), improves=True).run()
    assert done.released == ([40.0] if faulty else []) and done.when(NoActionTaken) == ([] if faulty else [40.0])


def test_a_plant_that_costs_no_more_than_a_release_is_not_touched() -> None:
    """It makes 8 % less than by design; a release costs 9 % of what it makes in the time that is looked at."""
    for rate, released in ((0.92 * FULL, []), (0.9 * FULL, [40.0])):
        seen = ticks(1, 60, FINE, feed=rate)
        done = Recovery(seen, watching(40.0), ScriptedAction(feed(FULL, "reduced")), rows=FREE, improves=True).run()
        assert done.released == released and len(done.action.asked) == len(released)


def test_a_release_because_of_a_deviation_is_a_recovery() -> None:
    """After it a limit that does not protect the plant is put up with where nobody can keep it."""
    quits = ScriptedAction(GOOD, NoAdmissiblePlan("nothing"))
    watcher = watching(20.0, answer=at_first(nothing, then=diagnosis))
    done = late(DOOMED, last=16, action=quits, limits=MILD, monitoring=watcher)
    done.run(*ticks(17, 24, 306.4, "reduced", feed=HALF))
    assert done.released == [16.0] and done.when(NoActionTaken) == [20.0] and done.handed_over == []


def test_a_batch_that_deviates_without_a_fault_is_not_improved() -> None:
    """All is well, the release at 10 s has settled, and more could be made: no fault, no reason to touch it."""
    seen = (*ticks(1, 10, DOOMED), *ticks(11, 60, FINE, feed=HALF, then=NEXT))
    watcher = watching(10.0, answer=at_first(diagnosis, then=nothing))
    bounds = Bounds(intervention=InterventionBounds(calm_s=20.0, slack_s=5.0, repeat_s=100.0))
    done = Recovery(
        seen, watcher, ScriptedAction(GOOD, MORE), bounds=bounds, improves=True, band=StepBand(30.0, 40.0)
    ).run()
    assert done.released == [10.0] and done.when(Deviated) == done.when(NoActionTaken) == [46.0]


# --- a batch that is over ----------------------------------------------------------------------------------------


def over(hot: float, *noticed_s: float, shows: Callable[[float], tuple[str, ...]]) -> Recovery:
    """A line that stands still for good at ``hot`` [K] and has heat of its own."""
    seen = ticks(1, 60, hot, "still", feed=HALF)
    return Recovery(
        seen, Watching(*noticed_s, shows=shows), limits=SOFT, action=ScriptedAction(RuntimeError("never asked"))
    ).run()


def test_a_batch_that_is_over_and_safe_is_reviewed_once_for_the_same_symptoms() -> None:
    done = over(308.0, 10.0, 20.0, 30.0, 40.0, shows=lambda at_s: ("A", "B") if at_s < 35.0 else ("B",))
    assert done.when(NoActionTaken) == [10.0] and done.desk.thoughts == 1
    assert done.trace.of(NoActionTaken)[0].min_margin == pytest.approx(0.001 - HALF), "it is fed, and should not be"


def test_a_batch_that_is_over_is_reviewed_again_for_a_new_symptom() -> None:
    done = over(308.0, 10.0, 20.0, 30.0, shows=lambda at_s: ("A",) if at_s < 15.0 else ("A", "B"))
    assert done.when(NoActionTaken) == [10.0, 20.0]


def test_a_batch_that_is_over_and_will_violate_a_limit_is_handed_over_without_asking_anybody() -> None:
    done = over(312.95, 10.0, shows=lambda at_s: ("A",))
    assert done.handed_over == ["the batch is over, and what follows violates a limit"] and done.action.asked == []


@pytest.mark.parametrize("hot", [FINE, 320.0])
def test_a_batch_that_is_over_stands_in_a_plant_without_hard_limits_as_well(hot: float) -> None:
    """Nothing protects it, and nothing need; what is wished for costs, and nobody can propose anything."""
    only = Limits((), (criterion("ACC-SOFT", "always (T <= 315)"),))
    done = Recovery(ticks(1, 60, hot, "still", feed=OFF), watching(40.0), limits=only, rows=DEAR, improves=True).run()
    assert done.when(NoActionTaken) == [40.0] and done.handed_over == [] and done.action.asked == []


def test_a_batch_that_is_not_over_is_reviewed_as_often_as_it_is_noticed() -> None:
    done = Recovery(ticks(1, 40, FINE), watching(10.0, 20.0)).run()
    assert done.when(NoActionTaken) == [10.0, 20.0]


# --- every step --------------------------------------------------------------------------------------------------

EVERY = Bounds(intervention=InterventionBounds(repeat_s=20.0, waits=0), every_step=True)


def stepwise(*observations: Observation, **changed: Any) -> Recovery:
    """A line about whose every state proposers are asked, and nothing is wrong."""
    return Recovery(observations, **{"monitoring": watching(answer=nothing), "bounds": EVERY, **changed})


def test_every_state_is_asked_about_once_the_twin_can_see() -> None:
    done = stepwise(*ticks(1, 8, then=NEXT), *ticks(9, 15, state="reduced", feed=HALF)).run()
    assert [s.snapshot.at_s for s, _, _ in done.action.asked] == [5.0, 9.0] and done.released == [5.0, 9.0]
    assert done.kinds.count("noticed") == 2 and done.kinds.count("diagnosed") == 0
    assert done.monitoring.outcomes == [], "a step as usual is nothing to follow"


def test_nothing_is_asked_where_not_every_step_is_asked_for() -> None:
    assert Recovery(ticks(1, 30), watching(answer=nothing)).run().action.asked == []


def test_a_state_in_which_nothing_waits_is_asked_about_again_after_a_while() -> None:
    done = stepwise(*ticks(1, 50), action=ScriptedAction(NoAdmissiblePlan("nothing now"))).run()
    assert [s.snapshot.at_s for s, _, _ in done.action.asked] == [5.0, 25.0, 45.0]
    assert done.when(NoActionTaken) == [5.0, 25.0, 45.0]


def test_a_state_in_which_the_next_step_waits_is_asked_about_once() -> None:
    assert len(stepwise(*ticks(1, 50, then=NEXT)).run().action.asked) == 1


def test_a_complete_batch_is_not_asked_about() -> None:
    done = stepwise(*ticks(1, 30, state="still", feed=HALF)).run()
    assert done.action.asked == [] and done.desk.thoughts == 0


@pytest.mark.parametrize(("noticed_s", "asked_s"), [(3.0, [3.0, 5.0]), (5.0, [5.0]), (8.0, [5.0, 8.0])])
def test_a_fault_and_a_step_at_the_same_time_are_one_question(noticed_s: float, asked_s: list[float]) -> None:
    done = stepwise(*ticks(1, 22, DOOMED, then=NEXT), monitoring=watching(noticed_s)).run()
    assert [s.snapshot.at_s for s, _, _ in done.action.asked] == asked_s


def test_a_step_as_usual_is_no_recovery() -> None:
    """After one, a limit that is missed is not put up with, and calm time does not run."""
    quits = ScriptedAction(GOOD, NoAdmissiblePlan("nothing"))
    seen = (*ticks(1, 8), *ticks(9, 30, 306.5, "reduced", feed=HALF))
    done = stepwise(*seen, action=quits, limits=MILD, heating=0.05).run()
    assert done.released == [5.0] and done.handed_over[:1] == ["nothing"]


def test_a_release_for_a_fault_is_a_recovery_where_every_step_is_asked_for_too() -> None:
    quits = ScriptedAction(GOOD, NoAdmissiblePlan("nothing"))
    seen = (*ticks(1, 8, DOOMED), *ticks(9, 28, 306.4, "reduced", feed=HALF))
    done = stepwise(*seen, action=quits, limits=MILD, monitoring=watching()).run()
    assert done.released == [5.0] and done.handed_over == [] and done.when(NoActionTaken) == [9.0]
