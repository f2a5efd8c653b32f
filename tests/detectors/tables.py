"""Tables that tests write."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.contracts.detector import course

NAMES = ("flow [l/s]", "level", "temperature", "speed")


def written(path: Path, rows: int = 600, *, seed: int = 1, shifted: slice | None = None, separator: str = ",") -> Path:
    """A CSV file with a time a second and four signals around 20, the first of them shifted by 8 deviations."""
    values = 20.0 + course(rows, seed=seed)
    if shifted is not None:
        values[shifted, 0] += 8.0
    begin = np.datetime64("2026-11-25T13:00:00")
    lines = [separator.join(("time", *NAMES))]
    lines += [separator.join((str(begin + k), *(f"{v:.6f}" for v in row))) for k, row in enumerate(values)]
    path.write_text("\n".join(lines) + "\n")
    return path
