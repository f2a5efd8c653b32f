"""What a formula is evaluated on: single values, one value per member of an ensemble, or signals over time."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final, NoReturn, TypeAlias

import numpy as np

from homeostat.stl import temporal
from homeostat.stl.signals import View
from homeostat.stl.sliding_extrema import HIGHEST, LOWEST, Decided, FloatArray, better, constant
from homeostat.stl.text import render
from homeostat.stl.tree import Always, Eventually, FormulaError, Until

Program: TypeAlias = Callable[[Any], Any]
"""A compiled tree: from the values of the tags to the value of the term, or to a bound of the margin."""


@dataclass(frozen=True, slots=True)
class Operations:
    """The operations on one kind of numbers that are not written with Python's own operators."""

    read: Callable[[str], Program]
    """From the name of a tag to the program that reads its value; NaN where there is none."""
    quotient: Callable[[Any, Any], Any]
    """First value divided by the second; NaN where that is zero."""
    smaller: Callable[[Any, Any], Any]
    """Smaller of two values; NaN where one of them is."""
    larger: Callable[[Any, Any], Any]
    """Larger of two values; NaN where one of them is."""
    known: Callable[[Program, float], Program]
    """The margin of a comparison from its difference, with the given margin in place of NaN."""
    constant: Callable[[float], Program]
    """A margin that no value changes."""
    lowest: Callable[[Any, Any], Any]
    """Smaller of two margins; neither is NaN."""
    highest: Callable[[Any, Any], Any]
    """Larger of two margins; neither is NaN."""
    window: Callable[[Always | Eventually, Program], Program]
    """Margin of a window from that of its operand."""
    until: Callable[[Until, Program, Program], Program]
    """Margin of an ``until`` from those of its condition and its goal."""
    root: Callable[[Any], Any]
    """Square root; 0 of what is negative, as a flow whose head is none; NaN of NaN."""


def _looks_ahead(node: Always | Eventually | Until, *_: Program) -> NoReturn:
    raise FormulaError(f"{render(node)!r} looks ahead, one point cannot decide it; evaluate a trajectory")


def _same(value: float) -> Program:
    return lambda _: value


def _value_of(tag: str) -> Program:
    # Plain floats: NumPy's scalars are slower and warn about what is legal here, such as infinity minus infinity.
    return lambda values: float(values.get(tag, math.nan))


def _quotient(left: float, right: float) -> float:
    return left / right if right != 0.0 else math.nan


def _smaller(left: float, right: float) -> float:
    return min(left, right) if left == left and right == right else math.nan


def _larger(left: float, right: float) -> float:
    return max(left, right) if left == left and right == right else math.nan


def _root(value: float) -> float:
    return math.sqrt(max(value, 0.0)) if value == value else math.nan


def _known(difference: Program, unknown: float) -> Program:
    def margin(values: Mapping[str, float]) -> float:
        found: float = difference(values)
        return found if found == found else unknown

    return margin


POINT: Final = Operations(
    _value_of, _quotient, _smaller, _larger, _known, _same, min, max, _looks_ahead, _looks_ahead, _root
)
"""One float per tag; a tag that is absent is unknown."""


def _column_of(tag: str) -> Program:
    return lambda columns: columns[tag]


def _quotients(left: FloatArray | float, right: FloatArray | float) -> Any:
    return left / np.where(np.equal(right, 0.0), math.nan, right)


def _roots(values: FloatArray | float) -> Any:
    return np.sqrt(np.maximum(values, 0.0))


def _known_columns(difference: Program, unknown: float) -> Program:
    bound = np.fmax if unknown < 0.0 else np.fmin  # of NaN and a number they take the number
    return lambda columns: bound(difference(columns), unknown)


_ARRAYS: Final = replace(POINT, quotient=_quotients, smaller=np.minimum, larger=np.maximum, root=_roots)
COLUMNS: Final = replace(_ARRAYS, read=_column_of, known=_known_columns, lowest=np.minimum, highest=np.maximum)
"""One array of shape (members,) per tag; all tags are there."""


def _signal_of(tag: str) -> Program:
    return lambda view: view.values(tag)


def _known_signals(difference: Program, unknown: float) -> Program:
    def margin(view: View) -> Decided:
        found = np.asarray(difference(view), dtype=np.float64)
        if np.isnan(found.min()):
            view.signals.undecided = True
            found = np.where(np.isnan(found), unknown, found)
        if found.ndim < 2:  # numbers only
            found = np.full((1, view.width), found)
        return Decided(found, np.arange(view.start, view.stop)[np.newaxis] if view.timed else None)

    return margin


def _constant_signal(value: float) -> Program:
    return lambda view: constant(value, view.width, view.timed)


_MARGINS: Final = replace(_ARRAYS, constant=_constant_signal, window=temporal.window, until=temporal.until)
SIGNALS: Final = replace(
    _MARGINS,
    read=_signal_of,
    known=_known_signals,
    lowest=partial(better, LOWEST),
    highest=partial(better, HIGHEST),
)
"""A `View` of signals; margins are `Decided`."""
