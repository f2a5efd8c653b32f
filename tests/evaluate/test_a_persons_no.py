"""In approve a person's no, or a tag out of service, has nothing written: physics says when a fallback acts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from homeostat.domain.events.guard import Armed, RequestAnswered
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.events.writes import WriteIntended
from homeostat.domain.mode import Mode, Verb
from homeostat.evaluate.operation import Operation
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import load_plant
from tests.evaluate.test_operation import Person

pytestmark = pytest.mark.slow

Answer = Callable[[RequestAnswered], list[tuple[Verb, dict[str, Any]]]]


def reject(event: RequestAnswered) -> list[tuple[Verb, dict[str, Any]]]:
    return [(Verb.REJECT, {"subject": event.request, "reason": "not now"})]


def out_of_service(*tags: str) -> Answer:
    return lambda event: [(Verb.OUT_OF_SERVICE, {"subject": tag, "reason": "maintenance"}) for tag in tags]


def approving(plant: str, fault: str, answer: Answer, end_s: float) -> tuple[Person, Run]:
    """A run in approve with a person who gives ``answer`` to whatever is offered."""
    case, person, trace = load_plant(plant), Person(offered=answer), MemoryTrace()
    trace.subscribe(person)
    operation = Operation(Mode.APPROVE, orders=person.orders)
    return person, run(case, scenario(case, fault, 1, end_s=end_s), trace, DeclaredClock(1.0), operation=operation)


def alarms(person: Person) -> list[str]:
    return [e.cause for e in person.of(AlarmRaised) if e.alarm == "fallback wanted"]


@pytest.mark.parametrize(
    "answer", [reject, pytest.param(out_of_service("VI201.cmd", "VI203.cmd"), marks=pytest.mark.wide)]
)
def test_where_no_limit_is_in_danger_the_plant_is_left_as_it_is(answer: Answer) -> None:
    person, result = approving("mixing_module", "stuck_closed_VI202", answer, 130.0)
    assert alarms(person)[0].startswith("no path from 'filling_B202'"), "and nothing about a time: there is none"
    assert "physics" not in alarms(person)[0]
    assert person.of(FallbackActivated) == [] and result.actor == "none" and result.state == "filling_B202"
    assert [w.source for w in person.of(WriteIntended)] == ["t0", "t1"]


@pytest.mark.parametrize("answer", [out_of_service("F1.sp"), pytest.param(reject, marks=pytest.mark.wide)])
def test_where_physics_leaves_a_time_the_fallback_acts_when_it_is_over(answer: Answer) -> None:
    person, result = approving("cstr", "cool_stuck_closed", answer, 2120.0)
    acted_s = next(at_s for event, at_s in person.seen if isinstance(event, FallbackActivated))
    by_s = [event.act_by_s for event, at_s in person.seen if isinstance(event, Armed) and at_s < acted_s]
    assert acted_s == by_s[-1], "not a second after the no"
    assert alarms(person)[0].endswith(f"; physics leaves time until {by_s[-1]:.0f} s")
    assert result.actor == "fallback" and result.reason == "recovery has not acted in the time that physics leaves"
    assert all(exposure.total_s == 0.0 for exposure in result.exposures)
