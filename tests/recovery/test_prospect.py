"""A batch that does not go as predicted is looked at; what is predicted, and when."""

from __future__ import annotations

import threading
from dataclasses import replace

from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.deviations import Deviated
from homeostat.domain.observation import Trouble
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.verdict import NoActionNeeded, Released
from homeostat.recovery.bounds import Budget
from tests.recovery.desk import (
    DOOMED,
    NEXT,
    SLACK,
    hanging,
    late,
    ticks,
    watching,
)
from tests.recovery.line import GOOD, OFF

# --- deviations --------------------------------------------------------------------------------------------------


def test_a_step_that_is_late_is_looked_at_although_no_fault_is_found() -> None:
    done = late().run()
    assert done.monitoring.deviations == [True] and done.when(Deviated) == [16.0]
    assert done.kinds == ["noticed", "deviated", "foreseen", "fallback-armed", "no-action"]
    assert done.monitoring.outcomes == [], "nothing was done, and there is nothing to follow"
    event = done.trace.of(Deviated)[0]
    assert (event.state, event.transition) == ("running", "cools")


def test_a_deviation_that_is_answered_is_followed_by_monitoring() -> None:
    done = late(DOOMED).run()
    assert done.released == [16.0] and done.monitoring.outcomes == [Released(GOOD, 16.0)]


def test_what_is_released_is_what_the_plant_should_do_from_then_on() -> None:
    """It ends with the release, so the steps that this plant still has are predicted anew."""
    done = late(DOOMED).run()
    assert done.released == [16.0]
    assert done.simulation.tried[-1] == (Diagnosis(17.0, (), ()), ActionSet((), "running", NEXT))


def test_a_deviation_with_a_fault_is_followed_by_monitoring_also_where_it_is_left_alone() -> None:
    done = late(monitoring=watching()).run()
    (outcome,) = done.monitoring.outcomes
    assert isinstance(outcome, NoActionNeeded) and done.kinds[2] == "diagnosed"


def test_the_nominal_route_is_predicted_once_and_from_the_fifth_snapshot_on() -> None:
    healthy = Diagnosis(5.0, (), ()), ActionSet((), "running", NEXT)
    for last, expected in ((4, []), (5, [healthy]), (14, [healthy])):
        assert late(last=last).run().simulation.tried == expected, f"after {last} s"


def test_a_route_that_changes_is_predicted_anew() -> None:
    other = (replace(NEXT[0], commands=(Command("F.sp", OFF, 0.005),)),)
    done = late(last=8).run(*ticks(9, 12, then=other))
    assert [actions.then for _, actions in done.simulation.tried] == [NEXT, other]


def test_the_nominal_route_is_predicted_from_every_snapshot_that_there_is() -> None:
    done = late(last=5)
    seen: list[float] = []
    observe = done.twin.observe
    done.twin.observe = lambda snapshot: (seen.append(snapshot.at_s), observe(snapshot))[1]  # type: ignore[method-assign]
    done.run()
    assert seen == [1.0, 2.0, 3.0, 4.0, 5.0]


def test_where_the_prediction_is_late_a_person_is_told_and_no_step_is_expected() -> None:
    let_go = threading.Event()
    done = late(last=5, bounds=replace(SLACK, budget=Budget(arming_s=0.01)))
    done.twin.bug = hanging(let_go)
    try:
        done.run()
    finally:
        let_go.set()
    text = "the prediction took longer than 0.01 s; no step is expected at any time"
    assert done.alarms == [("recovery:prediction", text)] and done.kinds == []


def test_a_twin_that_is_late_is_asked_again_after_a_while_and_not_at_every_tick() -> None:
    let_go = threading.Event()
    done = late(last=26, bounds=replace(SLACK, budget=Budget(arming_s=0.01)))
    done.twin.bug = hanging(let_go)
    try:
        done.run()
    finally:
        let_go.set()
    assert [at_s for at_s, _ in done.sent(Trouble)] == [5.0, 15.0, 25.0]
