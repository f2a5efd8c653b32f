"""Array types of the engine."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Vec: TypeAlias = NDArray[np.float64]
"""One member's values, shape (n,)."""
Table: TypeAlias = NDArray[np.float64]
"""Members' values, shape (members, n)."""
Cube: TypeAlias = NDArray[np.float64]
"""Values over time, shape (members, times, n)."""
Indices: TypeAlias = NDArray[np.int64]
"""Positions or seeds, shape (n,)."""
IndexTable: TypeAlias = NDArray[np.int64]
"""Positions, shape (rows, n)."""
Flags: TypeAlias = NDArray[np.bool_]
"""Yes or no, shape (n,)."""
