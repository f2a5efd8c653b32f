"""How far the twin is from the plant, by tag, from a history: what an instrument reads too high, and what drifts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from homeostat.evaluate.operation import declared
from homeostat.evaluate.simulation import run
from homeostat.history.samples import ALWAYS
from homeostat.plants.plant import Plant, load_plant
from homeostat.service.report.facts import Facts
from homeostat.service.report.page import page
from homeostat.service.report.residuals import Followed, residuals
from tests.equipment.kept_run import kept

pytestmark = pytest.mark.slow

Readings = dict[str, NDArray[np.float64]]
LENGTH = 2400


@pytest.fixture(scope="module")
def cstr() -> Plant:
    return load_plant("cstr")


@pytest.fixture(scope="module")
def quiet(cstr: Plant) -> Readings:
    """Tag -> readings of a plant without a fault, whose parameters are another plant's."""
    done = run(cstr, seed=3, end_s=1000.0 + LENGTH, thinking=declared(1.0))
    return {tag: values[0][-LENGTH:] for tag, values in done.measured.signals.items()}


def followed(cstr: Plant, folder: Path, readings: Readings, without: range = range(0)) -> Followed:
    return residuals(cstr, kept(folder, readings, 1000.0, without), ALWAYS)


def test_a_reading_that_drifts_is_first_on_the_list_and_others_are_not(
    cstr: Plant,
    quiet: Readings,
    tmp_path: Path,
) -> None:
    well = followed(cstr, tmp_path / "well", quiet)
    assert well.stretches == LENGTH // 600 and well.left_out == 0
    drifting = quiet | {"L1": quiet["L1"] + np.linspace(0.0, 2.0, LENGTH)}
    found = followed(cstr, tmp_path / "drifting", drifting)
    assert found.residuals[0].tag == "L1"
    assert found.residuals[0].within > 2.0 * next(r.within for r in well.residuals if r.tag == "L1")
    text = page(Facts(plant="cstr"), found)
    assert "Twin against plant" in text and "4 stretches" in text and "There is no history" not in text


def test_what_was_not_recorded_is_left_out_and_a_gap_ends_a_stretch(
    cstr: Plant,
    quiet: Readings,
    tmp_path: Path,
) -> None:
    found = followed(cstr, tmp_path / "gap", quiet, range(650, 1250))
    assert found.left_out == 1 and found.stretches == 3, "50 s before the gap say nothing"
