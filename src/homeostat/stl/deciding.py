"""Deciding: the one comparison that a margin comes from, for formulas of several, and those that mix units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from homeostat.stl.evaluator import term
from homeostat.stl.formula import Formula
from homeostat.stl.operations import POINT
from homeostat.stl.text import render
from homeostat.stl.tree import Comparison, Implies, Node, Not, children

_SAME = 1e-6
"""By how much a comparison's margin may differ from the formula's that it decides, relative to it or to 1 [1]."""


@dataclass(frozen=True, slots=True)
class Deciding:
    """One comparison and its margin."""

    comparison: str
    """What is compared, in the rule language; after ``not`` where it must not hold."""
    margin: float
    """Signed distance, in ``unit``; negative where it is what the formula fails by."""
    unit: str
    """Unit of what is compared; ``1`` for a fraction, empty where it is not known."""


def deciding(formula: Formula, values: Mapping[str, float], margin: float) -> Deciding | None:
    """The comparison that gives ``formula`` its ``margin`` at one sample with ``values``; None where none does.

    ``values``: tag -> value at the sample that decides, see `Formula.evaluate`. Of several that give the same margin
    it is the first as written.

    >>> from homeostat.stl.formula import parse
    >>> deciding(parse("L1 >= 2 or F1 <= 0.5"), {"L1": 5.0, "F1": 9.0}, 3.0)
    Deciding(comparison='L1 >= 2', margin=3.0, unit='')
    """
    if not math.isfinite(margin):
        return None
    for comparison, negated in _comparisons(formula.root):
        found = _margin(comparison, values) * (-1.0 if negated else 1.0)
        if math.isclose(found, margin, rel_tol=_SAME, abs_tol=_SAME):
            text = render(Not(comparison) if negated else comparison)
            plain = comparison.scale == 1.0 and not comparison.unit
            return Deciding(text, margin * comparison.scale, formula.unit if plain else comparison.unit)
    return None


def decided(formula: Formula, values: Mapping[str, float], margin: float) -> Deciding | None:
    """As :func:`deciding`, and None as well where the margin is in the unit of the one thing that is compared."""
    return None if formula.unit != "1" and formula.is_one_comparison else deciding(formula, values, margin)


def amount(formula: Formula, values: Mapping[str, float], margin: float) -> str:
    """The size of a ``margin`` of ``formula`` at ``values``, with the unit of the comparison that decides it.

    Where none does, the margin of a formula that mixes units is in scales of its tags, and said to be.
    """
    by = decided(formula, values, margin)
    size, unit = (margin, formula.unit) if by is None or not by.unit else (by.margin, by.unit)
    mixed = any(comparison.unit for comparison, _ in _comparisons(formula.root))
    if mixed and by is None:
        return f"{abs(size):.4g} scales of its tags"
    return f"{abs(size):.4g}" if unit in ("1", "") else f"{abs(size):.4g} {unit}"


def _comparisons(root: Node) -> list[tuple[Comparison, bool]]:
    """Every comparison below ``root`` with whether it is negated, in reading order; not recursive."""
    stack, found = [(root, False)], []
    while stack:
        node, negated = stack.pop()
        match node:
            case Comparison():
                found.append((node, negated))
            case Not():
                stack.append((node.operand, not negated))
            case Implies():
                stack += [(node.conclusion, negated), (node.premise, not negated)]
            case _:
                stack += [(child, negated) for child in reversed(children(node))]
    return found


def _margin(node: Comparison, values: Mapping[str, float]) -> float:
    """Its margin, as the evaluator has it; NaN where a value is missing."""
    left, right = float(term(node.left, POINT)(values)), float(term(node.right, POINT)(values))
    if node.operator == "==":
        return -abs(left - right) / node.scale
    return (right - left if node.operator in ("<=", "<") else left - right) / node.scale
