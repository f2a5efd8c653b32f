"""Widest: the largest margin that a formula can have while its tags stay in their ranges."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TypeAlias, assert_never

from homeostat.stl.formula import Formula
from homeostat.stl.tree import (
    Always,
    And,
    Arithmetic,
    Binary,
    Call,
    Comparison,
    Eventually,
    Implies,
    Logic,
    Negate,
    Not,
    Number,
    Or,
    TagValue,
    Truth,
    Until,
)

Span: TypeAlias = tuple[float, float]
"""Least and largest value that something can have."""
_ANY: Span = (-math.inf, math.inf)


def widest(formula: Formula, ranges: Mapping[str, Span]) -> float:
    """The largest margin of ``formula`` in its unit, or more; ``ranges``: tag -> least and largest value.

    What depends on the same tag twice is taken as if it did not, so the truth may be less. Infinite where a tag has no
    range.

    >>> from homeostat.stl.formula import parse
    >>> widest(parse("always (spilled <= 0.25)"), {"spilled": (0.0, 1000.0)})
    0.25
    """
    return _margins(formula.root, ranges)[1]


def _margins(node: Logic, ranges: Mapping[str, Span]) -> Span:
    match node:
        case Truth():
            return (math.inf, math.inf) if node.value else (-math.inf, -math.inf)
        case Comparison():
            low, high = _compared(node, ranges)
            return low / node.scale, high / node.scale
        case Not():
            low, high = _margins(node.operand, ranges)
            return -high, -low
        case And() | Or():
            found = [_margins(operand, ranges) for operand in node.operands]
            pick = min if isinstance(node, And) else max
            return pick(low for low, _ in found), pick(high for _, high in found)
        case Implies():
            return _margins(Or((Not(node.premise), node.conclusion)), ranges)
        case Always() | Eventually():
            return _margins(node.operand, ranges)
        case Until():
            return _margins(And((node.condition, node.goal)), ranges)[0], _margins(node.goal, ranges)[1]
        case _:
            assert_never(node)


def _compared(node: Comparison, ranges: Mapping[str, Span]) -> Span:
    left, right = _values(node.left, ranges), _values(node.right, ranges)
    if node.operator == "==":
        low, high = _absolute(_minus(left, right))
        return -high, -low
    return _minus(right, left) if node.operator in ("<=", "<") else _minus(left, right)


def _values(node: Arithmetic, ranges: Mapping[str, Span]) -> Span:
    match node:
        case Number():
            return node.value, node.value
        case TagValue():
            return ranges.get(node.tag, _ANY)
        case Negate():
            low, high = _values(node.operand, ranges)
            return -high, -low
        case Call(function="abs"):
            return _absolute(_values(node.arguments[0], ranges))
        case Call(function="sqrt"):
            return _rooted(_values(node.arguments[0], ranges))
        case Call():
            pick = min if node.function == "min" else max
            found = [_values(argument, ranges) for argument in node.arguments]
            return pick(low for low, _ in found), pick(high for _, high in found)
        case Binary():
            return _joined(node, _values(node.left, ranges), _values(node.right, ranges))
        case _:
            assert_never(node)


def _joined(node: Binary, left: Span, right: Span) -> Span:
    match node.operator:
        case "+":
            return left[0] + right[0], left[1] + right[1]
        case "-":
            return _minus(left, right)
        case "*":
            return _ends(a * b for a in left for b in right)
        case "/":
            return _ANY if right[0] <= 0.0 <= right[1] else _ends(a / b for a in left for b in right)
        case _:
            assert_never(node.operator)


def _ends(found: Iterable[float]) -> Span:
    """From the least to the largest of ``found``; anything where one of them is undecided."""
    every = tuple(found)
    return _ANY if any(map(math.isnan, every)) else (min(every), max(every))


def _minus(left: Span, right: Span) -> Span:
    return left[0] - right[1], left[1] - right[0]


def _rooted(span: Span) -> Span:
    low, high = (math.sqrt(max(end, 0.0)) if end == end else math.nan for end in span)
    return low, high


def _absolute(span: Span) -> Span:
    low, high = span
    return (0.0 if low <= 0.0 <= high else min(abs(low), abs(high))), max(abs(low), abs(high))
