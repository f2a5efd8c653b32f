"""The engine against noise-free trajectories of the published reactor model.

They are not part of this project. Without them ``test_published_figures`` holds the engine to peaks, durations and end
values of the same ten cases, and ``test_cstr_own`` to whole trajectories of an integrator of its own.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.plants.cstr.reactor import FAULTS, PUBLISHED, SEVERITY, batch, parameters, run

FILE = Path(__file__).parents[3] / "shared" / "data" / "reference" / "cstr_reference_noisefree.json"
COLUMNS = ("V", "CA", "CB", "CC", "CD", "T", "F1_true", "F2_true", "V1_pos", "P1_pos", "V2_pos", "UA")
REACHED = {"V": 6e-8, "T": 1.1e-7}
"""What is reached; the file has seven decimals, so 5e-8 is its own rounding."""
REQUIRED = {"V": 1e-6, "T": 1e-3}
ONSET_S = 2000.0
EXCEPTION = ("inlet_stuck_open", "V", 8000)
"""The published pump draws the vessel to -0.5 mL at 7505 s; ours delivers what is there, and keeps that difference."""

pytestmark = pytest.mark.reference(
    "the published noise-free trajectories (test_published_figures.py has figures of them)", FILE
)


def differences(plant: str) -> tuple[np.ndarray, np.ndarray]:
    """|engine - published|, shape (times, columns), and the times."""
    table = {int(t): row for t, row in json.loads(FILE.read_text(encoding="utf-8"))[plant]["table"].items()}
    times = np.array(list(table))
    faults = {} if plant == "normal" else {plant: (SEVERITY[plant], ONSET_S)}
    engine = run(batch(8000, p=parameters(**PUBLISHED), faults=faults))
    ours = np.stack([engine.of(name)[times - 1] for name in COLUMNS], axis=1)
    return np.abs(ours - np.array(list(table.values()))), times


@pytest.mark.parametrize("plant", ["normal", *FAULTS])
def test_every_variable_at_every_time(plant: str) -> None:
    off, times = differences(plant)
    assert len(times) >= 20 and times[-1] == 8000
    for column, name in enumerate(COLUMNS):
        required = REQUIRED.get(name, 1e-5)
        bad = [(plant, name, int(t)) for t in times[off[:, column] > required]]
        assert bad == ([EXCEPTION] if (plant, name) == EXCEPTION[:2] else [])
        rest = off[:, column][off[:, column] <= required]
        assert rest.max() <= REACHED.get(name, 1.5e-7), (name, rest.max())


def test_the_one_exception_is_the_volume_that_the_published_pump_invents() -> None:
    off, times = differences(EXCEPTION[0])
    assert times[-1] == EXCEPTION[2]
    assert off[-1, COLUMNS.index("V")] == pytest.approx(1.8e-4, abs=1e-5)


def test_the_reference_is_that_of_ten_cases() -> None:
    names = {name for name in json.loads(FILE.read_text(encoding="utf-8")) if not name.startswith("_")}
    assert names == {"normal", *FAULTS}
