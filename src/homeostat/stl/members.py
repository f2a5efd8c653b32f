"""Whether a formula holds for each of many members at one point: guards of an ensemble, second by second."""

from __future__ import annotations

from collections.abc import Mapping
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from homeostat.stl.spelling import near_matches
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

Column = NDArray[np.float64]
"""One value per member, shape (members,), or a scalar array."""


def margins_at(node: Logic, columns: Mapping[str, Column]) -> Column:
    """Signed margin of ``node`` for each member, as `formula_snapshot.margin_at` has it for one.

    Raises `FormulaError` for a missing tag and for a formula that one point cannot decide. A value that is not a number
    gives a margin that is none, which is not >= 0.
    """
    match node:
        case Comparison():
            left, right = _value(node.left, columns), _value(node.right, columns)
            if node.operator in ("<=", "<"):
                difference = right - left
            elif node.operator in (">=", ">"):
                difference = left - right
            else:
                difference = np.abs(left - right) * (-1.0 if node.operator == "==" else 1.0)
            return np.asarray(difference / node.scale)
        case Truth():
            return np.array(np.inf if node.value else -np.inf)
        case Not():
            return -margins_at(node.operand, columns)
        case And():
            return np.asarray(np.minimum.reduce(np.broadcast_arrays(*[margins_at(o, columns) for o in node.operands])))
        case Or():
            return np.asarray(np.maximum.reduce(np.broadcast_arrays(*[margins_at(o, columns) for o in node.operands])))
        case Implies():
            return np.maximum(-margins_at(node.premise, columns), margins_at(node.conclusion, columns))
        case Always() | Eventually() | Until():
            raise FormulaError(f"{render(node)!r} looks ahead, one point cannot decide it; evaluate a trajectory")
        case _:
            assert_never(node)


def _value(node: Arithmetic, columns: Mapping[str, Column]) -> Column:
    match node:
        case TagValue():
            if node.tag not in columns:
                raise FormulaError(f"no value for tag {node.tag!r}{near_matches(node.tag, columns)}")
            return columns[node.tag]
        case Number():
            return np.array(node.value)
        case Negate():
            return -_value(node.operand, columns)
        case Binary():
            left, right = _value(node.left, columns), _value(node.right, columns)
            match node.operator:
                case "+":
                    return left + right
                case "-":
                    return left - right
                case "*":
                    return left * right
                case "/":
                    return left / np.where(right == 0.0, np.nan, right)
        case Call():
            arguments = [_value(argument, columns) for argument in node.arguments]
            if node.function == "abs":
                return np.abs(arguments[0])
            pick = np.minimum if node.function == "min" else np.maximum
            return np.asarray(pick.reduce(np.broadcast_arrays(*arguments)))
        case _:
            assert_never(node)
