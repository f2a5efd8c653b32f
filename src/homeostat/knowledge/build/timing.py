"""A plant's own time: its tick as the settings state it, and how fast it is by the reset times of its loops."""

import math
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from homeostat.domain.plant.timing import TICK_S, Timing
from homeostat.knowledge.build.tables.reading import FOLDER, read_rows
from homeostat.knowledge.store.error import GraphError

_SETTINGS: Final = "case.toml"
_GAINS: Final = (("gain", "Kp"), ("reset", "Ki"))
"""Columns of a loop's gains, and what their symbols begin with where they are not stated."""


def timing_of(folder: Path) -> Timing:
    """The timing of the plant in ``folder``; what cannot be read is as where nothing is stated.

    A loop whose gains are K and K/T has the reset time T, which an engineer chooses by how slow its process is.
    """
    try:
        table = tomllib.loads((folder / _SETTINGS).read_text("utf-8")).get("time")
    except (OSError, ValueError, RecursionError):  # whoever needs the settings says what is wrong with them
        table = None
    stated = table if isinstance(table, dict) else {}
    tick_s = _positive(stated.get("tick_s")) or TICK_S
    return Timing.of(tick_s, tuple(_resets_s(folder)), _positive(stated.get("response_s")))


def _resets_s(folder: Path) -> Iterator[float]:
    """Reset time of every loop whose gains are stated, and have one sign [s]."""
    try:
        loops, parameters = (read_rows(folder / FOLDER / f"{n}.csv", True).rows for n in ("loops", "parameters"))
    except GraphError:  # whoever needs the tables says what is wrong with them
        return
    values = {row.get("symbol", ""): _number(row.get("value", "")) for row in parameters}
    for row in loops:
        gain, reset = (values.get(row.get(column) or f"{kind}_{row.get('id')}") for column, kind in _GAINS)
        if gain is not None and reset is not None and gain * reset > 0.0:
            yield gain / reset


def _positive(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if 0.0 < value <= sys.float_info.max else None  # an integer may be beyond any float


def _number(cell: str) -> float | None:
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
