"""Scatter: noise makes every difference larger; what sticks and slips, jumps or is an outlier does not."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.process.types import Flags, Table
from homeostat.twin.isolation.scatter import against_usual

TICKS, SD = 400, 0.01
HEALTHY: Flags = np.arange(TICKS - 2) < 300
PRESENT: Flags = np.arange(TICKS - 2) >= 338


def differences(values: Table) -> Table:
    return np.asarray(np.diff(np.atleast_2d(values), 2))


def ratio(added: Table, factor: float = 1.0) -> float:
    """Scatter where ``added`` stands in the last 60 readings, whose noise is ``factor`` times as large."""
    random = np.random.default_rng(7)
    read = SD * random.standard_normal(TICKS)
    read[340:] = factor * read[340:] + added[340:]
    modelled = np.vstack([np.zeros(TICKS), SD * random.standard_normal((7, TICKS))])
    return against_usual(differences(read), differences(modelled), HEALTHY, PRESENT)


@pytest.mark.parametrize("factor", [1.0, 3.0, 5.0])
def test_noise_is_measured_as_it_is(factor: float) -> None:
    assert ratio(np.zeros(TICKS), factor) == pytest.approx(factor, rel=0.25)


@pytest.mark.parametrize("every", [7, 10, 15])
def test_what_sticks_and_slips_is_not_noisy(every: int) -> None:
    """It is eight times its noise away from where it was every few ticks, and rests between."""
    slips = 8.0 * SD * ((np.arange(TICKS) // every) % 2)
    assert ratio(slips) < 1.6


def test_a_coarse_instrument_is_judged_by_what_it_shows() -> None:
    """Four steps of it are as large as its noise: most readings are as the one before."""
    random = np.random.default_rng(3)
    read = SD * random.standard_normal(TICKS)
    read[340:] *= 5.0
    modelled = np.vstack([np.zeros(TICKS), SD * random.standard_normal((7, TICKS))])
    coarse = np.round(read / (4.0 * SD)) * 4.0 * SD
    assert against_usual(differences(coarse), differences(modelled), HEALTHY, PRESENT) > 2.5


def test_neither_levels_nor_ramps_nor_outliers_are_seen() -> None:
    ramp = 0.05 * np.arange(TICKS)
    outliers = np.where(np.arange(TICKS) % 20 == 0, 1.0, 0.0)
    assert ratio(ramp) < 1.3 and ratio(np.full(TICKS, 3.0)) < 1.3 and ratio(outliers) < 1.6
