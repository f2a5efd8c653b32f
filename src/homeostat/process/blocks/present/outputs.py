"""What a controller's output was, from what all the parts that follow it were commanded: a split range, a cascade."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from homeostat.process.blocks.term import Term, evaluate
from homeostat.process.types import Vec

Rows = NDArray[np.bool_]
NARROW: Final = 1e-3
"""Width [1] within which an output is known; a part that rests tells less than that."""
_SAME: Final = 1e-10
"""Share of what a part moves by within which it is taken to be where it was commanded [1]."""


class Part(NamedTuple):
    """One of those that follow an output: an actuator, or the setpoint of an inner loop."""

    of: Term
    """What it is commanded, monotone in the output."""
    wanted: Vec
    """What it was commanded in each row, shape (rows,); NaN where nothing tells."""
    by_hand: Rows
    """Rows in which somebody else commanded it, shape (rows,)."""

    def at(self, output: Term, known: Mapping[Term, Any], value: Vec | float) -> Vec:
        """What it is commanded in each row where ``output`` is ``value``, shape (rows,)."""
        told = evaluate(self.of, {**known, output: value})
        return np.broadcast_to(np.asarray(told, dtype=np.float64), self.wanted.shape)


class Told(NamedTuple):
    """What a record says of an output, in each row."""

    output: Vec
    """Where it stood [1], shape (rows,); where it is not known a value that would have done the same."""
    known: Rows
    """Rows in which that is known, and inside its limits."""
    by_hand: Rows
    """Rows in which all that follows it was commanded by hand."""
    low: Vec
    """It was not below this [1], shape (rows,); -inf where nothing says so."""
    high: Vec
    """It was not above this [1], shape (rows,); inf where nothing says so."""


def told_by(parts: Sequence[Part], output: Term, known: Mapping[Term, Any], least: float) -> Told:
    """What all of ``parts`` say of ``output``, which is from ``least`` to 1; those that rest say on which side it is.

    In each row the part that the others agree with most goes first: what is read of one that rests may be a little off
    its end, and would be taken for where the output is. By hand a part says nothing, but where all of them are.
    """
    ranges = [_range(part, output, known, least) for part in parts]
    free = [(np.where(part.by_hand, least, a), np.where(part.by_hand, 1.0, b))
            for part, (a, b) in zip(parts, ranges, strict=True)]  # fmt: skip
    low, high = _agreed(parts, free, output, known)
    inside = (high - low < NARROW) & (low > least + 1e-9) & (high < 1.0 - 1e-9)
    a, b = low, high  # of what remains, it is taken to be where what was given by hand would be no bump
    for part, each in zip(parts, ranges, strict=True):
        a, b = (np.where(part.by_hand, np.clip(end, a, b), was) for end, was in zip(each, (a, b), strict=True))
    found = 0.5 * (a + b)
    return Told(
        np.where(found < least + 1e-9, least, np.where(found > 1.0 - 1e-9, 1.0, found)),
        inside,
        np.all([part.by_hand for part in parts], axis=0),
        np.where(low > least + 1e-9, low, -np.inf),
        np.where(high < 1.0 - 1e-9, high, np.inf),
    )


def _agreed(
    parts: Sequence[Part], ranges: Sequence[tuple[Vec, Vec]], output: Term, known: Mapping[Term, Any]
) -> tuple[Vec, Vec]:
    """Lowest and highest output in each row by all ``ranges``, shape (rows,) each: what contradicts least."""
    tried: list[tuple[Vec, Vec]] = []
    off: list[Vec] = []
    for first in range(len(parts)):
        low, high = ranges[first]
        for a, b in (*ranges[:first], *ranges[first + 1 :]):
            low, high = np.clip(a, low, high), np.clip(b, low, high)
        tried.append((low, high))
        off.append(np.zeros_like(low))
        for part in parts:
            missed = np.abs(part.at(output, known, 0.5 * (low + high)) - part.wanted) / _span(part, output, known)
            off[-1] += np.where(part.by_hand | np.isnan(missed), 0.0, missed)
    best = np.argmin(np.round(off, 9), axis=0)[None]
    low, high = (np.take_along_axis(np.array(each), best, axis=0)[0] for each in zip(*tried, strict=True))
    return low, high


def _range(part: Part, output: Term, known: Mapping[Term, Any], least: float) -> tuple[Vec, Vec]:
    """Lowest and highest output in each row at which ``part`` is commanded what it was, by bisection."""
    ends = part.at(output, known, least), part.at(output, known, 1.0)
    rises = bool(np.nansum(ends[1] - ends[0]) >= 0.0)
    wanted = np.clip(part.wanted, np.minimum(*ends), np.maximum(*ends))
    near = _SAME * np.abs(ends[1] - ends[0])
    near = near if rises else -near
    found = []
    for aim, lowest in ((wanted - near, True), (wanted + near, False)):
        low, high = np.full_like(wanted, least), np.ones_like(wanted)
        for _ in range(40):
            middle = 0.5 * (low + high)
            there = part.at(output, known, middle)
            beyond = (there >= aim if lowest else there > aim) if rises else (there <= aim if lowest else there < aim)
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        found.append(np.where(np.isnan(wanted), least if lowest else 1.0, 0.5 * (low + high)))
    return found[0], np.maximum(*found)


def _span(part: Part, output: Term, known: Mapping[Term, Any]) -> Vec:
    """What the part moves by over the whole range of the output, shape (rows,)."""
    moves = np.abs(part.at(output, known, 1.0) - part.at(output, known, 0.0))
    return np.where(moves > 0.0, moves, np.inf)
