"""Names that stand for numbers: a formula may say what a number is, so that the number itself is written once."""

import operator as python
from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, Final, TypeVar, cast

from homeostat.stl.tree import Binary, Negate, Node, Number, TagValue

_N = TypeVar("_N", bound=Node)
_OPERATORS: Final = {"+": python.add, "-": python.sub, "*": python.mul, "/": python.truediv}


def filled(root: _N, values: Mapping[str, float]) -> _N:
    """The tree with numbers in place of the names in ``values``; what only numbers make up becomes one number.

    >>> from homeostat.stl.formula import parse
    >>> from homeostat.stl.text import render
    >>> render(filled(parse("heat <= cp / 1000 * F1").root, {"cp": 4180.0}))
    'heat <= 4.18 * F1'
    """
    return cast(_N, _filled(root, values))


def _filled(node: Node, values: Mapping[str, float]) -> Node:
    if isinstance(node, TagValue):
        return _number(values[node.tag]) if node.tag in values else node
    below = {field.name: _below(getattr(node, field.name), values) for field in fields(node)}
    made: Node = replace(cast(Any, node), **below)
    match made:
        case Binary(operator, Number(a), Number(b)) if operator != "/" or b:
            return _number(_OPERATORS[operator](a, b))
    return made


def _below(part: object, values: Mapping[str, float]) -> object:
    if isinstance(part, tuple):
        return tuple(_below(item, values) for item in part)
    return _filled(part, values) if isinstance(part, Node) else part


def _number(value: float) -> Number | Negate:
    return Number(value) if value >= 0.0 else Negate(Number(-value))
