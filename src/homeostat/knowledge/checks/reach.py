"""How deeply can a rule be violated inside the ranges of its tags? What no values show counts as impossible.

Interval arithmetic proves that a rule cannot fail; what it leaves open is settled here by values: all combinations of
a few stations of each tag (the ends of its range, what it is compared with, and what lies between), or where these are
too many, a descent from many points along one tag after another. Equal formulas always get equal answers.
"""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.knowledge.checks.intervals import Interval, Intervals, bounds, margin
from homeostat.process.seeds import Stream, generator
from homeostat.stl.formula import Formula
from homeostat.stl.tree import Always, And, Comparison, Eventually, Implies, Logic, Not, Or, Until

MOST: Final = 4096
"""Combinations that are tried one by one."""
STARTS: Final = 8
"""Points from which a descent begins."""
SWEEPS: Final = 3
"""Times that a descent goes through all tags."""

_Values: TypeAlias = NDArray[np.float64]


def deepest(formula: Formula, ranges: Intervals) -> float:
    """The largest violation that some values inside ``ranges`` show, in the unit of the margin; 0 where none do."""
    stations = {tag: _stations(tag, formula, ranges[tag]) for tag in sorted(formula.tags)}
    if not stations:
        return max(-formula.margin_at({}), 0.0)
    least = _tried(formula, stations) if math.prod(map(len, stations.values())) <= MOST else _sought(formula, stations)
    return abs(min(least, 0.0))


def comparisons(root: Logic, holds: bool = True) -> Iterator[tuple[Comparison, bool]]:
    """The comparisons of a rule, each with whether it has to hold (or to fail) for the rule's sake."""
    match root:
        case Comparison():
            yield root, holds
        case Not():
            yield from comparisons(root.operand, not holds)
        case And() | Or():
            for operand in root.operands:
                yield from comparisons(operand, holds)
        case Implies():
            yield from comparisons(root.premise, not holds)
            yield from comparisons(root.conclusion, holds)
        case Always() | Eventually():
            yield from comparisons(root.operand, holds)
        case Until():
            yield from comparisons(root.condition, holds)
            yield from comparisons(root.goal, holds)


def ends(comparison: Comparison, holds: bool, ranges: Intervals) -> Interval:
    """Ends between which the margin of a comparison lies, or of its opposite, without its scale."""
    low, high = margin(comparison, ranges)
    return (low, high) if holds else (-high, -low)


def _stations(tag: str, formula: Formula, allowed: Interval) -> _Values:
    """Values of a tag that are worth trying."""
    turns = {bound.value for bound in bounds(formula.root) if bound.tag == tag}
    inside = sorted({*allowed, *(value for value in turns if allowed[0] <= value <= allowed[1])})
    return np.array(sorted({*inside, *((a + b) / 2.0 for a, b in pairwise(inside))}))


def _margins(formula: Formula, values: Mapping[str, _Values], undecided: float = math.inf) -> _Values:
    """Margin at every point; where it is undecided nothing is shown."""
    found = formula.margins({tag: column[None] for tag, column in values.items()}, 1.0)[0]
    return np.where(np.isnan(found), undecided, found)


def _tried(formula: Formula, stations: Mapping[str, _Values]) -> float:
    grid = np.meshgrid(*stations.values(), indexing="ij")
    return float(_margins(formula, {tag: g.ravel() for tag, g in zip(stations, grid, strict=True)}).min())


def _sought(formula: Formula, stations: Mapping[str, _Values]) -> float:
    """As :func:`_tried`, where combinations are too many; of a choice of many, each has to be violated in its turn."""
    rng = generator(0, Stream.RULES_REACH)
    parts = [(Formula("", node), 1.0 if holds else -1.0) for node, holds in comparisons(formula.root)]
    least = math.inf
    for _ in range(STARTS):
        point = {tag: float(rng.uniform(values[0], values[-1])) for tag, values in stations.items()}
        for _ in range(SWEEPS):
            for tag, values in stations.items():
                row = {t: np.full(values.size, v) for t, v in point.items()} | {tag: values}
                found = _margins(formula, row)
                beside = np.zeros(values.size)
                for part, sign in parts:
                    beside += sign * _margins(part, row, 0.0) if tag in part.tags else 0.0
                point[tag] = float(values[np.lexsort((beside, found))[0]])
                least = min(least, float(found.min()))
    return least
