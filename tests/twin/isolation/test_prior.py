"""Prior: what a jump of its own reading says of a size is looked up where it began, on a plant of any tick."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.domain.diagnosis import EffectKind, FaultState
from homeostat.twin.history import Window
from homeostat.twin.isolation.prior import Prior
from tests.twin.followed import reactor

ROWS, ROW = 100, 50


def gain(tick_s: float, onset_row: float) -> float:
    """What a generated mode gains by a name, where the reading of its parameter jumps at ``ROW``."""
    plant = reactor().description
    mode = next(m for m in plant.generated if m.effect is not None and m.effect.kind is EffectKind.PARAMETER)
    assert mode.effect is not None
    noise = np.random.default_rng(1).normal(0.0, 0.01, ROWS)
    readings = noise + np.where(np.arange(ROWS) > ROW, mode.severity_nominal, 0.0)
    window = Window(7.0 * tick_s, {"its own": readings}, np.zeros((ROWS, 1)), tick_s=tick_s)
    prior = Prior(plant.faults, window, (), {mode.effect.quantity: "its own"})
    return prior.of_name(plant.faults[0], mode, FaultState(mode.name, mode.severity_nominal, window.at_s(onset_row)))


@pytest.mark.parametrize("tick_s", [0.1, 60.0])
@pytest.mark.parametrize("row", [-30, 0, 10, ROW, ROWS - 1])
def test_a_name_gains_the_same_on_a_plant_of_any_tick(tick_s: float, row: int) -> None:
    assert np.isfinite(gain(tick_s, row))
    assert gain(tick_s, row) == pytest.approx(gain(1.0, row))
