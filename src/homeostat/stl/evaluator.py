"""Quantitative robustness of a formula on sampled signals, for many ensemble members at once.

Discrete-time signal temporal logic (Donzé and Maler, "Robust satisfaction of temporal logic over real-valued signals",
FORMATS 2010), on traces that end: a window is clipped to the samples there are, `always` over an empty window is +inf
and `eventually` or `until` over an empty window is -inf. Only the samples that the asked-for result depends on are
computed.
"""

from __future__ import annotations

import math
from functools import reduce
from typing import assert_never

import numpy as np

from homeostat.stl.signals import Signals, place
from homeostat.stl.text import render
from homeostat.stl.tree import (
    Always,
    And,
    Arithmetic,
    Binary,
    Call,
    Comparison,
    Eventually,
    FormulaError,
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
from homeostat.stl.windows import (
    HIGHEST,
    LOWEST,
    Decided,
    Extreme,
    FloatArray,
    better,
    constant,
    over_windows,
    padded,
)


def robustness(node: Logic, signals: Signals, start: int, stop: int, timed: bool) -> Decided:
    """Margins of ``node`` at samples ``start`` to ``stop - 1``; with the deciding samples when ``timed``.

    The result has shape (members or 1, stop - start). Raises `FormulaError` for a bound that is no multiple of the
    sampling period, a division by zero or a margin that is not a number.
    """

    def margins(operand: Logic) -> Decided:
        return robustness(operand, signals, start, stop, timed)

    match node:
        case Comparison():
            here = np.arange(start, stop)[np.newaxis] if timed else None
            return Decided(_comparison(node, signals, start, stop), here)
        case Truth():
            return constant(math.inf if node.value else -math.inf, stop - start, timed)
        case Not():
            return _negated(margins(node.operand))
        case And():
            return reduce(lambda first, second: better(LOWEST, first, second), map(margins, node.operands))
        case Or():
            return reduce(lambda first, second: better(HIGHEST, first, second), map(margins, node.operands))
        case Implies():
            return better(HIGHEST, _negated(margins(node.premise)), margins(node.conclusion))
        case Always():
            return _window(LOWEST, node, signals, start, stop, timed)
        case Eventually():
            return _window(HIGHEST, node, signals, start, stop, timed)
        case Until():
            return _until(node, signals, start, stop, timed)
        case _:
            assert_never(node)


def term(node: Arithmetic, signals: Signals, start: int, stop: int) -> FloatArray:
    """Values of an arithmetic term at samples ``start`` to ``stop - 1``; shape (members or 1, stop - start or 1)."""
    match node:
        case Number():
            return np.full((1, 1), node.value)
        case TagValue():
            return signals.arrays[node.tag][:, start:stop]
        case Negate():
            return -term(node.operand, signals, start, stop)
        case Binary():
            return _binary(node, signals, start, stop)
        case Call():
            arguments = [term(argument, signals, start, stop) for argument in node.arguments]
            if node.function == "abs":
                return np.abs(arguments[0])
            return (np.minimum if node.function == "min" else np.maximum)(*arguments)
        case _:
            assert_never(node)


def _binary(node: Binary, signals: Signals, start: int, stop: int) -> FloatArray:
    left, right = term(node.left, signals, start, stop), term(node.right, signals, start, stop)
    with np.errstate(all="ignore"):  # infinities are legal values, and NaN is refused below with its place
        match node.operator:
            case "+":
                result = left + right
            case "-":
                result = left - right
            case "*":
                result = left * right
            case "/":
                if not right.all():
                    where = place(right == 0.0, start, signals.dt_s)
                    raise FormulaError(f"{render(node)!r} divides by zero at {where}; rewrite it as a product")
                result = left / right
    if np.isnan(result.min()):
        raise FormulaError(f"{render(node)!r} is not a number (NaN) at {place(np.isnan(result), start, signals.dt_s)}")
    return result


def _comparison(node: Comparison, signals: Signals, start: int, stop: int) -> FloatArray:
    left, right = term(node.left, signals, start, stop), term(node.right, signals, start, stop)
    with np.errstate(all="ignore"):
        match node.operator:
            case "<=" | "<":
                margin = right - left
            case ">=" | ">":
                margin = left - right
            case "==":
                margin = -np.abs(left - right)
            case "!=":
                margin = np.abs(left - right)
    if np.isnan(margin.min()):
        where = place(np.isnan(margin), start, signals.dt_s)
        raise FormulaError(f"comparison {render(node)!r} subtracts infinity from infinity at {where}")
    if node.scale != 1.0:
        margin = margin / node.scale
    return margin if margin.shape[1] == stop - start else np.repeat(margin, stop - start, axis=1)


def _negated(signal: Decided) -> Decided:
    return Decided(-signal.value, signal.at)


def _window(
    extreme: Extreme, node: Always | Eventually, signals: Signals, start: int, stop: int, timed: bool
) -> Decided:
    low, high = _steps(node, signals)
    first, last = start + low, min(stop - 1 + high, signals.samples - 1)
    if first > last:
        return constant(extreme.empty, stop - start, timed)
    operand = robustness(node.operand, signals, first, last + 1, timed)
    return over_windows(extreme, operand, high - low + 1, stop - start)


def _until(node: Until, signals: Signals, start: int, stop: int, timed: bool) -> Decided:
    """Per sample the best goal of the window, held back by the worst condition from the sample to just before it."""
    low, high = _steps(node, signals)
    high = min(high, signals.samples - 1 - start)
    width = stop - start
    if low > high:
        return constant(HIGHEST.empty, width, timed)
    end = min(stop + high, signals.samples)
    goal = padded(HIGHEST, robustness(node.goal, signals, start, end, timed), width + high)
    condition = padded(LOWEST, robustness(node.condition, signals, start, end, timed), width + high)
    best = worst = None
    for ahead in range(high + 1):
        if ahead:
            before = condition.cut(ahead - 1, ahead - 1 + width)
            worst = before if worst is None else better(LOWEST, worst, before)
        if ahead >= low:
            reached = goal.cut(ahead, ahead + width)
            reached = reached if worst is None else better(LOWEST, worst, reached)
            best = reached if best is None else better(HIGHEST, best, reached)
    assert best is not None  # low <= high, so the window has at least one sample
    return best


def _steps(node: Always | Eventually | Until, signals: Signals) -> tuple[int, int]:
    """The bounds in samples, no further than the trace is long."""
    return _step(node, node.low_s, signals), _step(node, node.high_s, signals)


def _step(node: Always | Eventually | Until, bound_s: float, signals: Signals) -> int:
    steps = bound_s / signals.dt_s
    if math.isinf(steps):
        return signals.samples
    if abs(round(steps) * signals.dt_s - bound_s) > 1e-9 * max(bound_s, signals.dt_s):
        raise FormulaError(
            f"bound {bound_s:g} s of {render(node)!r} is no multiple of the sampling period {signals.dt_s:g} s"
        )
    return min(round(steps), signals.samples)
