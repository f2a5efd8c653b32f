"""Prices: what a table states is taken as it is, everything else follows from the product."""

from __future__ import annotations

import pytest

from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import Price, PriceKind, Prices, prices_of
from homeostat.domain.plant.production import Production
from tests.safety.world import CALM, COLD, FEED, HOT, MACHINE, criterion

LIMITS = Limits((HOT, COLD, FEED), (CALM, criterion("WARM", "T <= 310")))


def prices(*rows: Price, per_s: float = 1.0, rate: float = 1.0 / 30.0) -> Prices:
    """Those of a vessel that makes 120 units an hour, where nothing else is said."""
    return prices_of(rows, Production("F", rate, per_s), "EUR", LIMITS, MACHINE)


def test_what_nobody_states_follows_from_the_product() -> None:
    """120 an hour: a violation costs one of it, a release 9 s, a scale outside 10 %, each rank of risk 1 %."""
    found = prices()
    assert found.product == 1.0 and found.currency == "EUR" and found.worth(3600.0) == pytest.approx(120.0)
    assert found.release == pytest.approx(0.3)
    assert found.violation == {"LIM-HOT": pytest.approx(120.0)}
    assert found.outside == {"WARM": pytest.approx(12.0), "LIM-COLD": pytest.approx(12.0)}
    assert found.states == {
        "waiting": 0.0, "running": pytest.approx(1.2), "emptying": pytest.approx(2.4), "still": pytest.approx(3.6)
    }  # fmt: skip


def test_the_price_of_the_product_moves_everything_that_follows_from_it() -> None:
    once, twice = prices(), prices(Price(PriceKind.PRODUCT, "litre", 2.0))
    assert twice.release == pytest.approx(2.0 * once.release)
    for kind in ("states", "outside", "violation"):
        before, after = getattr(once, kind), getattr(twice, kind)
        assert after == {name: pytest.approx(2.0 * amount) for name, amount in before.items()}


def test_a_batch_s_product_is_worth_what_a_batch_s_time_makes() -> None:
    found = prices(Price(PriceKind.PRODUCT, "litre", 5.0), per_s=600.0, rate=6.0)
    assert found.worth(600.0) == pytest.approx(30.0) and found.violation["LIM-HOT"] == pytest.approx(180.0)


STATED = {
    PriceKind.RELEASE: ("release", lambda p: p.release),
    PriceKind.STATE: ("emptying", lambda p: p.states["emptying"]),
    PriceKind.CRITERION: ("LIM-COLD", lambda p: p.outside["LIM-COLD"]),
    PriceKind.LIMIT: ("LIM-HOT", lambda p: p.violation["LIM-HOT"]),
}


@pytest.mark.parametrize("kind", STATED)
@pytest.mark.parametrize("amount", [0.0, 7.5])
def test_what_a_table_states_is_taken_as_it_is_and_changes_nothing_else(kind: PriceKind, amount: float) -> None:
    """A price of nothing is a price too."""
    subject, of = STATED[kind]
    found, before = prices(Price(kind, subject, amount)), prices()
    assert of(found) == amount
    for other, (_, shown) in STATED.items():
        assert other is kind or shown(found) == shown(before)


def test_what_is_hard_has_no_price_by_the_hour_and_what_is_soft_none_by_the_violation() -> None:
    found = prices()
    assert not found.outside.keys() & found.violation.keys()
    assert "PRM-FEED" not in {*found.outside, *found.violation} and "ACC-CALM" not in found.outside
