"""Prices: what a table states counts, what it leaves out follows from the product, and what forbids has no price."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.cost import PRODUCT, RELEASE, Cost, CostItem
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.plant.prices import Price, PriceKind, Prices, prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.plant.state_machine import State, StateMachine
from homeostat.stl.formula import parse

TRUE = parse("true")
LITRES = Production("F", 0.05)
"""0.05 L/s: 180 L in an hour."""


def limit(name: str, kind: LimitKind, hard: bool) -> Limit:
    return Limit(name, kind, TRUE, hard, "OE-1", name)


def criterion(name: str, hard: bool) -> Criterion:
    return Criterion(name, Owner.ACTION, TRUE, hard, "PF-1", name)


HOT, FULL = limit("HOT", LimitKind.TRIP_LIMIT, True), limit("FULL", LimitKind.ENVELOPE, True)
COLD, FEED = limit("COLD", LimitKind.ENVELOPE, False), limit("FEED", LimitKind.PERMISSIVE, False)
SAFE, CALM = criterion("SAFE", True), criterion("CALM", False)
LIMITS = Limits((HOT, FULL, COLD, FEED), (SAFE, CALM))


def state(name: str, risk: int) -> State:
    return State(name, name, risk, risk == 0, risk > 0, TRUE, frozenset(), ())


MACHINE = StateMachine("m", (state("normal", 0), state("reduced", 2), state("stopped", 7)), ())


def priced(*rows: Price, production: Production = LITRES) -> Prices:
    return prices_of(rows, production, "EUR", LIMITS, MACHINE)


def test_every_rule_forbids_or_costs_and_none_does_both() -> None:
    assert LIMITS.forbidding == ((SAFE,), (HOT, FULL, FEED))
    assert LIMITS.priced == (CALM, COLD)


def test_without_a_table_everything_has_a_price_that_follows_from_the_product() -> None:
    prices = priced()
    assert (prices.product, prices.currency) == (1.0, "EUR")
    assert prices.release == pytest.approx(0.45)  # 9 s of 0.05 L/s
    assert prices.states == pytest.approx({"normal": 0.0, "reduced": 3.6, "stopped": 12.6})  # 1 % of 180 L a rank
    assert prices.outside == pytest.approx({"CALM": 18.0, "COLD": 18.0})  # a tenth of 180 L
    assert prices.violation == pytest.approx({"HOT": 180.0, "FULL": 180.0})  # an hour
    assert prices.worth(60.0) == pytest.approx(3.0)


def test_a_dearer_product_makes_everything_dearer_that_nobody_has_stated() -> None:
    prices = priced(Price(PriceKind.PRODUCT, "litre", 2.0), Price(PriceKind.STATE, "stopped", 5.0))
    assert (prices.product, prices.release) == (2.0, pytest.approx(0.9))
    assert prices.states == pytest.approx({"normal": 0.0, "reduced": 7.2, "stopped": 5.0})


def test_what_is_stated_counts_for_its_kind_only_and_nothing_is_a_price() -> None:
    rows = (
        Price(PriceKind.RELEASE, "release", 0.0),
        Price(PriceKind.CRITERION, "CALM", 0.0),
        Price(PriceKind.LIMIT, "HOT", 7.0),
        Price(PriceKind.LIMIT, "COLD", 9.0),  # a table with this is refused
    )
    prices = priced(*rows)
    assert prices.release == 0.0 and prices.outside == pytest.approx({"CALM": 0.0, "COLD": 18.0})
    assert prices.violation == pytest.approx({"HOT": 7.0, "FULL": 180.0})


def test_an_amount_is_made_in_the_time_of_a_batch() -> None:
    batch = Production("delivered", 6.0, 600.0)
    assert (LITRES.made(100.0), batch.made(600.0), batch.made(1800.0)) == pytest.approx((5.0, 6.0, 18.0))
    assert priced(Price(PriceKind.PRODUCT, "litre", 5.0), production=batch).worth(600.0) == pytest.approx(30.0)


def test_a_cost_is_the_sum_of_its_items_and_may_be_a_gain() -> None:
    cost = Cost((CostItem(PRODUCT, -3.0), CostItem(RELEASE, 0.5), CostItem("CALM", 1.0)), 30.0)
    assert (cost.total, cost.share) == pytest.approx((-1.5, -0.05))
    assert Cost((), 30.0).total == 0.0
    assert math.isinf(Cost((CostItem("CALM", math.inf),), 30.0).total)
