"""The one meaning of a formula: its syntax tree, compiled to a function of the values of its tags.

Discrete-time signal temporal logic (Donzé and Maler, "Robust satisfaction of temporal logic over real-valued signals",
FORMATS 2010), with margins that may be unknown. A term over a value that is missing or not a number (NaN) is NaN, so is
a quotient by zero and infinity minus infinity. A comparison of such a term may have any margin between -inf and +inf,
and what follows for the whole formula is bounded from below and from above:

    margin = lower bound, where that is >= 0: it holds whatever the unknown values are;
             upper bound, where that is < 0: it is violated whatever they are;
             NaN otherwise: undecided.

Both bounds are the ordinary margin, with the least or the greatest margin in place of the unknown ones. A bound that
holds nothing unknown is exact, and then there is no need for the other one.

What the tree is evaluated on is no business of this module: `operations` has single values, one value per member of an
ensemble, and signals over time. They differ in how two numbers are taken, never in what an operator means.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, assert_never

import numpy as np

from homeostat.stl.operations import Operations, Program
from homeostat.stl.signals import Signals, View
from homeostat.stl.sliding_extrema import NOWHERE, Decided
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


@dataclass(frozen=True, slots=True)
class Bounds:
    """The two bounds of a formula's margin on one kind of operations."""

    lower: Program
    """The least margin it may have."""
    upper: Program
    """The greatest margin it may have."""


def bounds(root: Logic, operations: Operations) -> Bounds:
    """Compile a condition. Raises `FormulaError` for a temporal operator on numbers without time."""
    return Bounds(_logic(root, operations, -math.inf), _logic(root, operations, math.inf))


def over_time(compiled: Bounds, signals: Signals, count: int, timed: bool) -> Decided:
    """Margins at the first ``count`` samples, shape (members or 1, count); with the deciding samples when ``timed``.

    Raises `FormulaError` for a bound that is no multiple of the sampling period.
    """
    view = View(signals, 0, count, timed)
    with np.errstate(all="ignore"):  # infinities are legal values, and what is no number is unknown
        lower = compiled.lower(view)
        assert isinstance(lower, Decided)
        if not signals.undecided:
            return lower
        upper = compiled.upper(view)
    holds, violated = lower.value >= 0.0, upper.value < 0.0
    value = np.where(holds, lower.value, np.where(violated, upper.value, math.nan))
    if lower.at is None or upper.at is None:
        return Decided(value, None)
    return Decided(value, np.where(holds, lower.at, np.where(violated, upper.at, NOWHERE)))


def term(node: Arithmetic, operations: Operations) -> Program:
    """Compile an arithmetic term; its value is NaN where it has none."""
    match node:
        case Number():
            value = node.value
            return lambda _: value
        case TagValue():
            return operations.read(node.tag)
        case Negate():
            operand = term(node.operand, operations)
            return lambda at: -operand(at)
        case Binary():
            return _binary(node, operations)
        case Call():
            first, *rest = (term(argument, operations) for argument in node.arguments)
            if node.function == "abs":
                return lambda at: abs(first(at))
            if node.function == "sqrt":
                return lambda at: operations.root(first(at))
            return _paired(operations.smaller if node.function == "min" else operations.larger, first, rest[0])
        case _:
            assert_never(node)


def _binary(node: Binary, operations: Operations) -> Program:
    left, right = term(node.left, operations), term(node.right, operations)
    match node.operator:
        case "+":
            return lambda at: left(at) + right(at)
        case "-":
            return lambda at: left(at) - right(at)
        case "*":
            return lambda at: left(at) * right(at)
        case "/":
            return _paired(operations.quotient, left, right)


def _logic(node: Logic, operations: Operations, unknown: float) -> Program:
    """Margin of ``node`` with ``unknown`` (-inf or +inf) for every margin that is not known."""

    def margin(operand: Logic) -> Program:
        return _logic(operand, operations, unknown)

    match node:
        case Comparison():
            return operations.known(_difference(node, operations), unknown)
        case Truth():
            return operations.constant(math.inf if node.value else -math.inf)
        case Not():
            return _negated(_logic(node.operand, operations, -unknown))
        case And():
            return _joined(operations.lowest, [margin(operand) for operand in node.operands])
        case Or():
            return _joined(operations.highest, [margin(operand) for operand in node.operands])
        case Implies():
            premise = _negated(_logic(node.premise, operations, -unknown))
            return _paired(operations.highest, premise, margin(node.conclusion))
        case Always() | Eventually():
            return operations.window(node, margin(node.operand))
        case Until():
            return operations.until(node, margin(node.condition), margin(node.goal))
        case _:
            assert_never(node)


def _difference(node: Comparison, operations: Operations) -> Program:
    left, right, scale = term(node.left, operations), term(node.right, operations), node.scale
    if node.operator == "==":
        return lambda at: -abs(left(at) - right(at)) / scale
    small, large = (left, right) if node.operator in ("<=", "<") else (right, left)
    if scale == 1.0:  # a signal is not divided for nothing
        return lambda at: large(at) - small(at)
    return lambda at: (large(at) - small(at)) / scale


def _negated(operand: Program) -> Program:
    return lambda at: -operand(at)


def _paired(pick: Callable[[Any, Any], Any], first: Program, second: Program) -> Program:
    return lambda at: pick(first(at), second(at))


def _joined(pick: Callable[[Any, Any], Any], operands: list[Program]) -> Program:
    first, *rest = operands
    if len(rest) == 1:
        return _paired(pick, first, rest[0])

    def joined(at: Any) -> Any:
        result = first(at)
        for operand in rest:
            result = pick(result, operand(at))
        return result

    return joined
