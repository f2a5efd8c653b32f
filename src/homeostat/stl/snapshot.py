"""Margin of a formula at one point: plain floats, for guards on a snapshot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import assert_never

from homeostat.stl.spelling import near_matches
from homeostat.stl.text import render
from homeostat.stl.tree import (
    Always,
    And,
    Arithmetic,
    Binary,
    Call,
    Comparator,
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


def margin_at(node: Logic, values: Mapping[str, float]) -> float:
    """Signed margin of ``node`` on one value per tag. Raises `FormulaError` where one point cannot decide."""
    match node:
        case Comparison():
            margin = _difference(node.operator, value_at(node.left, values), value_at(node.right, values))
            if math.isnan(margin):
                raise FormulaError(f"comparison {render(node)!r} is not a number: it subtracts infinity from infinity")
            return margin / node.scale
        case Truth():
            return math.inf if node.value else -math.inf
        case Not():
            return -margin_at(node.operand, values)
        case And():
            return min([margin_at(operand, values) for operand in node.operands])
        case Or():
            return max([margin_at(operand, values) for operand in node.operands])
        case Implies():
            return max(-margin_at(node.premise, values), margin_at(node.conclusion, values))
        case Always() | Eventually() | Until():
            raise FormulaError(f"{render(node)!r} looks ahead, one point cannot decide it; evaluate a trajectory")
        case _:
            assert_never(node)


def value_at(node: Arithmetic, values: Mapping[str, float]) -> float:
    """Value of a term on one value per tag. Raises `FormulaError` for a missing tag, NaN or division by zero."""
    match node:
        case TagValue():
            return _reading(node.tag, values)
        case Number():
            return node.value
        case Negate():
            return -value_at(node.operand, values)
        case Binary():
            return _binary(node, value_at(node.left, values), value_at(node.right, values))
        case Call():
            arguments = [value_at(argument, values) for argument in node.arguments]
            if node.function == "abs":
                return abs(arguments[0])
            return min(arguments) if node.function == "min" else max(arguments)
        case _:
            assert_never(node)


def _reading(tag: str, values: Mapping[str, float]) -> float:
    if tag not in values:
        raise FormulaError(f"no value for tag {tag!r}{near_matches(tag, values)}")
    value = float(values[tag])
    if math.isnan(value):
        raise FormulaError(f"value of tag {tag!r} is not a number (NaN)")
    return value


def _binary(node: Binary, left: float, right: float) -> float:
    match node.operator:
        case "+":
            result = left + right
        case "-":
            result = left - right
        case "*":
            result = left * right
        case "/":
            if right == 0.0:
                raise FormulaError(f"{render(node)!r} divides by zero; rewrite it as a product")
            result = left / right
    if math.isnan(result):
        raise FormulaError(f"{render(node)!r} is not a number: {left!r} {node.operator} {right!r}")
    return result


def _difference(operator: Comparator, left: float, right: float) -> float:
    match operator:
        case "<=" | "<":
            return right - left
        case ">=" | ">":
            return left - right
        case "==":
            return -abs(left - right)
        case "!=":
            return abs(left - right)
