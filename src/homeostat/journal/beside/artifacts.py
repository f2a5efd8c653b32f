"""The larger pieces of a run beside its journal: trajectories as Parquet, texts under the name of their content."""

import hashlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from homeostat.journal.beside.files import StoredFile, describe, write_whole

TIME = "t_s"
"""Column of the process time [s]."""
MEMBER = "member"
"""Column of the ensemble member, from 0; absent for a single trajectory."""
UNIT = b"unit"
"""Key of the field metadata that holds a column's unit."""


def write_parquet(
    path: Path, times_s: NDArray[np.float64], columns: Mapping[str, NDArray[np.float64]], units: Mapping[str, str]
) -> StoredFile:
    """Write trajectories; the same content gives the same bytes.

    ``times_s`` has shape (n,) [s]; every column has shape (n,), or every one (members, n) with neither 0, which is
    stored as one row per member and time. ``units`` names each column's unit. Raises ValueError for shapes or units
    that do not fit.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    shape = _shape(times_s, columns, units)
    fields: list[pa.Field[Any]] = [pa.field(TIME, pa.float64(), nullable=False, metadata={UNIT: b"s"})]
    members = shape[0] if len(shape) == 2 else 1
    arrays = [pa.array(np.tile(np.asarray(times_s, dtype=np.float64), members))]
    if len(shape) == 2:
        fields.append(pa.field(MEMBER, pa.int32(), nullable=False, metadata={UNIT: b"1"}))
        arrays.append(pa.array(np.repeat(np.arange(members, dtype=np.int32), shape[1])))
    for name, values in columns.items():
        fields.append(pa.field(name, pa.float64(), nullable=False, metadata={UNIT: units[name].encode()}))
        arrays.append(pa.array(np.asarray(values, dtype=np.float64).reshape(-1)))
    content = BytesIO()
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), content, compression="zstd")
    write_whole(path, content.getvalue())
    return describe(path, path.parent)


def write_text(folder: Path, text: str, suffix: str) -> StoredFile:
    """Keep a query, a subgraph or a prompt as ``<sha256><suffix>`` in ``folder``; the same text is kept once."""
    content = text.encode()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{hashlib.sha256(content).hexdigest()}{suffix}"
    write_whole(path, content)
    return describe(path, folder)


def _shape(
    times_s: NDArray[np.float64], columns: Mapping[str, NDArray[np.float64]], units: Mapping[str, str]
) -> tuple[int, ...]:
    if np.ndim(times_s) != 1:
        raise ValueError(f"times have shape {np.shape(times_s)}; they must have shape (n,)")
    shapes = {name: np.shape(values) for name, values in columns.items()}
    first = next(iter(shapes.values()), np.shape(times_s))
    if len(first) not in (1, 2) or first[-1] != len(times_s) or (len(first) == 2 and 0 in first):
        raise ValueError(f"columns have shape {first}; with {len(times_s)} times they need (n,) or (members, n)")
    for name, shape in shapes.items():
        if name in (TIME, MEMBER):
            raise ValueError(f"column {name!r} has the name of the time or member column; rename it")
        if shape != first:
            raise ValueError(f"column {name!r} has shape {shape}, the others {first}; give all the same shape")
        if name not in units:
            raise ValueError(f"column {name!r} has no unit; name one, '1' for a fraction")
    return first
