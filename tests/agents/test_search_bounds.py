"""Bounds: a path is never held for dearer than what the search then finds on it, on the same draws."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Mapping, Sequence

import pytest

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.hypotheses import plausible
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Situation
from homeostat.agents.search.action import SearchAction
from homeostat.agents.search.cost import Cost
from homeostat.agents.search.planning import open_paths
from homeostat.domain.advice import Advice
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.recovery import ActionSet, RecoveryPath, open_setpoints
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.twin.twin import Twin
from tests.agents.language.situations import simulation, situation
from tests.twin.followed import reactor

MODULE = "mixing_module"
ROUNDING = 1e-9
TOGETHER = 1e-3
"""What two setpoints may gain only together, which no sweep of one sees, as a share of the design production [1]."""


def search(plant: Plant, twin: Twin) -> SearchAction:
    d = plant.description
    return SearchAction(twin, d, Pricing(plant.prices, d.limits, d.scales))


def opened(plant: Plant, asked: Situation) -> list[RecoveryPath]:
    return list(open_paths(plant.description, Grounding(plant.graph, plant.namespace), asked, Advice()))


def price(plant: Plant, twin: Twin, asked: Situation, actions: ActionSet) -> float:
    """What releasing ``actions`` costs on the members that bounds are computed on, as a share of what is made."""
    d, frozen = plant.description, twin.frozen()
    cost = Cost(d.limits, Pricing(plant.prices, d.limits, d.scales), d.scales, slack=0.0)
    few = frozen.ensemble(plausible(asked.diagnosis), frozen.settings.search_draws)
    if actions.then:
        signals = frozen.follow_many(few, [actions])
    else:
        signals = frozen.try_many(few, frozen.schedules([actions], frozen.settings.horizon_s))
    seconds = signals[0][next(iter(signals[0]))].shape[1] * signals[1]
    released = plant.prices.release / plant.prices.worth(seconds)
    return float(cost.judge(*signals, few.weights, [actions])[0, 0]) + released


def found(subject: SearchAction, asked: Situation, paths: Sequence[RecoveryPath]) -> list[ActionSet]:
    return [asyncio.run(subject.act(asked, path, Advice())) for path in paths]


@pytest.mark.parametrize("fault", ["cool_stuck_closed", "cool_stuck_open", "fouling", "pump_degrade"])
def test_what_is_found_for_a_state_costs_no_less_than_its_bound(fault: str) -> None:
    plant, asked = reactor(), situation(fault)
    twin = simulation(fault)._twin
    paths = [p for p in opened(plant, asked) if len(p.states) == 2]
    subject = search(plant, twin)
    bounds = asyncio.run(subject.bounds(asked, paths))
    assert len(bounds) == len(paths) >= 2
    for bound, actions in zip(bounds, found(subject, asked, paths), strict=True):
        assert bound <= price(plant, twin, asked, actions) + TOGETHER


@functools.cache
def batch(fault: str) -> tuple[Twin, Situation]:
    """A batch 20 s after ``fault`` began, and its twin."""
    plant = load_plant(MODULE)
    chosen: Scenario = scenario(plant, fault, 3)
    assert chosen.onset_s is not None
    seen: list[Snapshot] = []
    sequencer, until = new_sequencer(plant), int(chosen.onset_s) + 20

    def watched(snapshot: Snapshot) -> bool:
        seen.append(snapshot)
        return len(seen) >= until

    watch(open_process(plant, chosen), sequencer.sample, watched)
    twin = Twin(plant.model, plant.description, plant.twin, 0)
    for snapshot in seen[:until]:
        twin.observe(snapshot)
    diagnosis = Diagnosis(seen[until - 1].at_s, (), (Hypothesis(chosen.faults, 0.9), Hypothesis((), 0.1)))
    return twin, Situation(seen[until - 1], diagnosis, "filling_B203", tuple(seen[:until]))


@pytest.mark.parametrize("fault", ["pump_failure", "pump_degradation", "clogging_B201"])
def test_what_is_found_along_a_route_costs_no_less_than_its_bound(fault: str) -> None:
    plant, (twin, asked) = load_plant(MODULE), batch(fault)
    paths = opened(plant, asked)
    assert any(open_setpoints(p.commanded_states) for p in paths) and all(p.awaited for p in paths)
    subject = search(plant, twin)
    bounds = asyncio.run(subject.bounds(asked, paths))
    for bound, actions in zip(bounds, found(subject, asked, paths), strict=True):
        assert bound <= price(plant, twin, asked, actions) + ROUNDING


def test_routes_are_told_apart_by_what_they_may_cost() -> None:
    """To stop and wait for somebody costs more than a batch is worth; the way around still delivers it."""
    plant, (twin, asked) = load_plant(MODULE), batch("pump_failure")
    paths = opened(plant, asked)
    bounds: Mapping[str, float] = dict(
        zip((p.target for p in paths), asyncio.run(search(plant, twin).bounds(asked, paths)), strict=True)
    )
    assert bounds["complete"] < 0.5 and bounds["held"] > 1.0


def test_nothing_forbids_in_a_bound() -> None:
    """Full feed with the valve stuck is much too hot, and still what a reduced load costs at best."""
    plant, fault = reactor(), "cool_stuck_closed"
    asked = situation(fault)
    subject = search(plant, simulation(fault)._twin)
    (path,) = (p for p in opened(plant, asked) if p.states == ("normal", "reduced_load"))
    (bound,) = asyncio.run(subject.bounds(asked, [path]))
    (actions,) = found(subject, asked, [path])
    assert bound < price(plant, simulation(fault)._twin, asked, actions) - 0.1


def test_the_same_question_has_the_same_bounds_whatever_was_searched_before() -> None:
    plant, asked, fault = reactor(), situation("fouling"), "fouling"
    paths = [p for p in opened(plant, asked) if len(p.states) == 2]
    one, other = search(plant, simulation(fault)._twin), search(plant, simulation(fault)._twin)
    found(other, asked, paths[:1])
    assert asyncio.run(one.bounds(asked, paths)) == asyncio.run(other.bounds(asked, paths))
