"""Whether tables belong together: the same signals, in the same units, at the same pace."""

import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from homeostat.detectors.detector import Values
from homeostat.detectors.error import DetectionError
from homeostat.detectors.tables.table import SignalTable

OTHER_PACE: Final = 1.5
"""How many times slower or faster a table may be sampled than the others [1]."""
ANOTHER_RANGE: Final = 10.0
"""How many ranges of its fault-free values a signal must be away in every row to be in another unit [1]."""
_UNIT: Final = re.compile(r"\s*[\[(][^\])]*[\])]\s*$")


def agreed(tables: Sequence[SignalTable]) -> tuple[SignalTable, ...]:
    """``tables`` with the columns of the first, in its order; the others may have more.

    Raises DetectionError where another lacks one, or is sampled at another pace.
    """
    first = tables[0]
    for other in tables[1:]:
        lacking = [name for name in first.signals if name not in other.signals]
        if lacking:
            raise DetectionError(_lacks(first, other, lacking))
        pace = other.step / first.step
        if first.timed and other.timed and not 1.0 / OTHER_PACE <= pace <= OTHER_PACE:
            text = f"{other.name} has a row every {other.step:g} s, {first.name} every {first.step:g} s"
            raise DetectionError(f"{text}; bring both to the same pace")
    return tuple(table.of(first.signals) for table in tables)


def _lacks(first: SignalTable, other: SignalTable, lacking: Sequence[str]) -> str:
    name = lacking[0]
    alike = [n for n in other.signals if _UNIT.sub("", n) == _UNIT.sub("", name)]
    more = f" and {len(lacking) - 1} more of {first.name}" if len(lacking) > 1 else f" of {first.name}"
    if alike:
        text = f"{other.name} has {alike[0]!r} where {first.name} has {name!r}"
        return f"{text}: the same signal in another unit; convert it"
    return f"{other.name} lacks the column {name!r}{more}; add it, or leave it out with --ignore {name!r}"


def refuse_other_units(table: SignalTable, runs: Sequence[Values]) -> None:
    """DetectionError where a signal of ``table`` is far from all fault-free values of ``runs`` in every row.

    Such a signal is in another unit, or of another instrument: no fault is there from the first row to the last.
    """
    least = np.min([run.min(axis=0) for run in runs], axis=0)
    most = np.max([run.max(axis=0) for run in runs], axis=0)
    away = ANOTHER_RANGE * (most - least)
    low, high = table.values.min(axis=0), table.values.max(axis=0)
    outside = (most > least) & ((low > most + away) | (high < least - away))
    if outside.any():
        k = int(outside.argmax())
        text = f"{table.name}: {table.signals[k]!r} is between {low[k]:g} and {high[k]:g}"
        usual = f"the fault-free rows have it between {least[k]:g} and {most[k]:g}"
        raise DetectionError(
            f"{text}, {usual}: another unit? Convert it, or leave it out with --ignore {table.signals[k]!r}"
        )
