"""What nobody acting would have come to, in the plant's currency; by that an action is needless or not."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import pytest

from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.outcome import Outcome
from homeostat.evaluate.reference.left_alone import LeftAlone, left_alone
from homeostat.evaluate.reference.unsupervised import fault_free, unsupervised
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import Scenario, scenario
from homeostat.evaluate.score.costs import run_cost
from homeostat.evaluate.score.outcome import intervened, written
from homeostat.links.clock import DeclaredClock
from homeostat.record.run_record import RunRecord
from tests.twin.followed import reactor

STUCK = scenario(reactor(), "cool_stuck_closed", 1, 1450.0, None, 2400.0)
"""Without action it is too hot within minutes, and stays so."""
COLD = scenario(reactor(), "cool_stuck_open", 1, 1450.0, None, 1650.0)
"""Without action it is too cold, which violates no hard limit."""
QUIET = scenario(reactor(), "none", 1, None, None, 1500.0)


def costs(amount: float) -> Cost:
    return Cost((CostItem("production", amount),), 100.0)


def alone(chosen: Scenario, from_s: float) -> LeftAlone:
    found = left_alone(reactor(), chosen, fault_free(reactor(), chosen).truth, from_s)
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("left", "ours", "no_more"),
    [(10.0, 10.0, True), (10.5, 10.0, True), (10.6, 10.0, False), (585.6, 36.1, False), (0.0, 5.0, True)],
)
def test_what_differs_by_half_a_percent_of_what_is_made_by_design_costs_the_same(
    left: float, ours: float, no_more: bool
) -> None:
    found = LeftAlone(keeps=True, cost=costs(left), same=0.5)
    assert found.makes_needless(costs(ours)) is no_more
    assert not replace(found, keeps=False).makes_needless(costs(ours)), "a hard limit has no price"


@pytest.mark.parametrize(
    ("left", "ours", "no_more"), [(math.nan, 1.0, False), (math.inf, math.inf, False), (1.0, math.nan, False)]
)
def test_what_is_not_known_never_costs_no_more(left: float, ours: float, no_more: bool) -> None:
    assert LeftAlone(keeps=True, cost=costs(left), same=0.5).makes_needless(costs(ours)) is no_more


def test_a_release_where_nothing_is_wrong_is_needless() -> None:
    healthy = fault_free(reactor(), QUIET).truth
    found, truth = alone(QUIET, 600.0), unsupervised(reactor(), QUIET).truth
    ours = run_cost(reactor(), truth, healthy, 600.0, [("normal", 600.0)], releases=1)
    assert found.keeps and found.cost.total < ours.total and found.makes_needless(ours)
    assert found.same == pytest.approx(0.005 * reactor().prices.worth(900.0))


def test_leaving_a_stuck_valve_alone_costs_what_a_violation_costs() -> None:
    found = alone(STUCK, 1450.0)
    named = {item.name for item in found.cost.items}
    assert not found.keeps and named & {limit.name for limit in reactor().description.limits.hard}
    assert not found.makes_needless(costs(1e9))


def test_nobody_is_compared_with_who_did_nothing() -> None:
    mild = scenario(reactor(), "temp_bias", 1, 1450.0, 0.5, 1600.0)
    result = run(reactor(), mild, clock=DeclaredClock(1.0))
    assert result.outcome is Outcome.NO_ACTION and result.cost_alone is None


@pytest.mark.parametrize(("released", "fell_back"), [(True, False), (True, True), (False, True), (False, False)])
def test_what_a_fallback_wrote_is_compared_as_well_and_is_not_needless(released: bool, fell_back: bool) -> None:
    """After a release that led outside limits a fallback acts: what that was for can be seen."""
    record = SimpleNamespace(stepwise=False, released=[1] * released, fallbacks=[1] * fell_back, states=[])
    assert written(reactor(), cast(RunRecord, record)) is (released or fell_back)
    assert intervened(reactor(), cast(RunRecord, record)) is (released and not fell_back)


def test_what_a_soft_criterion_costs_makes_an_action_worth_it() -> None:
    """A reactor that is cooled too well keeps every hard limit and loses no product; it is too cold all the time."""
    found = alone(COLD, 1450.0)
    soft = sum(item.amount for item in found.cost.items if item.name == "ACC-T")
    assert found.keeps and soft > 0.9 * found.cost.total > 2.0 * found.same
    assert found.makes_needless(found.cost) and not found.makes_needless(costs(0.5 * found.cost.total))


@pytest.mark.slow
def test_what_was_done_to_a_reactor_that_cools_too_well_was_worth_it() -> None:
    """By limits and production alone it was called needless, against the comparison that it was released by."""
    result = run(reactor(), COLD, clock=DeclaredClock(1.0))
    assert result.outcome is Outcome.RECOVERED and result.cost_alone is not None
    assert result.cost_alone.total > 2.0 * result.cost.total
    assert result.cost_alone == alone(COLD, 1450.0).cost, "over the same span"


@pytest.mark.wide
@pytest.mark.parametrize(("keeps", "kind"), [(True, Outcome.NEEDLESS_ACTION), (False, Outcome.RECOVERED)])
def test_an_action_is_needless_where_leaving_alone_costs_no_more(
    keeps: bool, kind: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("homeostat.evaluate.runner.left_alone", lambda *_: LeftAlone(keeps, costs(0.0), 0.0))
    result = run(reactor(), COLD, clock=DeclaredClock(1.0))
    assert result.outcome is kind and result.cost_alone == costs(0.0)
