"""What a rollout costs, by checks that are done in the head: a vessel of 120 EUR an hour, looked at for 900 s."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.pricing import Pricing, Signals
from homeostat.domain.cost import PRODUCT, RELEASE, Cost
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.prices import Price, PriceKind, prices_of
from homeostat.domain.plant.production import MADE, Production
from homeostat.domain.snapshot import Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult
from tests.safety.world import CALM, COLD, FEED, HOT, MACHINE, criterion, rule

PRODUCTION = Production("F", 1.0 / 30.0)
WARM = criterion("WARM", "T <= 310")
SETTLED = criterion("SETTLED", "always[0,60] (T <= 310)")
LIMITS = Limits((HOT, COLD, FEED, rule("OUT", LimitKind.TRIP_LIMIT, "L <= 0", hard=True)), (CALM, WARM))
AHEAD = Limits((), (SETTLED,))
ROWS = (
    Price(PriceKind.PRODUCT, "product", 1.0),
    Price(PriceKind.RELEASE, "release", 0.3),
    Price(PriceKind.CRITERION, "WARM", 24.0),
    Price(PriceKind.CRITERION, "SETTLED", 24.0),
    Price(PriceKind.CRITERION, "LIM-COLD", 8.0),
    Price(PriceKind.STATE, "running", 4.0),
    Price(PriceKind.STATE, "emptying", 12.0),
    Price(PriceKind.STATE, "still", 0.0),
)
SCALES = {"K": 2.0}
DT_S, SAMPLES = 5.0, 180
QUARTER_H = DT_S * SAMPLES / 3600.0


def pricing(limits: Limits = LIMITS, production: Production = PRODUCTION) -> Pricing:
    return Pricing(prices_of(ROWS, production, "EUR", limits, MACHINE), limits, SCALES)


def signals(members: int = 1, **changed: object) -> Signals:
    """The vessel by design, with some tags at other values: numbers, or arrays of shape (members, 180)."""
    values: dict[str, object] = {"F": 1.0 / 30.0, "T": 305.0, "L": 8.0, **changed}
    return {tag: np.broadcast_to(np.asarray(v, dtype=float), (members, SAMPLES)).copy() for tag, v in values.items()}


def cost(
    of: Signals, *states: str, weights: tuple[float, ...] = (1.0,), releases: int = 0, limits: Limits = LIMITS
) -> Cost:
    rollout = Rollout("", Trajectory(0.0, DT_S, dict(of)), (), weights, RolloutResult.COMPLETED)
    return pricing(limits).of(rollout, states, releases)


def items(found: Cost) -> dict[str, float]:
    """Those that are more than rounding."""
    return {item.name: item.amount for item in found.items if abs(item.amount) > 1e-9}


def test_the_check_that_the_module_states() -> None:
    """Designed for 0.0333 L/s at 1 EUR/L and fed with 0.0233 L/s, a reactor loses 9 EUR of 30 in 900 s."""
    found = cost(signals(F=0.7 / 30.0))
    assert items(found) == {PRODUCT: pytest.approx(9.0)}
    assert found.worth == pytest.approx(30.0) and found.share == pytest.approx(0.3)


def test_a_plant_by_design_that_is_left_alone_in_a_state_without_a_price_costs_nothing() -> None:
    found = cost(signals(), "still")
    assert items(found) == {} and found.total == pytest.approx(0.0) and found.share == pytest.approx(0.0)


def test_what_is_made_beyond_the_design_is_worth_nothing() -> None:
    """Nor does it make up for what was missing before: half of the time without feed costs half of it."""
    assert items(cost(signals(F=1.1 / 30.0))) == {}
    late = np.where(np.arange(SAMPLES) < SAMPLES // 2, 0.0, 2.0 / 30.0)
    assert items(cost(signals(F=late))) == {PRODUCT: pytest.approx(15.0)}


def test_a_soft_criterion_costs_by_the_hour_and_by_the_scale() -> None:
    """24 EUR per hour and 2 K: 4 K above for a quarter of an hour are 12 EUR, for a third of it 4 EUR."""
    hot = np.full(SAMPLES, 314.0)
    assert items(cost(signals(T=hot))) == {"WARM": pytest.approx(12.0)}
    hot[60:] = 305.0
    assert items(cost(signals(T=hot))) == {"WARM": pytest.approx(4.0)}, "where it holds nothing is given back"


def test_a_soft_envelope_has_a_price_as_a_soft_criterion_has() -> None:
    assert items(cost(signals(T=297.0))) == {"LIM-COLD": pytest.approx(8.0 * QUARTER_H * 0.5)}


def test_a_unit_without_a_scale_counts_by_itself() -> None:
    limits = Limits((), (criterion("FULL", "L >= 9"),))
    found = Pricing(prices_of((), PRODUCTION, "EUR", limits, MACHINE), limits, {}).outside(signals(L=7.0), DT_S)
    assert found["FULL"] == pytest.approx(0.1 * 120.0 * QUARTER_H * 2.0)


def test_what_is_hard_is_not_in_the_price() -> None:
    """Neither trip limits, nor permissives, nor hard criteria: they forbid."""
    assert items(cost(signals(L=50.0))) == {}
    assert set(items(cost(signals(T=400.0)))) == {"WARM"}


def test_a_criterion_that_looks_ahead_is_missed_as_a_whole_by_its_first_margin() -> None:
    """4 K above at 60 s are within the window and cost the whole quarter of an hour; 4 K at 65 s are not."""
    late = np.full(SAMPLES, 305.0)
    late[13] = 314.0
    assert items(cost(signals(T=late), limits=AHEAD)) == {}
    late[12] = 314.0
    assert items(cost(signals(T=late), limits=AHEAD)) == {"SETTLED": pytest.approx(12.0)}


@pytest.mark.parametrize("limits", [LIMITS, AHEAD])
def test_what_cannot_be_judged_is_infinitely_dear(limits: Limits) -> None:
    unknown = np.full(SAMPLES, 305.0)
    unknown[3] = math.nan
    assert cost(signals(T=unknown), limits=limits).total == math.inf
    assert cost(signals(F=unknown), limits=limits).total == math.inf
    assert pricing(limits).members(signals(2, T=np.stack([unknown, np.full(SAMPLES, 305.0)])), DT_S).tolist() == [
        math.inf,
        pytest.approx(0.0),
    ]


def test_members_count_by_their_weights_whatever_these_come_to() -> None:
    """One member in four loses 12 EUR: 3 EUR are expected."""
    hot = signals(2, T=np.array([[314.0], [305.0]]))
    assert pricing().members(hot, DT_S) == pytest.approx([12.0, 0.0])
    for weights in ((0.25, 0.75), (1.0, 3.0)):
        assert items(cost(hot, weights=weights)) == {"WARM": pytest.approx(3.0)}


def test_of_the_states_on_the_way_the_dearest_is_paid_for_all_the_time() -> None:
    assert items(cost(signals(), "running", "emptying", "still")) == {"emptying": pytest.approx(12.0 * QUARTER_H)}
    assert pricing().of_states((), 900.0) == {}


def test_a_release_costs_once() -> None:
    assert items(cost(signals(), releases=1)) == {RELEASE: 0.3}
    assert items(cost(signals(), releases=2)) == {RELEASE: 0.6}


def test_everything_adds_up() -> None:
    found = cost(signals(F=0.7 / 30.0, T=314.0), "running", releases=1)
    assert found.total == pytest.approx(9.0 + 12.0 + 1.0 + 0.3)
    assert found.share == pytest.approx(22.3 / 30.0)


@given(st.lists(st.floats(250.0, 400.0), min_size=1, max_size=4), st.floats(0.0, 0.1))
def test_nobody_gains_by_missing_what_is_soft(temperatures: list[float], feed: float) -> None:
    count = len(temperatures)
    made = pricing().members(signals(count, F=feed), DT_S)
    assert np.all(made >= 0.0)
    all_of_it = pricing().members(signals(count, F=feed, T=np.array(temperatures)[:, None]), DT_S)
    assert np.all(all_of_it >= made - 1e-9)


@pytest.mark.parametrize(("made", "lost"), [(30.0, 0.0), (21.0, 9.0), (0.0, 30.0), (33.0, 0.0), (-3.0, 33.0)])
def test_where_the_total_counts_what_is_not_delivered_is_lost_whatever_is_fed(made: float, lost: float) -> None:
    """30 L in 900 s by design; a leak takes what was fed, and what was there before, too."""
    counted = pricing(production=Production("F", 1.0 / 30.0, delivered=("product",)))
    so_far = made * np.arange(1, SAMPLES + 1) / SAMPLES
    assert counted.members(signals(F=1.0 / 30.0, **{MADE: so_far}), DT_S) == pytest.approx([lost], abs=1e-9)


def test_what_is_made_up_for_within_a_rollout_is_not_lost() -> None:
    counted = pricing(production=Production("F", 1.0 / 30.0, delivered=("product",)))
    late = np.where(np.arange(SAMPLES) < SAMPLES // 2, 0.0, np.linspace(-30.0, 30.0, SAMPLES))
    assert counted.members(signals(**{MADE: late}), DT_S) == pytest.approx([0.0], abs=1e-9)
    late[-1] = math.nan
    assert counted.members(signals(**{MADE: late}), DT_S) == [math.inf]
