"""Can a formula hold, and can it fail, for any values inside the ranges of its tags? Interval arithmetic on margins.

The answers err on one side: 'cannot' is proven, 'can' may be wrong where a tag occurs more than once, unless it is in a
sum: ``x - x`` is 0, ``x * x`` may be negative. A conjunction is sharper than its parts: bounds that it puts on one tag
are intersected first.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias, assert_never

from homeostat.stl import tree

Interval: TypeAlias = tuple[float, float]
"""Lower and upper end."""
Intervals: TypeAlias = Mapping[str, Interval]
"""One interval per tag."""
_Sum: TypeAlias = tuple[dict[tree.Arithmetic, float], float]
"""Factor of every term that is no sum itself, and a constant."""

_LEAST: Final = math.ulp(0.0)


@dataclass(frozen=True, slots=True)
class Bound:
    """A formula compares one tag with a number."""

    tag: str
    """Name of the tag."""
    operator: str
    """How, with the tag on the left."""
    value: float
    """The number."""


def can_hold(root: tree.Logic, ranges: Intervals) -> bool:
    """Whether the margin may be >= 0 for some values inside ``ranges``."""
    return margin(root, ranges)[1] >= 0.0


def can_fail(root: tree.Logic, ranges: Intervals) -> bool:
    """Whether the margin may be < 0 for some values inside ``ranges``."""
    return margin(root, ranges)[0] < 0.0


def bounds(root: tree.Logic) -> Iterator[Bound]:
    """The comparisons of one tag with a number, in reading order."""
    for node, _ in tree.walk(root):
        if isinstance(node, tree.Comparison) and (bound := _bound(node)) is not None:
            yield bound


def span(node: tree.Arithmetic, ranges: Intervals) -> Interval:
    """Ends between which the term lies; what a tag adds and takes away again is nothing."""
    if not _repeats(node):
        return _span(node, ranges)
    factors, constant = _sum(node)
    low = high = constant
    for term, factor in factors.items():
        ends = sorted(factor * end for end in _span(term, ranges))
        low, high = low + ends[0], high + ends[1]
    return (low, high)


def _repeats(node: tree.Arithmetic) -> bool:
    """Whether a tag occurs more than once."""
    names = [part.tag for part, _ in tree.walk(node) if isinstance(part, tree.TagValue)]
    return len(names) > len(set(names))


def _sum(node: tree.Arithmetic) -> _Sum:
    """The term as a sum in which each part occurs once."""
    match node:
        case tree.Number():
            return {}, node.value
        case tree.Negate():
            return _times(-1.0, _sum(node.operand))
        case tree.Binary(operator="+"):
            return _plus(_sum(node.left), _sum(node.right))
        case tree.Binary(operator="-"):
            return _plus(_sum(node.left), _times(-1.0, _sum(node.right)))
        case tree.Binary(operator="/") if node.left == node.right:
            return {}, 1.0  # where it has a value at all
        case tree.Binary():
            (left, one), (right, other) = _sum(node.left), _sum(node.right)
            if node.operator == "*" and not left:
                return _times(one, (right, other))
            if not right and (node.operator == "*" or other != 0.0):
                return _times(other if node.operator == "*" else 1.0 / other, (left, one))
    return {node: 1.0}, 0.0


def _plus(one: _Sum, other: _Sum) -> _Sum:
    factors = {part: one[0].get(part, 0.0) + other[0].get(part, 0.0) for part in {**one[0], **other[0]}}
    return {part: factor for part, factor in factors.items() if factor != 0.0}, one[1] + other[1]


def _times(factor: float, of: _Sum) -> _Sum:
    return {part: factor * before for part, before in of[0].items() if factor != 0.0}, factor * of[1]


def _span(node: tree.Arithmetic, ranges: Intervals) -> Interval:
    match node:
        case tree.Number():
            return (node.value, node.value)
        case tree.TagValue():
            return ranges[node.tag]
        case tree.Negate():
            low, high = span(node.operand, ranges)
            return (-high, -low)
        case tree.Binary():
            return _binary(node.operator, span(node.left, ranges), span(node.right, ranges))
        case tree.Call(function="abs"):
            low, high = span(node.arguments[0], ranges)
            return (max(low, -high, 0.0), max(-low, high))
        case tree.Call():
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
        quotients = [a / b for a in left for b in right]
        return (min(quotients), max(quotients))
    # Zero times an unbounded end is zero here: the factor that is zero was reached, the unbounded end never is.
    products = [0.0 if a == 0.0 or b == 0.0 else a * b for a in left for b in right]
    return (min(products), max(products))


def margin(node: tree.Logic, ranges: Intervals) -> Interval:
    """Ends whose signs bound the sign of the formula's margin; temporal operators see the ranges at every moment."""
    match node:
        case tree.Truth():
            return (math.inf, math.inf) if node.value else (-math.inf, -math.inf)
        case tree.Comparison():
            return _compare(node.operator, span(tree.Binary("-", node.left, node.right), ranges))
        case tree.Not():
            low, high = margin(node.operand, ranges)
            return (-high, -low)
        case tree.And():
            return _all(node.operands, ranges)
        case tree.Or():
            low, high = _all(tuple(tree.Not(operand) for operand in node.operands), ranges)
            return (-high, -low)
        case tree.Implies():
            return margin(tree.Or((tree.Not(node.premise), node.conclusion)), ranges)
        case tree.Always() | tree.Eventually():
            return margin(node.operand, ranges)
        case tree.Until():
            return (-math.inf, margin(node.goal, ranges)[1])
        case _:
            assert_never(node)


def _all(operands: tuple[tree.Logic, ...], ranges: Intervals) -> Interval:
    """Margin of a conjunction: where it holds, so do the bounds that its operands put on single tags."""
    narrowed = _narrowed(operands, ranges)
    high = -math.inf if narrowed is None else min(margin(operand, narrowed)[1] for operand in operands)
    low = min(margin(operand, ranges)[0] for operand in operands)
    # Outside the narrowed ranges the margin is negative, by an unknown amount: only the sign is kept.
    return (low, high if high >= 0.0 else -_LEAST)


def _narrowed(operands: tuple[tree.Logic, ...], ranges: Intervals) -> Intervals | None:
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


def _operand_bound(node: tree.Logic) -> Bound | None:
    if isinstance(node, tree.Comparison):
        return _bound(node)
    if isinstance(node, tree.Not) and isinstance(node.operand, tree.Comparison):
        bound = _bound(node.operand)
        opposite = {"<=": ">=", "<": ">=", ">=": "<=", ">": "<="}
        if bound is not None and bound.operator in opposite:
            return Bound(bound.tag, opposite[bound.operator], bound.value)
    return None


def _bound(node: tree.Comparison) -> Bound | None:
    if isinstance(node.left, tree.TagValue) and not tree.tags_of(node.right):
        return Bound(node.left.tag, node.operator, span(node.right, {})[0])
    if isinstance(node.right, tree.TagValue) and not tree.tags_of(node.left):
        mirrored = {"<=": ">=", "<": ">", ">=": "<=", ">": "<"}
        return Bound(node.right.tag, mirrored.get(node.operator, node.operator), span(node.left, {})[0])
    return None


def _compare(operator: str, difference: Interval) -> Interval:
    """The margin of a comparison, without its scale; strictness is not seen, as in the evaluation."""
    match operator:
        case "<=" | "<":
            return (-difference[1], -difference[0])
        case ">=" | ">":
            return difference
    distance = (max(difference[0], -difference[1], 0.0), max(-difference[0], difference[1]))
    return (-distance[1], -distance[0])
