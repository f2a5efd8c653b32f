"""Quality with its sub-code: status codes of OPC UA (Part 8), whose two highest bits are the severity."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.snapshot import Quality

GOOD: Final = 0x00000000
"""Good, and nothing more to say."""
UNCERTAIN: Final = 0x40000000
"""To be used with care."""
BAD: Final = 0x80000000
"""Not to be used."""
CODES: Final = {Quality.GOOD: GOOD, Quality.UNCERTAIN: UNCERTAIN, Quality.BAD: BAD}
"""Quality -> the code without a sub-code."""
_NAMES: Final = {
    GOOD: "good",
    UNCERTAIN: "uncertain",
    BAD: "bad",
    0x00960000: "good, local override",
    0x40900000: "uncertain, last usable value",
    0x40930000: "uncertain, sensor not accurate",
    0x40940000: "uncertain, engineering units exceeded",
    0x80310000: "bad, no communication",
    0x80890000: "bad, configuration error",
    0x808A0000: "bad, not connected",
    0x808B0000: "bad, device failure",
    0x808C0000: "bad, sensor failure",
    0x808D0000: "bad, out of service",
}


def severity(codes: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The severity of each code, same shape: 0 good, 1 uncertain, 2 or 3 bad."""
    return codes >> np.uint32(30)


def quality_of(code: int) -> Quality:
    """The class of a code; what the standard reserves counts as bad."""
    return (Quality.GOOD, Quality.UNCERTAIN, Quality.BAD, Quality.BAD)[code >> 30]


def told(code: int) -> str:
    """A code as a person reads it; one without a name here keeps its number: ``bad, 0x80340000``."""
    return _NAMES.get(code) or f"{quality_of(code).value}, 0x{code:08X}"
