"""The recordings, which are not part of the project: SKAB (GPL-3) as CSV, Tennessee Eastman as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from homeostat.detectors.detector import Values
from homeostat.detectors.tables.reading import read_table
from homeostat.detectors.tables.table import SignalTable

DATA = Path(__file__).parents[3] / "shared" / "data"
"""Where they are, beside the project."""
HEALTHY = 400
"""First rows of a file of SKAB that its rules let a detector learn from."""
LABELS = ("anomaly", "changepoint")
"""Columns that no detector sees."""
ONSET = 160
"""First row of a Tennessee Eastman test recording with the fault, which began at the row before."""
STEP_MIN = 3.0
"""Time from row to row there [min]."""


@dataclass(frozen=True)
class Experiment:
    """One file of SKAB."""

    name: str
    table: SignalTable
    anomalous: np.ndarray
    """Which rows are labelled, shape (rows,)."""


def skab(folder: Path) -> tuple[list[Experiment], SignalTable]:
    """The experiments in ``folder`` by name, and the anomaly-free recording."""
    found = []
    for path in sorted(folder.glob("*/*.csv")):
        if path.parent.name != "anomaly-free":
            labels = read_table(path).of(["anomaly"]).values[:, 0] > 0.0
            found.append(Experiment(f"{path.parent.name}/{path.stem}", read_table(path, ignored=LABELS), labels))
    return found, read_table(folder / "anomaly-free" / "anomaly-free.csv")


def faults(folder: Path) -> list[int]:
    """Numbers of the disturbances that are recorded in ``folder``."""
    return [int(path.stem[1:]) for path in sorted(folder.glob("d*.npz")) if path.stem != "d00"]


def recording(folder: Path, number: int) -> tuple[Values, Values]:
    """Training and test rows of disturbance ``number``, 0 for none, shape (rows, 52)."""
    with np.load(folder / f"d{number:02d}.npz") as arrays:
        return arrays["train"].astype(np.float64), arrays["test"].astype(np.float64)
