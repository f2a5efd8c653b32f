"""Tightening: a rule that asks for some margin more than another one, so that it fails while the other still holds."""

from dataclasses import replace
from typing import assert_never

from homeostat.stl.formula import Formula
from homeostat.stl.text import render
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
    Truth,
    Until,
)


def tightened(formula: Formula, by: float) -> Formula:
    """``formula`` with every margin less ``by``, in its unit; the formula itself where ``by`` is 0.

    >>> from homeostat.stl.formula import parse
    >>> str(tightened(parse("P101.idle <= 16 or not (flow <= 2)"), 4.0))
    'P101.idle <= 12 or not (flow <= 6)'
    """
    if by == 0.0:
        return formula
    root = _less(formula.root, by)
    return Formula(render(root), root, formula.unit)


def _less(node: Logic, by: float) -> Logic:
    """``node`` with margins less ``by``; more where it is negative, as what is negated must be."""
    match node:
        case Truth():
            return node
        case Comparison():
            return _compared(node, by * node.scale)
        case Not():
            return Not(_less(node.operand, -by))
        case And() | Or():
            return replace(node, operands=tuple(_less(operand, by) for operand in node.operands))
        case Implies():
            return Implies(_less(node.premise, -by), _less(node.conclusion, by))
        case Always() | Eventually():
            return replace(node, operand=_less(node.operand, by))
        case Until():
            return replace(node, condition=_less(node.condition, by), goal=_less(node.goal, by))
        case _:
            assert_never(node)


def _compared(node: Comparison, by: float) -> Comparison:
    match node.operator:
        case "<=" | "<":
            return replace(node, right=_sum(node.right, -by))
        case ">=" | ">":
            return replace(node, right=_sum(node.right, by))
        case "==":  # its margin is the distance, less than nothing: what asks for more compares the distance
            distance = Call("abs", (Binary("-", node.left, node.right),))
            return replace(node, operator="<=", left=distance, right=_number(-by))
        case _:
            assert_never(node.operator)


def _sum(term: Arithmetic, value: float) -> Arithmetic:
    """``term`` plus ``value``, as one number where it is one."""
    if isinstance(term, Number):
        return _number(term.value + value)
    if isinstance(term, Negate) and isinstance(term.operand, Number):
        return _number(value - term.operand.value)
    return Binary("-" if value < 0.0 else "+", term, Number(abs(value)))


def _number(value: float) -> Number | Negate:
    return Number(value) if value >= 0.0 else Negate(Number(-value))
