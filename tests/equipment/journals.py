"""Journals compared and trajectories read back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from homeostat.journal import Record
from homeostat.journal.beside.artifacts import MEMBER, TIME, UNIT
from homeostat.journal.encode import Json


def timeless(record: Record) -> Record:
    """``record`` without what depends on the wall clock; equal for two runs of the same seed."""
    return replace(record, fields={k: _without_wall(v) for k, v in record.fields.items() if not k.startswith("wall_")})


def _without_wall(value: Json) -> Json:
    if isinstance(value, dict):
        return {key: _without_wall(item) for key, item in value.items() if not key.startswith("wall_")}
    if isinstance(value, list):
        return [_without_wall(item) for item in value]
    return value


@dataclass(frozen=True, slots=True)
class StoredTrajectory:
    """A trajectory, or an ensemble of them, as it is read back."""

    times_s: NDArray[np.float64]
    """Process times [s], shape (n,)."""
    columns: Mapping[str, NDArray[np.float64]]
    """Values by tag, each of shape (n,) or (members, n)."""
    units: Mapping[str, str]
    """Unit by tag."""


def read_parquet(path: Path) -> StoredTrajectory:
    """Read what `homeostat.journal.beside.artifacts.write_parquet` wrote."""
    table = pq.read_table(path)
    times = table.column(TIME).to_numpy()
    names = [name for name in table.column_names if name not in (TIME, MEMBER)]
    columns = {name: table.column(name).to_numpy() for name in names}
    if MEMBER in table.column_names:
        members = int(table.column(MEMBER).to_numpy().max(initial=-1)) + 1
        times = times[: len(times) // max(members, 1)]
        columns = {name: values.reshape(members, len(times)) for name, values in columns.items()}
    units = {name: (table.schema.field(name).metadata or {})[UNIT].decode() for name in names}
    return StoredTrajectory(times, MappingProxyType(columns), MappingProxyType(units))
