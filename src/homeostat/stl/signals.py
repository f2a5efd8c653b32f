"""Signals a formula is evaluated on: brought to one shape and checked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.stl.sliding_extrema import FloatArray
from homeostat.stl.spelling import near_matches
from homeostat.stl.tree import FormulaError

SignalMap: TypeAlias = Mapping[str, NDArray[Any] | float]
"""Per tag an array of numbers, shape (members, time) or (time,), or a scalar; they are broadcast together."""


@dataclass(slots=True, eq=False)
class Signals:
    """Equally sampled signals of one ensemble, gathered for one evaluation."""

    arrays: Mapping[str, FloatArray]
    """One array per tag, shape (members or 1, samples); NaN where a value is not known."""
    members: int
    """Size of the ensemble."""
    samples: int
    """Length of the trace in samples."""
    dt_s: float
    """Sampling period in seconds."""
    undecided: bool = False
    """Whether the evaluation met a comparison whose margin is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The samples at which a margin is asked for."""

    signals: Signals
    """All samples."""
    start: int
    """First sample asked for."""
    stop: int
    """One after the last sample asked for."""
    timed: bool
    """Whether the deciding samples are asked for, too."""

    @property
    def width(self) -> int:
        """How many samples are asked for."""
        return self.stop - self.start

    def moved(self, start: int, stop: int) -> View:
        """The same question about other samples."""
        return View(self.signals, start, stop, self.timed)

    def values(self, tag: str) -> FloatArray:
        """Values of ``tag`` at these samples, shape (members or 1, width)."""
        return self.signals.arrays[tag][:, self.start : self.stop]


def gather(tags: Iterable[str], given: SignalMap, dt_s: float) -> Signals:
    """Bring the signals of ``tags`` to shape (members or 1, samples).

    ``given`` holds arrays of shape (members, time) or (time,) and scalars; all of them, needed or not, agree on the
    number of members and samples, where 1 goes with any. Raises `FormulaError` for a missing tag, a shape that does
    not fit, something else than numbers, or a sampling period that is not positive.
    """
    if not (math.isfinite(dt_s) and dt_s > 0):
        raise FormulaError(f"sampling period {dt_s!r} s must be finite and > 0 s")
    shapes = {name: _shape(name, value) for name, value in given.items()}
    members = _common("members", {name: members for name, (members, _) in shapes.items()})
    samples = _common("samples", {name: samples for name, (_, samples) in shapes.items()})
    return Signals({tag: _array(tag, given, samples) for tag in sorted(tags)}, members, samples, dt_s)


def _shape(name: str, value: NDArray[Any] | float) -> tuple[int, int]:
    shape = value.shape if isinstance(value, np.ndarray) else np.shape(value)
    if len(shape) == 2:
        return shape
    if len(shape) > 2:
        raise FormulaError(f"signal {name!r} has shape {shape}; give (members, time), (time,) or a scalar")
    members, samples = (1, 1, *shape)[-2:]
    return members, samples


def _common(what: str, sizes: Mapping[str, int]) -> int:
    longest = max(sizes, key=lambda name: sizes[name], default=None)
    if longest is None:
        return 1
    for name, size in sizes.items():
        if size == 0:
            raise FormulaError(f"signal {name!r} has 0 {what}; give at least one")
        if size not in (1, sizes[longest]):
            raise FormulaError(f"signal {name!r} has {size} {what} but {longest!r} has {sizes[longest]}; resample one")
    return sizes[longest]


def _array(tag: str, given: SignalMap, samples: int) -> FloatArray:
    if tag not in given:
        raise FormulaError(f"no signal for tag {tag!r}{near_matches(tag, given)}")
    try:
        array = np.atleast_2d(np.asarray(given[tag], dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise FormulaError(f"signal {tag!r} does not hold numbers: {error}") from None
    return np.broadcast_to(array, (array.shape[0], samples))
