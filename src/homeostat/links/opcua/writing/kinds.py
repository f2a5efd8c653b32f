"""Types of nodes: what each holds, and a value as a node of that type takes it; a server converts nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from homeostat.links.errors import LinkError

FRACTIONS: Final = frozenset(("Double", "Float"))
"""Types with fractions."""
WHOLE: Final[Mapping[str, tuple[int, int]]] = {
    "SByte": (-(2**7), 2**7 - 1),
    "Byte": (0, 2**8 - 1),
    "Int16": (-(2**15), 2**15 - 1),
    "UInt16": (0, 2**16 - 1),
    "Int32": (-(2**31), 2**31 - 1),
    "UInt32": (0, 2**32 - 1),
    "Int64": (-(2**63), 2**63 - 1),
    "UInt64": (0, 2**64 - 1),
    "Boolean": (0, 1),
}
"""Types without fractions, and what they can hold."""
NUMBERS: Final = FRACTIONS | WHOLE.keys()
"""Types that show a number."""
TEXTS: Final = frozenset(("String", "LocalizedText"))
"""Types that show words."""
COUNT: Final = 2**31 - 1
"""Largest number that we count or draw where a node can hold it."""
_EXACT: Final[Mapping[str, int]] = {"Float": 2**24, "Double": COUNT}


def largest(kind: str) -> int:
    """Up to what a node of type ``kind`` can count with us; 0 where it cannot."""
    return _EXACT.get(kind) or min(WHOLE.get(kind, (0, 0))[1], COUNT)


def fits(kind: str, *numbers: int) -> bool:
    """Whether a node of type ``kind``, one without fractions, can hold all of ``numbers``."""
    low, high = WHOLE[kind]
    return all(low <= number <= high for number in numbers)


def cast(value: float | int | bool | str, kind: str, what: str) -> float | int | bool | str:
    """``value`` as type ``kind`` holds it; LinkError that begins with ``what`` where that would be another value."""
    if isinstance(value, str) or kind in TEXTS:
        if isinstance(value, str) and kind in TEXTS:
            return value
        raise LinkError(f"{what} would be {value!r:.60}, and its node holds {kind}")
    if kind in FRACTIONS:
        return float(value)
    if kind not in WHOLE:
        raise LinkError(f"{what} would be {value!r:.60}, and its node holds {kind or 'nothing'}")
    low, high = WHOLE[kind]
    whole = round(value) if math.isfinite(value) else high + 1
    if not low <= whole <= high or abs(value - whole) > 1e-6:
        raise LinkError(f"{what} would be {value:g} in its node, which holds whole numbers from {low} to {high}")
    return bool(whole) if kind == "Boolean" else whole
