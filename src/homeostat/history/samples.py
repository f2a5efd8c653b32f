"""Samples in columns: a batch as it arrives, and what is read of one tag. Times are UTC, in microseconds since 1970."""

from dataclasses import dataclass, fields
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Times: TypeAlias = NDArray[np.int64]
Values: TypeAlias = NDArray[np.float64]
Codes: TypeAlias = NDArray[np.uint32]

NO_TIME: Final = int(np.iinfo(np.int64).min)
"""Stands for a time that nobody stated."""
MINUTE_US: Final = 60_000_000
"""A minute [us]."""
LONGEST_NAME: Final = 512
"""Most characters of a tag's name."""


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time, its end not included."""

    from_us: int
    """First moment [us]."""
    to_us: int
    """End [us]; not before ``from_us``."""

    def __post_init__(self) -> None:
        if self.to_us < self.from_us:
            raise ValueError(f"a span from {self.from_us} us to {self.to_us} us ends before it begins; swap them")

    @property
    def seconds(self) -> float:
        """Length [s]."""
        return (self.to_us - self.from_us) / 1e6

    def overlaps(self, first_us: int, last_us: int) -> bool:
        """Whether any moment from ``first_us`` to ``last_us``, both included [us], lies inside."""
        return first_us < self.to_us and last_us >= self.from_us


ALWAYS: Final = Span(NO_TIME + 1, int(np.iinfo(np.int64).max))
"""Every moment that can be stated."""


@dataclass(frozen=True, slots=True)
class Batch:
    """Samples that arrived together; every array has shape (n,), and the order is kept.

    Raises ValueError where arrays do not fit, a source time is not stated, or a name is no name.
    """

    tags: tuple[str, ...]
    """Tag of each sample, n of them; a tag may occur several times."""
    time_us: Times
    """When the source says the value was taken [us]; any order, also twice the same."""
    value: Values
    """Value in the tag's unit; NaN and the infinities are kept as they are."""
    quality: Codes
    """Status code of each sample (:mod:`homeostat.history.quality`)."""
    server_us: Times
    """When the server says it had the value [us]; NO_TIME where it does not say."""
    own_us: int
    """When the batch arrived, by our own clock [us]."""

    def __post_init__(self) -> None:
        for name, kind in (("time_us", "i8"), ("value", "f8"), ("quality", "u4"), ("server_us", "i8")):
            array = getattr(self, name)
            if array.shape != (len(self.tags),) or array.dtype != np.dtype(kind):
                text = f"{name} has shape {array.shape} and type {array.dtype}"
                raise ValueError(f"{text}; {len(self.tags)} samples need ({len(self.tags)},) of {np.dtype(kind)}")
        if (self.time_us == NO_TIME).any():
            raise ValueError("a sample has no source time; state one")
        if not NO_TIME < self.own_us <= -(NO_TIME + 1):
            raise ValueError(f"own_us {self.own_us!r} is no time in microseconds since 1970")


@dataclass(frozen=True, slots=True)
class Series:
    """Samples of one tag by source time, those of equal time as they arrived; every array has shape (n,)."""

    time_us: Times
    """Source time [us], never decreasing."""
    value: Values
    """Value in the tag's unit."""
    quality: Codes
    """Status code."""
    server_us: Times
    """Server time [us]; NO_TIME where none was stated."""
    own_us: Times
    """Time of arrival by our own clock [us]."""

    @property
    def length(self) -> int:
        """Number of samples."""
        return len(self.time_us)

    def within(self, span: Span) -> "Series":
        """The samples inside ``span``."""
        first, end = np.searchsorted(self.time_us, [span.from_us, span.to_us])
        return self._sliced(int(first), int(end))

    def tail(self, n: int) -> "Series":
        """The last ``n`` samples, or all."""
        return self._sliced(max(self.length - n, 0), self.length)

    def _sliced(self, first: int, end: int) -> "Series":
        return Series(
            self.time_us[first:end],
            self.value[first:end],
            self.quality[first:end],
            self.server_us[first:end],
            self.own_us[first:end],
        )


NO_SAMPLES: Final = Series(*(np.empty(0, dtype=kind) for kind in ("i8", "f8", "u4", "i8", "i8")))
"""No sample at all."""


@dataclass(frozen=True, slots=True)
class Minutes:
    """One tag minute by minute, only minutes with samples; every array has shape (n,).

    Minimum, maximum, mean and last are those of good, finite samples: NaN where a minute has none.
    """

    minute_us: Times
    """Beginning of the minute [us], increasing."""
    minimum: Values
    """Least value, in the tag's unit."""
    maximum: Values
    """Greatest value."""
    mean: Values
    """Mean over the samples, each with the same weight."""
    last: Values
    """Value of the latest sample."""
    last_us: Times
    """Source time of that one [us]; NO_TIME where there is none."""
    good: Times
    """Number of samples that are good and finite."""
    count: Times
    """Number of all samples."""

    @property
    def length(self) -> int:
        """Number of minutes."""
        return len(self.minute_us)

    def within(self, span: Span) -> "Minutes":
        """The minutes that begin inside ``span``."""
        first, end = np.searchsorted(self.minute_us, [span.from_us, span.to_us])
        return Minutes(*(getattr(self, field.name)[first:end] for field in fields(self)))
