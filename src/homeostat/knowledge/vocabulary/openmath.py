"""Equations as OpenMath trees: applications, symbols, variables and literals with names instead of blank nodes.

``EQ-HEAT`` with the text ``Q = UA * x`` becomes an ``M:Application`` of ``relation1#eq`` to ``Q`` and a product. A
result ``dV/dt`` is the derivative of ``V`` with respect to time. A node below ``E`` is called ``E.1``, ``E.2.1``, ...
by its place; variables are shared by all equations of a plant and say what they denote.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Final, assert_never

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.knowledge.vocabulary.vocabulary import HS, RDF, M
from homeostat.stl.formula import parse_expression
from homeostat.stl.tree import Arithmetic, Binary, Call, Negate, Number, TagValue

_CD: Final = "http://www.openmath.org/cd/"
_BINARY: Final = {"+": "arith1#plus", "-": "arith1#minus", "*": "arith1#times", "/": "arith1#divide"}
_CALL: Final = {"abs": "arith1#abs", "min": "minmax1#min", "max": "minmax1#max"}
_RATE: Final = re.compile(r"d(\w+)/dt")


def split(text: str) -> tuple[str, str]:
    """Left and right side of an equation's text; ValueError where it has no `` = ``."""
    left, equals, right = text.partition(" = ")
    if not equals or not left.strip() or not right.strip():
        raise ValueError(f"equation {text!r} must read 'result = expression'")
    return left.strip(), right.strip()


def equation(node: NamedNode, text: str, denoted: Mapping[str, NamedNode]) -> Iterator[Triple]:
    """The triples below ``node``, which stands for the equation ``text``.

    ``denoted`` says what the names of tags and parameters denote. Raises `FormulaError` where the right side cannot be
    read and ValueError where there is none.
    """
    left, right = split(text)
    rate = _RATE.fullmatch(left)
    result = _Rate(rate[1]) if rate else TagValue(left)
    yield from _apply(node, "relation1#eq", (result, parse_expression(right).root), denoted)


class _Rate:
    """The derivative of a variable with respect to time."""

    def __init__(self, name: str) -> None:
        self.variable = TagValue(name)


def _apply(
    node: NamedNode, symbol: str, arguments: tuple[Arithmetic | _Rate, ...], denoted: Mapping[str, NamedNode]
) -> Iterator[Triple]:
    operator = NamedNode(_CD + symbol)
    yield Triple(node, RDF.type, M.Application)
    yield Triple(node, M.operator, operator)
    yield Triple(operator, RDF.type, M.Symbol)
    cells = [NamedNode(f"{node.value}.list{place}") for place in range(1, len(arguments) + 1)]
    yield Triple(node, M.arguments, cells[0])
    for place, (cell, argument) in enumerate(zip(cells, arguments, strict=True), start=1):
        item = _name(NamedNode(f"{node.value}.{place}"), argument)
        yield Triple(cell, RDF.type, M.ObjectList)
        yield Triple(cell, RDF.first, item)
        yield Triple(cell, RDF.rest, cells[place] if place < len(cells) else RDF.nil)
        yield from _object(item, argument, denoted)


def _name(node: NamedNode, argument: Arithmetic | _Rate) -> NamedNode:
    """What the object at place ``node`` is called: its place, but a variable is the same everywhere in the plant."""
    if isinstance(argument, TagValue):
        namespace, _, _ = node.value.rpartition("#")
        return NamedNode(f"{namespace}#variable_{argument.tag}")
    return node


def _object(node: NamedNode, term: Arithmetic | _Rate, denoted: Mapping[str, NamedNode]) -> Iterator[Triple]:
    match term:
        case Number():
            yield Triple(node, RDF.type, M.Literal)
            yield Triple(node, M.value, Literal(term.value))
        case TagValue():
            yield Triple(node, RDF.type, M.Variable)
            yield Triple(node, M.name, Literal(term.tag))
            if term.tag in denoted:
                yield Triple(node, HS.denotes, denoted[term.tag])
        case Negate():
            yield from _apply(node, "arith1#unary_minus", (term.operand,), denoted)
        case Binary():
            yield from _apply(node, _BINARY[term.operator], (term.left, term.right), denoted)
        case Call():
            yield from _apply(node, _CALL[term.function], term.arguments, denoted)
        case _Rate():
            yield from _apply(node, "calculus1#diff", (term.variable,), denoted)
        case _:
            assert_never(term)
