"""What a run truly cost, by prices and trajectories that were made by hand, so that every number can be checked."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.cost import Cost
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.plant.prices import Price, PriceKind, prices_of
from homeostat.domain.plant.rules import StartUp
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.score.costs import run_cost
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.plants.plant import Plant
from homeostat.stl.formula import parse
from tests.twin.followed import reactor

TAGS = reactor().description.tags_by_name
WARM = Criterion("WARM", Owner.ACTION, parse("T1 >= 305", TAGS), False, "PF-1", "The product is warm")
FULL = Limit("FULL", LimitKind.ENVELOPE, parse("L1 >= 9", TAGS), False, "OE-1", "The vessel is full")
HOT = Limit("HOT", LimitKind.TRIP_LIMIT, parse("T1 <= 313", TAGS), True, "OE-2", "Safety")
ROWS = (
    Price(PriceKind.PRODUCT, "litre", 2.0),
    Price(PriceKind.RELEASE, "release", 0.5),
    Price(PriceKind.STATE, "reduced_load", 36.0),
    Price(PriceKind.STATE, "holding", 72.0),
    Price(PriceKind.CRITERION, "WARM", 360.0),
    Price(PriceKind.CRITERION, "FULL", 720.0),
)
END = 101
"""Samples, one a second; the first is at 1 s, and nothing of it is scored: what counts begins after 1 s."""


def plant(*soft: Criterion) -> Plant:
    """The reactor's tags and states, with rules and prices of its own; a kelvin and 0.2 L are one scale."""
    limits = Limits((HOT, FULL), (WARM, *soft))
    description = replace(reactor().description, limits=limits)
    prices = prices_of(ROWS, reactor().production, "EUR", limits, description.machine)
    return replace(reactor(), description=description, prices=prices, delivered=("product",))


def truth(made: float = 1.0, temperature: float = 310.0, level: float = 10.0) -> Trajectory:
    """``made`` litres a second; temperature [K] and level [L] stay."""
    product = np.cumsum(np.full(END, made))
    rows = {"T1": np.full(END, temperature), "L1": np.full(END, level), "product": product}
    return Trajectory(1.0, 1.0, {tag: values[None] for tag, values in rows.items()})


HEALTHY = truth()


def items(cost: Cost) -> dict[str, float]:
    return {item.name: item.amount for item in cost.items}


def test_a_run_in_which_nothing_happens_costs_nothing() -> None:
    cost = run_cost(plant(), HEALTHY, HEALTHY, 1.0, [("normal", 1.0)])
    assert cost.items == () and cost.total == 0.0
    assert cost.worth == pytest.approx(200.0)  # 100 L at 2 EUR


def test_production_is_what_is_missing_at_its_price_and_more_is_worth_nothing() -> None:
    assert items(run_cost(plant(), truth(made=0.75), HEALTHY, 1.0)) == pytest.approx({"production": 50.0})
    assert run_cost(plant(), truth(made=1.5), HEALTHY, 1.0).items == ()
    assert run_cost(plant(), truth(made=0.75), HEALTHY, 1.0).share == pytest.approx(0.25)


def test_a_soft_rule_costs_by_how_far_and_how_long_it_is_missed() -> None:
    """100 s at 2 K: 360 EUR/h x 2 x 100 / 3600 h; 100 s at 0.4 L, which are two scales: twice that."""
    cost = run_cost(plant(), truth(temperature=303.0, level=8.6), HEALTHY, 1.0)
    assert items(cost) == pytest.approx({"WARM": 20.0, "FULL": 40.0})
    assert run_cost(plant(), truth(temperature=303.0), HEALTHY, 51.0).total == pytest.approx(10.0), "only what is later"


def test_a_hard_limit_that_is_violated_costs_one_violation_however_long_it_lasts() -> None:
    once = run_cost(plant(), truth(temperature=330.0), HEALTHY, 1.0)
    assert {item.name: item.amount for item in once.items} == {
        limit.name: plant().prices.violation[limit.name]
        for limit in plant().description.limits.hard
        if not limit.formula.holds({tag: float(v[0, -1]) for tag, v in truth(temperature=330.0).signals.items()})
    }
    assert once.items


