"""A batch that deviates from its prediction is looked at, whatever monitoring notices."""

from __future__ import annotations

from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.deviations import Deviated
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import NoActionTaken, Noticed, ReleasedActions
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import StepBand
from homeostat.recovery.bounds import InterventionBounds
from homeostat.recovery.plant_rules import Bounds
from tests.agents.scripted import ScriptedAction, ScriptedMonitoring
from tests.recovery.line import COOLING, GOOD, Stage, monitoring, run
from tests.safety.world import CALM, HOT, rule

BOUNDS = Bounds(intervention=InterventionBounds(slack_s=5.0, repeat_s=30.0))
BAND = StepBand(30.0, 40.0)
"""When the twin says that it is cold [s]."""


def stage(band: StepBand = BAND, **changed: object) -> Stage:
    """A cooling line that nobody notices anything about."""
    healthy = ScriptedMonitoring(answer=lambda at_s: Diagnosis(at_s, (), ()))
    made = Stage(ScriptedAction(GOOD), monitoring=healthy, bounds=BOUNDS, machine=COOLING, **changed)  # type: ignore[arg-type]
    made.twin.bands = lambda actions: (band,) * len(actions.then)
    return made


def states(done: Stage) -> list[str]:
    return [e.state for e in done.trace.of(StateEntered)]


def deviations(done: Stage) -> list[tuple[float, str]]:
    return [(e.at_s, e.event.transition) for e in done.trace.entries if isinstance(e.event, Deviated)]


def test_a_late_step_is_looked_at_and_left_alone_where_all_is_well() -> None:
    done = run(stage(heating=0.0))
    assert deviations(done) == [(46.0, "cools"), (76.0, "cools"), (106.0, "cools")]
    assert monitoring(done).deviations == [True] * 3
    assert len(done.trace.of(Noticed)) == len(done.trace.of(NoActionTaken)) == 3
    assert done.plant.written == [] and monitoring(done).outcomes == [], "a healthy plant is not improved"


def test_a_late_step_gets_a_new_plan_where_the_rest_does_not_do() -> None:
    done = run(stage(heating=0.15))
    assert deviations(done)[0] == (46.0, "cools")
    (released,) = done.trace.of(ReleasedActions)
    assert released.digest == GOOD.digest and len(monitoring(done).outcomes) == 1


def test_a_step_in_time_is_no_news() -> None:
    made = stage(heating=0.0)
    made.plant.disturb = lambda at_s, values: values.update(T=289.0) if at_s == 35.0 else None
    done = run(made)
    assert deviations(done) == [] and states(done)[-1] == "reduced"


def test_an_early_step_is_looked_at() -> None:
    made = stage(heating=0.0)
    made.plant.disturb = lambda at_s, values: values.update(T=289.0) if at_s == 20.0 else None
    assert deviations(run(made)) == [(20.0, "cools")]


def test_a_step_that_a_permissive_forbids_is_looked_at() -> None:
    warm = rule("PRM-WARM", LimitKind.PERMISSIVE, "T >= 295")
    done = run(stage(heating=-0.2, limits=Limits((HOT, warm), (CALM,)), band=StepBand(500.0, 600.0)))
    found = done.trace.of(Deviated)
    assert found and "forbidden since" in found[0].reason and "PRM-WARM" in found[0].reason


def test_nothing_is_predicted_where_no_slack_is_stated() -> None:
    asked: list[ActionSet] = []

    def bands(actions: ActionSet) -> tuple[StepBand, ...]:
        asked.append(actions)
        return (BAND,) * len(actions.then)

    made = stage(heating=0.0)
    made.bounds = Bounds()
    made.twin.bands = bands
    assert deviations(run(made)) == [] and asked == []
