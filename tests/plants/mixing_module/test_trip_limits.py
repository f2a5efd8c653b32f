"""The Mixing Module's trip limits and qualities, on simulated readings."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plants.mixing_module.module import MODEL, TABLES, Run, batch, inputs, parameters, rows, run, start
from tests.plants.watching import Readings, described, mistaken, trips_after, worst_sum

PLANT = described(TABLES.parent)
VARIABLES = {r["tag"]: r["variable"] for r in rows("signals")}


def readings(found: Run) -> Readings:
    """What the instruments say."""
    return {tag: found.record[:, :, MODEL.shown[v]] for tag, v in VARIABLES.items() if v in MODEL.shown}


def transfer(**commands: float) -> Run:
    """All feed tanks full and emptied at once by P101, on ten plants."""
    full = start(B201=0.2, B202=0.2, B203=0.2, B204=0.12)
    u = inputs(**{"VO1": 1.0, "VO2": 1.0, "VO3": 1.0, "VI4": 1.0, "P1": 1.0} | commands)
    return run(batch(150, members=10, x=full, u=u, process=1.0, sensor=1.0))


def test_a_plant_at_rest_shows_no_frozen_reading() -> None:
    assert mistaken(PLANT.qualities, readings(run(batch(120, members=10, sensor=1.0)))) == []


@pytest.mark.parametrize("commands", [{}, {"VO4": 1.0}, {"P1": 0.0, "P2": 1.0}])
def test_no_transfer_is_taken_for_a_wrong_reading(commands: dict[str, float]) -> None:
    assert mistaken(PLANT.qualities, readings(transfer(**commands))) == []


@pytest.mark.parametrize("tank", ["B201", "B202", "B203"])
def test_noise_below_the_limit_of_a_feed_tank_does_not_trip(tank: str) -> None:
    near = run(batch(600, members=50, x=start(**{tank: 0.213}), sensor=1.0))
    rule = PLANT.trips[f"LIM-{tank}-HIGH"]
    limit = next(limit for limit in PLANT.limits.hard if limit.name == rule.limit)
    assert worst_sum(-limit.formula.margins(readings(near), 1.0)).max() <= rule.cusum


@pytest.mark.parametrize(("opening", "longest_s"), [(1.0, 2), (0.2, 4), (0.05, 8)])
def test_an_inlet_that_does_not_close_trips_soon_after_the_limit(opening: float, longest_s: float) -> None:
    filling = run(batch(120, members=10, x=start(B201=0.205, VI1=opening), u=inputs(VI1=opening), sensor=1.0))
    shown = readings(filling)
    limit = next(limit for limit in PLANT.limits.hard if limit.name == "LIM-B201-HIGH")
    true = filling.of("V1") / parameters()[MODEL.parameters.index("area")]
    crossed = int(np.argmax(true > 0.216))
    after = trips_after(-limit.formula.margins(shown, 1.0), PLANT.trips[limit.name].cusum)
    assert (after - crossed <= longest_s).all()


def test_a_pump_that_idles_too_long_trips_at_once() -> None:
    assert PLANT.trips["LIM-P101-IDLE"].cusum == 0.0
