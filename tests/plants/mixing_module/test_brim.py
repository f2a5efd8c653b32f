"""A feed tank at its brim: no instrument tells one that is just full from one that overflows; that ends by pumping."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plants.mixing_module.module import NOMINAL, Run, batch, inputs, rows, run, start
from tests.plants.mixing_module.test_trip_limits import PLANT, readings

BRIM_M = NOMINAL["height_feed"]
PERIOD_S = 30
TANKS = ("B201", "B202", "B203")


def at_the_brim(tank: str, opening: float) -> Run:
    """Everything is commanded closed, and the inlet of a full ``tank`` stays open by ``opening``; ten plants."""
    stuck = {f"stuck_open_VI{tank[1:]}": (opening, 0.0)} if opening else {}
    return run(batch(60, members=10, x=start(**{tank: BRIM_M}), u=inputs(), faults=stuck, process=1.0, sensor=1.0))


@pytest.mark.parametrize("tank", TANKS)
@pytest.mark.parametrize("opening", [0.05, 0.2, 1.0])
def test_a_tank_that_overflows_and_one_that_is_just_full_read_the_same(tank: str, opening: float) -> None:
    full, over = at_the_brim(tank, 0.0), at_the_brim(tank, opening)
    assert full.of("overflowed").max() == 0.0 and over.of("overflowed")[-1] > 0.2
    shown, other = readings(full), readings(over)
    assert shown.keys() == other.keys() and all(np.array_equal(shown[tag], other[tag]) for tag in shown)


def test_no_inlet_has_an_instrument_of_its_own() -> None:
    signals = [(r["component"], r["relation"]) for r in rows("signals")]
    inlets = {"VI201", "VI202", "VI203"}
    assert {relation for component, relation in signals if component in inlets} == {"drives"}, "their commands only"


@pytest.mark.parametrize("tank", TANKS)
def test_a_strategy_under_which_a_feed_tank_may_rest_must_keep_it_below_the_brim(tank: str) -> None:
    limit = next(limit for limit in PLANT.limits.hard if limit.name == f"LIM-{tank}-HIGH")
    margins = limit.formula.margins(readings(at_the_brim(tank, 0.0)), 1.0)[:, :PERIOD_S]
    worst = -float(margins.mean(axis=1).max())
    allowed = [float(r["rest"]) for r in rows("fallback_limits") if r["limit"] == limit.name]
    assert len(allowed) == 2 and max(allowed) < worst, "at the brim nobody knows that nothing flows in"
