"""Signals a formula is evaluated on: brought to one shape and checked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.stl.spelling import near_matches
from homeostat.stl.tree import FormulaError
from homeostat.stl.windows import FloatArray

SignalMap: TypeAlias = Mapping[str, NDArray[Any] | float]
"""Per tag an array of numbers, shape (members, time) or (time,), or a scalar; they are broadcast together."""


@dataclass(frozen=True, slots=True, eq=False)
class Signals:
    """Equally sampled signals of one ensemble."""

    arrays: Mapping[str, FloatArray]
    """One array per tag, shape (members or 1, samples), without NaN."""
    members: int
    """Size of the ensemble."""
    samples: int
    """Length of the trace in samples."""
    dt_s: float
    """Sampling period in seconds."""


def gather(tags: Iterable[str], given: SignalMap, dt_s: float) -> Signals:
    """Bring the signals of ``tags`` to shape (members or 1, samples).

    ``given`` holds arrays of shape (members, time) or (time,) and scalars; all of them, needed or not, agree on the
    number of members and samples, where 1 goes with any. Raises `FormulaError` for a missing tag, a shape that does
    not fit, a value that is not a number, or a sampling period that is not positive.
    """
    if not (math.isfinite(dt_s) and dt_s > 0):
        raise FormulaError(f"sampling period {dt_s!r} s must be finite and > 0 s")
    members = _common("members", {name: _shape(name, value)[0] for name, value in given.items()})
    samples = _common("samples", {name: _shape(name, value)[1] for name, value in given.items()})
    return Signals({tag: _array(tag, given, samples, dt_s) for tag in sorted(tags)}, members, samples, dt_s)


def place(bad: NDArray[np.bool_], start: int, dt_s: float) -> str:
    """Where the first true entry of ``bad`` lies, in words; its time axis begins at sample ``start``."""
    member, index = np.argwhere(bad)[0]
    return f"member {member}, time index {start + index} (t = {(start + index) * dt_s:g} s)"


def _shape(name: str, value: NDArray[Any] | float) -> tuple[int, int]:
    shape = np.shape(value)
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


def _array(tag: str, given: SignalMap, samples: int, dt_s: float) -> FloatArray:
    if tag not in given:
        raise FormulaError(f"no signal for tag {tag!r}{near_matches(tag, given)}")
    try:
        array = np.atleast_2d(np.asarray(given[tag], dtype=np.float64))
    except (TypeError, ValueError) as error:
        raise FormulaError(f"signal {tag!r} does not hold numbers: {error}") from None
    # The minimum is NaN when any entry is, and costs no temporary array.
    if np.isnan(array.min()):
        raise FormulaError(f"signal {tag!r} is not a number (NaN) at {place(np.isnan(array), 0, dt_s)}")
    return np.broadcast_to(array, (array.shape[0], samples))
