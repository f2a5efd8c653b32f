"""Canonical text of a syntax tree; reading it back gives the same tree."""

import math
from typing import assert_never

from homeostat.stl.tree import (
    Always,
    And,
    Binary,
    Call,
    Comparison,
    Eventually,
    Implies,
    Negate,
    Node,
    Not,
    Number,
    Or,
    TagValue,
    Truth,
    Until,
)


def render(node: Node) -> str:
    """The node as text, with no more parentheses than reading it back or reading it aloud needs."""
    match node:
        case Number():
            return _number(node.value)
        case TagValue():
            return node.tag
        case Negate():
            return f"-{_at_least(node.operand, _tightness(node))}"
        case Binary():
            # The parser groups to the left, so a right operand of the same kind needs its parentheses.
            own = _tightness(node)
            return f"{_at_least(node.left, own)} {node.operator} {_at_least(node.right, own + 1)}"
        case Call():
            return f"{node.function}({', '.join(map(render, node.arguments))})"
        case Truth():
            return "true" if node.value else "false"
        case Comparison():
            return f"{render(node.left)} {node.operator} {render(node.right)}"
        case Not():
            return f"not ({render(node.operand)})"
        case And() | Or():
            word = " and " if isinstance(node, And) else " or "
            return word.join(_at_least(operand, _tightness(node) + 1) for operand in node.operands)
        case Implies():
            own = _tightness(node)
            return f"{_at_least(node.premise, own + 1)} implies {_at_least(node.conclusion, own)}"
        case Always() | Eventually():
            word = "always" if isinstance(node, Always) else "eventually"
            return f"{word}{_bounds(node)}({render(node.operand)})"
        case Until():
            return f"({render(node.condition)}) until{_bounds(node)} ({render(node.goal)})"
        case _:
            assert_never(node)


def _tightness(node: Node) -> int:
    """How strongly the node's text holds together: a looser operand needs parentheses."""
    match node:
        case Implies():
            return 1
        case Or():
            return 2
        case And():
            return 3
        case Until():
            return 4
        case Binary(operator="+" | "-"):
            return 6
        case Binary():
            return 7
        case Negate():
            return 8
        case _:
            return 9


def _at_least(node: Node, tightness: int) -> str:
    text = render(node)
    return text if _tightness(node) >= tightness else f"({text})"


def _number(value: float) -> str:
    return repr(value).removesuffix(".0")


def _bounds(node: Always | Eventually | Until) -> str:
    if node.low_s == 0.0 and math.isinf(node.high_s):
        return ""
    return f"[{_number(node.low_s)},{_number(node.high_s)}]"
