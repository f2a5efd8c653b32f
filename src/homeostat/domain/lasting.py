"""A length of time as a person says it."""

from typing import Final

_UNITS: Final = (("d", 86_400.0), ("h", 3_600.0), ("min", 60.0))


def lasting(seconds: float) -> str:
    """In seconds, minutes, hours or days, by its size: from two of a unit on in that unit."""
    for unit, size in _UNITS:
        if 2.0 * size <= abs(seconds) < float("inf"):
            return f"{f'{seconds / size:.1f}'.removesuffix('.0')} {unit}"
    return f"{seconds:.4g} s"