def test_states_cost_by_the_hour_from_the_onset_to_the_end_and_releases_by_the_piece() -> None:
    states = [("normal", 1.0), ("reduced_load", 21.0), ("holding", 71.0)]
    cost = run_cost(plant(), HEALTHY, HEALTHY, 1.0, states, releases=3)
    assert items(cost) == pytest.approx({"reduced_load": 0.5, "holding": 0.6, "release": 1.5})  # 50 s, 30 s
    assert cost.total == pytest.approx(2.6)
    later = items(run_cost(plant(), HEALTHY, HEALTHY, 61.0, states))
    assert later == pytest.approx({"reduced_load": 0.1, "holding": 0.6})  # only 10 s of it since the onset
    twice = items(run_cost(plant(), HEALTHY, HEALTHY, 1.0, [("holding", 1.0), ("normal", 11.0), ("holding", 91.0)]))
    assert twice == pytest.approx({"holding": 0.4})  # 10 s twice


def test_everything_is_one_sum() -> None:
    cost = run_cost(plant(), truth(made=0.75, temperature=303.0), HEALTHY, 1.0, [("holding", 51.0)], releases=1)
    assert items(cost) == pytest.approx({"WARM": 20.0, "production": 50.0, "holding": 1.0, "release": 0.5})
    assert cost.total == pytest.approx(71.5)


def test_a_rule_that_looks_ahead_is_missed_as_a_whole_all_the_time() -> None:
    ahead = Criterion("AHEAD", Owner.ACTION, parse("always[10,50] (T1 >= 304)", TAGS), False, "PF-2", "Warm later")
    with_it = plant(ahead)
    price = with_it.prices.outside["AHEAD"]
    assert price == pytest.approx(0.1 * 2.0 * reactor().production.design_rate * 3600.0)
    found = items(run_cost(with_it, truth(temperature=303.0), HEALTHY, 1.0))
    assert found["AHEAD"] == pytest.approx(price * 1.0 * 100.0 / 3600.0)


def test_nothing_is_missed_in_no_time() -> None:
    """A fault that begins with the last sample, or a run that ends with its first."""
    cost = run_cost(plant(), truth(made=0.75, temperature=303.0), HEALTHY, float(END), [("holding", 1.0)], releases=1)
    assert items(cost) == {"release": 0.5} and cost.worth == 0.0


@pytest.mark.parametrize("lacking", ["T1", "product"])
def test_what_cannot_be_known_has_no_finite_cost(lacking: str) -> None:
    known = truth()
    blind = replace(known, signals={**known.signals, lacking: np.full((1, END), math.nan)})
    assert not math.isfinite(run_cost(plant(), blind, HEALTHY, 1.0).total)
    assert math.isnan(run_cost(replace(plant(), delivered=()), known, HEALTHY, 1.0).total)


def test_what_start_up_does_not_ask_for_costs_nothing_there() -> None:
    """The first 50 s are start-up, in which another limit holds instead of HOT and the product need not be warm."""
    warmer = replace(HOT, formula=parse("T1 <= 340", TAGS))
    spans = ((1.0, 50.0),)
    force = LimitsInForce(plant().description.limits, StartUp(frozenset({"start_up"}), {"HOT": warmer}), spans)
    course = truth(temperature=303.0)
    course.signals["T1"][0, :50] = 330.0
    assert items(run_cost(plant(), course, HEALTHY, 1.0, force=force)) == pytest.approx({"WARM": 360.0 * 2 * 51 / 3600})
    assert "HOT" in items(run_cost(plant(), course, HEALTHY, 1.0)), "without a start-up it holds all the time"
    course.signals["T1"][0, 40] = 341.0
    assert "HOT" in items(run_cost(plant(), course, HEALTHY, 1.0, force=force))
