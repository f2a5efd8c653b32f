"""Equipment against values worked out by hand, as their docstrings state them."""

from __future__ import annotations

import math

import pytest

from homeostat.process.blocks import (
    Term,
    arrhenius,
    centrifugal_flow,
    counter_current,
    equal_percentage_valve,
    exchanged,
    heater,
    linear_valve,
    overflow,
    pump_flow,
    valve_flow,
)
from homeostat.process.blocks.term import Leaf, evaluate

U = Term(Leaf.HELD, value="u")


def at(of: Term, u: float) -> float:
    """``of`` where the leaf is ``u``."""
    return float(evaluate(of, {U: u}))


@pytest.mark.parametrize(
    ("of", "u", "by_hand"),
    [
        (linear_valve(0.2, U), 0.25, 0.05),
        (equal_percentage_valve(1.0, U), 0.5, 1.0 / math.sqrt(50.0)),
        (equal_percentage_valve(1.0, U), 0.005, 0.0),
        (valve_flow(0.05, U, 4.0), 1.0, 0.1),
        (valve_flow(0.05, 1.0, U), -1.0, 0.0),
        (pump_flow(0.3, U), 0.5, 0.15),
        (centrifugal_flow((20.0, 5.0), U, 0.0), 1.0, 2.0),
        (centrifugal_flow((20.0, 5.0), U, 15.0), 1.0, 1.0),
        (centrifugal_flow((20.0, 5.0), U, 15.0), 0.5, 0.0),
        (overflow(U, 10.0, 0.5), 12.0, 1.0),
        (overflow(U, 10.0, 0.5), 9.0, 0.0),
        (heater(60.0, U), 0.5, 30.0),
        (exchanged(500.0, U, 290.0), 310.0, 10_000.0),
        (arrhenius(0.1, 8000.0, U), 300.0, 0.1 * math.exp(-8000.0 / (8.314462618 * 300.0))),
    ],
)
def test_a_value_worked_out_by_hand(of: Term, u: float, by_hand: float) -> None:
    assert at(of, u) == pytest.approx(by_hand, rel=1e-9)


def test_a_counter_current_exchanger_by_hand() -> None:
    """UA = C_min = 100 W/K, C_max = 200 W/K: e = exp(-0.5), eps = (1 - e) / (1 - 0.5 e) = 0.5648."""
    heat = at(counter_current(100.0, (100.0, U), (200.0, 300.0)), 400.0)
    e = math.exp(-0.5)
    assert heat == pytest.approx((1.0 - e) / (1.0 - 0.5 * e) * 100.0 * 100.0, rel=1e-9)


def test_an_exchanger_with_equal_sides_and_one_that_stands() -> None:
    """Equal capacity flows: eps = N / (1 + N) = 0.5; a side that stands exchanges nothing."""
    assert at(counter_current(100.0, (100.0, U), (100.0, 300.0)), 400.0) == pytest.approx(5000.0, rel=2e-3)
    assert at(counter_current(100.0, (0.0, U), (100.0, 300.0)), 400.0) == pytest.approx(0.0, abs=1e-6)
