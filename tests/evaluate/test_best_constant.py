"""The best constant setpoints: the cheapest that keep every hard limit, found by trying them on the true plant."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import pytest

from homeostat.evaluate.reference.best_constant import BestConstant, best_constant
from homeostat.evaluate.scenario import scenario
from tests.twin.followed import reactor

STUCK = scenario(reactor(), "cool_stuck_closed", 1, 1450.0, None, 2400.0)
"""Without action it is too hot within minutes, and stays so."""
QUIET = scenario(reactor(), "none", 1, None, None, 2400.0)
RELEASED_S = 1455.0
DESIGN, LESS, LEAST = 0.0333, 0.018, 0.012
"""Feed [L/s]; with the first one the limit is not kept, and the last one makes a third less than the second."""


@functools.cache
def found(*feed: float | None, quiet: bool = False) -> BestConstant:
    return best_constant(reactor(), QUIET if quiet else STUCK, RELEASED_S, {"F1.sp": feed})


def test_what_does_not_keep_a_hard_limit_costs_more_than_anything() -> None:
    none = found(DESIGN)
    assert (none.setpoints, none.admissible, none.points) == (None, 0, 1) and math.isnan(none.cost)


def test_the_cheapest_of_what_is_admissible_is_chosen() -> None:
    less, least, best = found(LESS), found(LEAST), found(LEAST, LESS, DESIGN)
    assert 0.0 < less.cost < least.cost
    assert (best.setpoints, best.admissible, best.points) == ({"F1.sp": LESS}, 2, 3)
    assert best.cost == pytest.approx(less.cost)


def test_product_that_is_not_made_costs_and_what_else_is_missed_comes_on_top() -> None:
    """945 s at 0.0333 L/s and 1 EUR/L are 31.5 EUR; with 0.018 L/s 14.5 of them are lost."""
    seconds = STUCK.end_s - RELEASED_S
    free = replace(reactor().prices, outside=dict.fromkeys(reactor().prices.outside, 0.0))
    for feed in (LESS, LEAST):
        product = best_constant(replace(reactor(), prices=free), STUCK, RELEASED_S, {"F1.sp": (feed,)}).cost
        assert product == pytest.approx((reactor().production.design_rate - feed) * seconds, rel=0.02)
        assert found(feed).cost > product


def test_automatic_is_a_point_like_any_other() -> None:
    idle = best_constant(reactor(), QUIET, RELEASED_S, {"V2.man": (None, 0.0)})
    assert idle.setpoints is not None and idle.setpoints["V2.man"] is None
    alone = best_constant(reactor(), QUIET, RELEASED_S, {"V2.man": (None,)})
    assert alone.cost == pytest.approx(idle.cost) and abs(alone.cost) < 1.0, "a healthy plant gives nothing away"
