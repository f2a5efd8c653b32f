"""Planning by enumeration: the path that may cost least comes first, and where none can win, there is no other."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Sequence
from dataclasses import replace

import pytest

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.agents.search.planning import SAME, SearchPlanning, open_paths
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Approve, Revise
from tests.agents.stuck_valve import grounding, now
from tests.twin.followed import reactor

FOULING = Hypothesis((FaultState("fouling", 0.5, 1450.0),), 1.0)
ADVICE = Advice()
COMPENSATED, REDUCED, HOLDING = ("compensated",), ("reduced_load",), ("holding",)


class Bounded:
    """What paths cost at best, by the states that they command; who was asked about what."""

    def __init__(self, costs: dict[tuple[str, ...], float]) -> None:
        self._costs = costs
        self.asked: list[list[tuple[str, ...]]] = []

    async def __call__(self, situation: Situation, paths: Sequence[RecoveryPath]) -> Sequence[float]:
        self.asked.append([path.commanded for path in paths])
        return [self._costs[path.commanded] for path in paths]


def situation() -> Situation:
    """A jacket that fouls: three states may be commanded."""
    return replace(now(), diagnosis=Diagnosis(0.0, (), (FOULING,)))


def plan(bounds: Bounded | None, advice: Advice = ADVICE, asked: Situation | None = None) -> tuple[str, ...]:
    planning = SearchPlanning(reactor().description, grounding(), bounds)
    return asyncio.run(planning.plan(asked or situation(), advice)).commanded


def idle(share: float, optional: bool) -> Situation:
    """The same where doing nothing costs ``share`` of what is made by design."""
    return replace(situation(), idle_cost=Cost((CostItem("production", 30.0 * share),), 30.0), optional=optional)


def tried(path: tuple[str, ...], share: float, approved: bool = True) -> Attempt:
    """An attempt on a path, which would cost ``share`` of what is made by design."""
    found = next(p for p in every() if p.commanded == path)
    verdict = Approve("", ()) if approved else Revise(())
    return Attempt(
        1, found, ActionSet((), found.target), verdict, 1, Cost((CostItem("production", 30.0 * share),), 30.0)
    )


def every() -> list[RecoveryPath]:
    return list(open_paths(reactor().description, grounding(), situation(), Advice()))


def after(*attempts: Attempt) -> Advice:
    """The advice after these, whose paths are not to be taken again."""
    return Advice(refused_paths=tuple(a.path.commanded for a in attempts if a.path), attempts=attempts)


def test_three_states_may_be_commanded() -> None:
    assert {p.commanded for p in every()} == {COMPENSATED, REDUCED, HOLDING}


@pytest.mark.parametrize("cheapest", [COMPENSATED, REDUCED, HOLDING])
def test_the_path_that_may_cost_least_comes_first(cheapest: tuple[str, ...]) -> None:
    costs = dict.fromkeys((COMPENSATED, REDUCED, HOLDING), 0.5) | {cheapest: 0.1}
    assert plan(Bounded(costs)) == cheapest


@pytest.mark.parametrize(
    "fault, left",
    [
        ("V2_stuck", {REDUCED, HOLDING}),
        ("V1_stuck", {COMPENSATED, HOLDING}),
        ("P1_stuck", {COMPENSATED, REDUCED, HOLDING}),
        ("unknown_position_V2", {COMPENSATED, REDUCED, HOLDING}),
    ],
)
def test_an_actuator_that_stands_still_takes_away_what_needs_it(fault: str, left: set[tuple[str, ...]]) -> None:
    """The graph has no node for it, as it has for a stuck valve of the tables; what only stands elsewhere moves."""
    stands = Hypothesis((FaultState(fault, 1.0, 1450.0),), 1.0)
    asked = replace(now(), diagnosis=Diagnosis(0.0, (), (stands,)))
    assert {p.commanded for p in open_paths(reactor().description, grounding(), asked, Advice())} == left


def test_without_bounds_the_least_risky_comes_first() -> None:
    refused, found = Advice(), []
    for _ in range(3):
        found.append(plan(None, refused))
        refused = Advice(refused_paths=tuple(found))
    risks = [max(reactor().description.machine.state(s).risk for s in path) for path in found]
    assert risks == sorted(risks) and set(found) == {COMPENSATED, REDUCED, HOLDING}


def test_of_equals_the_least_risky_comes_first() -> None:
    assert plan(Bounded(dict.fromkeys((COMPENSATED, REDUCED, HOLDING), 0.3))) == plan(None)


def test_what_was_refused_is_not_asked_about() -> None:
    bounds = Bounded({COMPENSATED: 0.0, REDUCED: 0.4, HOLDING: 0.2})
    assert plan(bounds, Advice(refused_paths=(COMPENSATED,))) == HOLDING
    assert COMPENSATED not in bounds.asked[0]


def test_another_path_is_tried_as_long_as_it_may_cost_less_than_what_is_approved() -> None:
    bounds = Bounded({COMPENSATED: 0.1, REDUCED: 0.2, HOLDING: 1.0})
    assert plan(bounds, after(tried(COMPENSATED, 0.25))) == REDUCED


@pytest.mark.parametrize("approved", [0.2, 0.15, 0.2 + 0.9 * SAME])
def test_planning_ends_where_nothing_that_is_left_can_cost_less(approved: float) -> None:
    bounds = Bounded({COMPENSATED: 0.1, REDUCED: 0.2, HOLDING: 1.0})
    with pytest.raises(NoAdmissiblePlan, match="no path that is left can cost less than what is approved"):
        plan(bounds, after(tried(COMPENSATED, approved)))


@pytest.mark.parametrize("alone", [0.05, 0.1 + 0.9 * SAME])
def test_nothing_is_planned_that_cannot_cost_less_than_leaving_the_plant_alone(alone: float) -> None:
    bounds = Bounded({COMPENSATED: 0.1, REDUCED: 0.2, HOLDING: 1.0})
    with pytest.raises(NoAdmissiblePlan, match="no path that is left can cost less than leaving the plant alone"):
        plan(bounds, asked=idle(alone, optional=True))
    assert plan(bounds, asked=idle(alone, optional=False)) == COMPENSATED


def test_what_may_cost_less_than_leaving_the_plant_alone_is_planned() -> None:
    bounds = Bounded({COMPENSATED: 0.1, REDUCED: 0.2, HOLDING: 1.0})
    assert plan(bounds, asked=idle(0.15, optional=True)) == COMPENSATED


def test_the_cheapest_approval_counts() -> None:
    bounds = Bounded({COMPENSATED: 0.1, REDUCED: 0.2, HOLDING: 0.5})
    with pytest.raises(NoAdmissiblePlan, match="can cost less"):
        plan(bounds, after(tried(COMPENSATED, 0.9), tried(REDUCED, 0.3)))


def test_what_was_refused_is_no_reason_to_stop_however_cheap_it_was() -> None:
    bounds = Bounded({COMPENSATED: 0.1, REDUCED: 0.2, HOLDING: 0.5})
    assert plan(bounds, after(tried(COMPENSATED, 0.0, approved=False))) == REDUCED


def test_where_nothing_is_left_the_reason_is_that_and_nobody_is_asked_for_bounds() -> None:
    bounds = Bounded({})
    with pytest.raises(NoAdmissiblePlan, match="no path from 'normal' is open with fouling; targets refused: "):
        plan(bounds, after(tried(COMPENSATED, 0.1), tried(REDUCED, 0.3), tried(HOLDING, 1.0)))
    assert bounds.asked == []


def test_bounds_are_computed_once_for_each_diagnosis() -> None:
    bounds = Bounded({COMPENSATED: 0.1, REDUCED: 0.2, HOLDING: 0.5})
    planning = SearchPlanning(reactor().description, grounding(), bounds)
    asked = situation()
    later = replace(asked, diagnosis=replace(asked.diagnosis, at_s=60.0))
    for each in (asked, asked, later):
        assert asyncio.run(planning.plan(each, ADVICE)).commanded == COMPENSATED
    assert asyncio.run(planning.plan(later, Advice(refused_paths=(COMPENSATED,)))).commanded == REDUCED
    assert len(bounds.asked) == 2


class Tight(Grounding):
    """Knows of a plant whose states all need a tight vessel."""

    def allows(self, states: Sequence[str], faults: Collection[str]) -> bool:
        return "leak" not in faults


def tight() -> SearchPlanning:
    plant = reactor()
    return SearchPlanning(plant.description, Tight(plant.graph, plant.namespace))


def with_a_leak(probability: float, act_by_s: float | None) -> Situation:
    """A jacket that fouls, or else a vessel that leaks, which leaves no path open."""
    leak = Hypothesis((FaultState("leak", 0.001, 1450.0),), probability)
    hypotheses = (replace(FOULING, probability=1.0 - probability), leak)
    return replace(now(), diagnosis=Diagnosis(0.0, (), hypotheses), act_by_s=act_by_s)


def test_what_is_hardly_probable_takes_nothing_away_where_else_the_plant_must_fall_back() -> None:
    assert asyncio.run(tight().plan(with_a_leak(0.03, 10.0), ADVICE)).commanded == COMPENSATED


@pytest.mark.parametrize(("probability", "act_by_s"), [(0.03, None), (0.1, 10.0)])
def test_it_does_where_the_plant_may_be_left_alone_and_where_it_is_likely(
    probability: float, act_by_s: float | None
) -> None:
    with pytest.raises(NoAdmissiblePlan, match="is open with fouling, leak"):
        asyncio.run(tight().plan(with_a_leak(probability, act_by_s), ADVICE))


def test_where_something_was_open_and_was_refused_nothing_more_is_offered() -> None:
    planning = SearchPlanning(reactor().description, grounding())
    refused = Advice(refused_paths=(COMPENSATED, REDUCED, HOLDING))
    with pytest.raises(NoAdmissiblePlan, match="targets refused"):
        asyncio.run(planning.plan(replace(situation(), act_by_s=10.0), refused))
