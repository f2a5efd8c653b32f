"""Can a formula hold, and can it fail, for any values inside the ranges of its tags? Interval arithmetic.

The answers err on one side: 'cannot' is proven, 'can' may be wrong where a tag occurs more than once. A conjunction is
sharper than its parts: bounds that it puts on one tag are intersected first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias, assert_never

from homeostat.domain.formula_ast import (
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
    tags_of,
    walk,
)

Interval: TypeAlias = tuple[float, float]
"""Lower and upper end."""
Intervals: TypeAlias = Mapping[str, Interval]
"""One interval per tag."""


@dataclass(frozen=True, slots=True)
class Bound:
    """A formula compares one tag with a number."""

    tag: str
    """Name of the tag."""
    operator: str
    """How, with the tag on the left."""
    value: float
    """The number."""


def can_hold(root: Logic, ranges: Intervals) -> bool:
    """Whether some values inside ``ranges`` may satisfy the formula."""
    return _possible(root, ranges)[0]


def can_fail(root: Logic, ranges: Intervals) -> bool:
    """Whether some values inside ``ranges`` may violate the formula."""
    return _possible(root, ranges)[1]


def bounds(root: Logic) -> Iterator[Bound]:
    """The comparisons of one tag with a number, in reading order."""
    for node, _ in walk(root):
        if isinstance(node, Comparison) and (bound := _bound(node)) is not None:
            yield bound


def span(node: Arithmetic, ranges: Intervals) -> Interval:
    """Ends between which the term lies."""
    match node:
        case Number():
            return (node.value, node.value)
        case TagValue():
            return ranges[node.tag]
        case Negate():
            low, high = span(node.operand, ranges)
            return (-high, -low)
        case Binary():
            return _binary(node.operator, span(node.left, ranges), span(node.right, ranges))
        case Call(function="abs"):
            low, high = span(node.arguments[0], ranges)
            return (max(low, -high, 0.0), max(-low, high))
        case Call():
            choose = min if node.function == "min" else max
            lows, highs = zip(*(span(argument, ranges) for argument in node.arguments), strict=True)
            return (choose(lows), choose(highs))
        case _:
            assert_never(node)


def _binary(operator: str, left: Interval, right: Interval) -> Interval:
    if operator == "+":
        return (left[0] + right[0], left[1] + right[1])
    if operator == "-":
        return (left[0] - right[1], left[1] - right[0])
    if operator == "/":
        if right[0] <= 0.0 <= right[1]:
            return (-math.inf, math.inf)
        right = (1.0 / right[1], 1.0 / right[0])
    # Zero times an unbounded end is zero here: the factor that is zero was reached, the unbounded end never is.
    products = [0.0 if a == 0.0 or b == 0.0 else a * b for a in left for b in right]
    return (min(products), max(products))


def _possible(node: Logic, ranges: Intervals) -> tuple[bool, bool]:
    """Whether the formula can hold, and whether it can fail."""
    match node:
        case Truth():
            return (node.value, not node.value)
        case Comparison():
            return _compare(node.operator, span(node.left, ranges), span(node.right, ranges))
        case Not():
            return _possible(node.operand, ranges)[::-1]
        case And():
            return _all(node.operands, ranges)
        case Or():
            return _all(tuple(Not(operand) for operand in node.operands), ranges)[::-1]
        case Implies():
            return _possible(Or((Not(node.premise), node.conclusion)), ranges)
        case Always() | Eventually():
            return _possible(node.operand, ranges)
        case Until():
            return (_possible(node.goal, ranges)[0], True)
        case _:
            assert_never(node)


def _all(operands: tuple[Logic, ...], ranges: Intervals) -> tuple[bool, bool]:
    narrowed = _narrowed(operands, ranges)
    holds = narrowed is not None and all(_possible(operand, narrowed)[0] for operand in operands)
    return (holds, any(_possible(operand, ranges)[1] for operand in operands))


def _narrowed(operands: tuple[Logic, ...], ranges: Intervals) -> Intervals | None:
    """The ranges inside which the operands' bounds on single tags hold together; None where there is no such value."""
    narrowed = dict(ranges)
    for operand in operands:
        bound = _operand_bound(operand)
        if bound is None:
            continue
        low, high = narrowed[bound.tag]
        if bound.operator in ("<=", "<", "=="):
            high = min(high, bound.value)
        if bound.operator in (">=", ">", "=="):
            low = max(low, bound.value)
        if low > high:
            return None
        narrowed[bound.tag] = (low, high)
    return narrowed


def _operand_bound(node: Logic) -> Bound | None:
    if isinstance(node, Comparison):
        return _bound(node)
    if isinstance(node, Not) and isinstance(node.operand, Comparison):
        bound = _bound(node.operand)
        opposite = {"<=": ">=", "<": ">=", ">=": "<=", ">": "<="}
        if bound is not None and bound.operator in opposite:
            return Bound(bound.tag, opposite[bound.operator], bound.value)
    return None


def _bound(node: Comparison) -> Bound | None:
    if isinstance(node.left, TagValue) and not tags_of(node.right):
        return Bound(node.left.tag, node.operator, span(node.right, {})[0])
    if isinstance(node.right, TagValue) and not tags_of(node.left):
        mirrored = {"<=": ">=", "<": ">", ">=": "<=", ">": "<"}
        return Bound(node.right.tag, mirrored.get(node.operator, node.operator), span(node.left, {})[0])
    return None


def _compare(operator: str, left: Interval, right: Interval) -> tuple[bool, bool]:
    """Strictness is not seen, as in the evaluation: ``a < b`` holds at ``a == b``."""
    match operator:
        case "<=" | "<":
            return (left[0] <= right[1], left[1] > right[0])
        case ">=" | ">":
            return (left[1] >= right[0], left[0] < right[1])
        case "==":
            return (left[0] <= right[1] and right[0] <= left[1], not (left[0] == left[1] == right[0] == right[1]))
        case _:  # "!=" always holds in the evaluation
            return (True, False)
