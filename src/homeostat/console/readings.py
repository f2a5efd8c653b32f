"""What the instruments of a run said over time, read from its trajectory; true values are nobody's here."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.snapshot import Snapshot
from homeostat.journal.beside.artifacts import TIME
from homeostat.record.directory import TRAJECTORY

Values = NDArray[np.float64]
_MEASURED: Final = "measured "
"""Begin of the columns that instruments have filled."""
_ROOM: Final = 4096
"""Moments for which there is room at first."""
MOST: Final = 200_000
"""Most moments that are kept of a run that goes on: more than two days of one a second."""
MOST_VALUES: Final = 32_000_000
"""Most values of all tags together, 256 MB: of 2,000 tags more than four hours of one moment a second."""
_FEWEST: Final = 20
"""Samples below which nothing is called usual."""


class ReadingsError(ValueError):
    """A trajectory cannot be read; the message says which and why."""


@dataclass(frozen=True, slots=True)
class Readings:
    """Readings of every tag at common times."""

    times_s: Values
    """Process times, rising, shape (n,) [s]."""
    signals: Mapping[str, Values]
    """Tag -> readings in its unit, NaN where there is none, each of shape (n,)."""

    @classmethod
    def of(cls, run_dir: Path) -> Self | None:
        """The readings kept in ``run_dir``; None where there are none, because the run goes on or was killed.

        Raises ReadingsError where the file is no trajectory.
        """
        path = run_dir / TRAJECTORY
        if not path.is_file():
            return None
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            table = pq.read_table(path)
            names = [name for name in table.schema.names if name.startswith(_MEASURED)]
            times = np.asarray(table[TIME], dtype=np.float64)
            signals = {n.removeprefix(_MEASURED): np.asarray(table[n], dtype=np.float64) for n in names}
        except (pa.ArrowException, KeyError, OSError, ValueError) as error:
            raise ReadingsError(f"{str(path)!r} is no trajectory: {' '.join(str(error).split())}") from error
        return cls(times, signals) if times.size else None

    @property
    def last_s(self) -> float:
        """Time of the last sample [s]."""
        return float(self.times_s[-1])

    @property
    def dt_s(self) -> float:
        """Sampling period [s]; 1 where there is a single sample."""
        return float(self.times_s[1] - self.times_s[0]) if self.times_s.size > 1 else 1.0

    def at(self, at_s: float) -> tuple[float, dict[str, float]]:
        """Time of the last sample up to ``at_s`` [s], and tag -> reading there; nothing before the first."""
        index = self.until(at_s) - 1
        if index < 0:
            return at_s, {}
        return float(self.times_s[index]), {tag: float(values[index]) for tag, values in self.signals.items()}

    def until(self, at_s: float) -> int:
        """Number of samples that are not after ``at_s`` [s]."""
        return int(np.searchsorted(self.times_s, at_s, side="right"))

    def between(self, from_s: float, to_s: float) -> slice:
        """Samples from ``from_s`` to ``to_s`` [s], both included."""
        return slice(int(np.searchsorted(self.times_s, from_s, side="left")), self.until(to_s))

    def usual(self, tag: str, span: slice) -> tuple[float, float] | None:
        """Between what 98 % of the readings of ``tag`` in ``span`` lie; None where there are too few."""
        values = self.signals[tag][span]
        values = values[np.isfinite(values)]
        if values.size < _FEWEST:
            return None
        low, high = np.percentile(values, (1.0, 99.0))
        return float(low), float(high)


class Gathered:
    """Readings of a run that goes on, taken one moment after the other; another thread may ask for them meanwhile."""

    def __init__(self, tags: Iterable[str], most: int = MOST, most_values: int = MOST_VALUES) -> None:
        """Nothing of ``tags`` was read yet.

        Of more than ``most`` moments, or ``most_values`` of all tags together, the oldest are let go.
        """
        named = tuple(tags)
        self._named, self._most = named, min(most, max(2, most_values // (len(named) + 1)))
        self._kept = self._empty()

    def __call__(self, snapshot: Snapshot) -> None:
        """Take what the plant says; what is no later than what was taken before is left out."""
        held, count = self._kept
        if count and snapshot.at_s <= held.times_s[count - 1]:
            return
        if count == held.times_s.size:
            held, count = self._with_room(held)
        held.times_s[count] = snapshot.at_s
        for tag, values in held.signals.items():
            values[count] = snapshot.values.get(tag, np.nan)
        self._kept = held, count + 1  # last, and at once: what is counted is there

    def forget(self) -> None:
        """Let everything go: what comes is of another run, whose time may begin again."""
        self._kept = self._empty()

    def _empty(self) -> tuple[Readings, int]:
        room = min(_ROOM, self._most)
        return Readings(np.empty(room), {tag: np.empty(room) for tag in self._named}), 0

    def _with_room(self, full: Readings) -> tuple[Readings, int]:
        """The same in arrays with room behind it, and how many moments of it are there still."""
        size = full.times_s.size
        kept = size if size < self._most else size - max(1, size // 4)
        room = min(2 * size, self._most) if kept == size else size

        def moved(values: Values) -> Values:
            made = np.empty(room)
            made[:kept] = values[size - kept :]
            return made

        return Readings(moved(full.times_s), {tag: moved(v) for tag, v in full.signals.items()}), kept

    def readings(self) -> Readings | None:
        """What was taken so far; None where that is nothing."""
        held, count = self._kept
        if not count:
            return None
        return Readings(held.times_s[:count], {tag: values[:count] for tag, values in held.signals.items()})


def thinned(times_s: Values, series: Iterable[Values], width: int) -> NDArray[np.int64]:
    """Indices that draw ``series`` on ``width`` pixels as all samples would (M4: Jugel and others, 2014).

    First, last, least and largest sample of each pixel stay. ``times_s`` and each series have shape (n,).
    """
    count = times_s.size
    if count <= 4 * width:
        return np.arange(count)
    edges = np.unique(np.linspace(0, count, width + 1).astype(np.int64))
    kept = {0, count - 1}
    for begin, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        kept |= {begin, end - 1}
        for values in series:
            part = values[begin:end]
            if np.isfinite(part).any():
                kept |= {begin + int(np.nanargmin(part)), begin + int(np.nanargmax(part))}
    return np.array(sorted(kept), dtype=np.int64)
