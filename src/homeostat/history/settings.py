"""How much history is kept, and how soon it is safe."""

import math
import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final

from homeostat.history.store import HistoryError
from homeostat.stl.spelling import near_matches

SETTINGS: Final = "history.toml"
"""File with the settings, in the folder of a store; each may be left out."""


@dataclass(frozen=True, slots=True)
class HistorySettings:
    """Settings of a store; ValueError where one is outside its bounds."""

    raw_days: float = 90.0
    """How long samples are kept [d]."""
    raw_bytes: float = 50e9
    """Most that samples take on the disk [byte]; the oldest go first."""
    minutes_days: float = 3650.0
    """How long the roll-up is kept [d]."""
    sync_s: float = 1.0
    """Time after which what was appended is safe from a power cut [s]."""
    segment_s: float = 600.0
    """Time after which a piece of the log becomes a table [s]."""

    def __post_init__(self) -> None:
        for name, (low, high, unit) in BOUNDS.items():
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
                raise ValueError(f"{name} = {value!r} must be a number from {low:g} to {high:g} {unit}")


BOUNDS: Final = {
    "raw_days": (1 / 24, 36500.0, "d"),
    "raw_bytes": (1e5, math.inf, "byte"),
    "minutes_days": (1.0, 36500.0, "d"),
    "sync_s": (0.01, 60.0, "s"),
    "segment_s": (1.0, 3600.0, "s"),
}
"""Setting -> least and greatest value, and the unit."""


def read_settings(folder: Path) -> HistorySettings:
    """The settings of the store in ``folder``; HistoryError where its file cannot be read as such."""
    path = folder / SETTINGS
    try:
        given = tomllib.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        return HistorySettings()
    except (ValueError, RecursionError) as error:  # no TOML, no UTF-8, a number of thousands of digits
        raise HistoryError(f"{str(path)!r} is no TOML: {error}") from None
    known = [field.name for field in fields(HistorySettings)]
    for name in given:
        if name not in known:
            near = near_matches(name, known)
            raise HistoryError(f"{str(path)!r} has {name!r:.60}, which is no setting{near or '; ' + ', '.join(known)}")
    try:
        return HistorySettings(**given)
    except ValueError as error:
        raise HistoryError(f"{str(path)!r}: {error}") from None
