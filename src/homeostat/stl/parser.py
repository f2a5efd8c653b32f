"""From text to syntax tree, with errors that name the place."""

import math
import os
import sys
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedCharacters, UnexpectedToken

from homeostat.stl.spelling import near_matches
from homeostat.stl.tree import (
    Always,
    And,
    Arithmetic,
    Binary,
    Call,
    Comparator,
    Comparison,
    Eventually,
    Flaw,
    FormulaError,
    Implies,
    Logic,
    Negate,
    Node,
    Not,
    Number,
    Or,
    TagValue,
    Truth,
    Until,
    negated_equalities,
    walk,
)
from homeostat.stl.units import Signal, check_units

MAX_DEPTH = 100
"""Deepest nesting of operators; every recursive pass over a tree stays far inside Python's own limit."""

_ALWAYS_HOLDS = "can never be violated; write a distance, as in abs(a - b) >= 0.5"

_Start = Literal["formula", "expression"]
_Bounds = tuple[float, float]
_UNBOUNDED: _Bounds = (0.0, math.inf)


def read_logic(text: str, tags: Mapping[str, Signal] | None) -> Logic:
    """The tree of a condition; tags are checked when given. Raises `FormulaError`."""
    root: Logic = _read(text, "formula", tags)
    return root


def read_arithmetic(text: str, tags: Mapping[str, Signal] | None) -> Arithmetic:
    """The tree of an arithmetic term; tags are checked when given. Raises `FormulaError`."""
    root: Arithmetic = _read(text, "expression", tags)
    return root


def _read(text: str, start: _Start, tags: Mapping[str, Signal] | None) -> Any:
    if not isinstance(text, str):
        raise FormulaError(f"{start} {_shorten(repr(text))} must be a text, as 'T1 <= 313'")
    try:
        root = _parse(text, start)
        _check(root, tags)
    except Flaw as flaw:
        raise FormulaError(f"{start} {_shorten(text)!r}, {_place(text, flaw.position)}: {flaw}") from None
    return root


def _parse(text: str, start: _Start) -> Any:
    try:
        return _parser().parse(text, start=start)
    except UnexpectedCharacters as error:
        index = error.pos_in_stream or 0
        raise Flaw(index + 1, _stray(text[index])) from None
    except UnexpectedToken as error:
        raise Flaw(*_misplaced(text, error)) from None


def _check(root: Node, tags: Mapping[str, Signal] | None) -> None:
    for node, depth in walk(root):
        if depth > MAX_DEPTH:
            raise Flaw(1, f"nested deeper than {MAX_DEPTH} operators; split it into several rules")
        if tags is not None and isinstance(node, TagValue) and node.tag not in tags:
            raise Flaw(node.column, f"unknown tag {_shorten(node.tag)!r}{near_matches(node.tag, tags)}")
    for equality in negated_equalities(root):
        raise Flaw(equality.column, f"a negated '==' {_ALWAYS_HOLDS}")
    if tags is not None:
        check_units(root, tags)


@cache
def _parser() -> Lark:
    grammar = files(__package__).joinpath("grammar.lark").read_text(encoding="utf-8")
    # The basic lexer keeps keywords reserved everywhere; the contextual one would read a misplaced `and` as a tag.
    # Its tables are kept beside this module's byte code, where somebody may write there: making them takes longer than
    # reading a plant's formulas.
    beside = Path(__file__).parent / "__pycache__"
    tables = str(beside / f"grammar.{sys.implementation.cache_tag}.lalr") if os.access(beside, os.W_OK) else False
    return Lark(
        grammar, parser="lalr", lexer="basic", start=["formula", "expression"], transformer=_Builder(), cache=tables
    )


def _float(token: Token) -> float:
    value = float(token)
    if math.isinf(value):
        raise Flaw(_position(token), f"number {_shorten(str(token))!r} is too large; the limit is 1.8e308")
    return value


def _position(token: Token) -> int:
    return (token.start_pos or 0) + 1


@v_args(inline=True)
class _Builder(Transformer[Token, Node]):
    """Builds the tree while the parser reads, so that no pass recurses over text of unknown depth."""

    def number(self, token: Token) -> Number:
        return Number(_float(token))

    def tag(self, token: Token) -> TagValue:
        return TagValue(str(token), _position(token))

    def negate(self, operand: Arithmetic) -> Negate:
        return Negate(operand)

    def add(self, left: Arithmetic, right: Arithmetic) -> Binary:
        return Binary("+", left, right)

    def subtract(self, left: Arithmetic, right: Arithmetic) -> Binary:
        return Binary("-", left, right)

    def multiply(self, left: Arithmetic, right: Arithmetic) -> Binary:
        return Binary("*", left, right)

    def divide(self, left: Arithmetic, right: Arithmetic) -> Binary:
        return Binary("/", left, right)

    def absolute(self, operand: Arithmetic) -> Call:
        return Call("abs", (operand,))

    def root(self, operand: Arithmetic) -> Call:
        return Call("sqrt", (operand,))

    def minimum(self, left: Arithmetic, right: Arithmetic) -> Call:
        return Call("min", (left, right))

    def maximum(self, left: Arithmetic, right: Arithmetic) -> Call:
        return Call("max", (left, right))

    def comparison(self, left: Arithmetic, operator: Token, right: Arithmetic) -> Comparison:
        if operator == "!=":
            raise Flaw(_position(operator), f"'!=' {_ALWAYS_HOLDS}")
        symbol: Comparator = operator.value
        return Comparison(symbol, left, right, column=_position(operator))

    def true(self) -> Truth:
        return Truth(True)

    def false(self) -> Truth:
        return Truth(False)

    def negation(self, operand: Logic) -> Not:
        return Not(operand)

    def conjoin(self, *operands: Logic) -> And:
        return And(operands)

    def disjoin(self, *operands: Logic) -> Or:
        return Or(operands)

    def implies(self, premise: Logic, conclusion: Logic) -> Implies:
        return Implies(premise, conclusion)

    def bound(self, token: Token) -> tuple[float, int]:
        return _float(token), _position(token)

    def negative_bound(self, token: Token) -> None:
        raise Flaw(_position(token) - 1, f"bound -{token} s is negative; a formula looks ahead, bounds are >= 0 s")

    def bounds(self, low: tuple[float, int], high: tuple[float, int]) -> _Bounds:
        if low[0] > high[0]:
            raise Flaw(low[1], f"bounds [{low[0]:g},{high[0]:g}] s are reversed; write the smaller one first")
        return low[0], high[0]

    def always(self, bounds: _Bounds | None, operand: Logic) -> Always:
        return Always(operand, *(bounds or _UNBOUNDED))

    def eventually(self, bounds: _Bounds | None, operand: Logic) -> Eventually:
        return Eventually(operand, *(bounds or _UNBOUNDED))

    def until(self, condition: Logic, bounds: _Bounds | None, goal: Logic) -> Until:
        return Until(condition, goal, *(bounds or _UNBOUNDED))


_ADVICE = {
    "=": "write '==' for equality or '<=' for a limit",
    "&": "write 'and'",
    "|": "write 'or' (or abs(...) for an absolute value)",
    "!": "write 'not'",
    "^": "powers are not supported; write a product",
    "{": "write '('",
    "}": "write ')'",
}
_GROUPS = (
    ("a tag", {"NAME"}),
    ("a number", {"NUMBER"}),
    ("a comparison such as '<='", {"COMPARATOR"}),
    ("an operator", {"PLUS", "MINUS", "STAR", "SLASH"}),
    ("a connective such as 'and'", {"AND", "OR", "IMPLIES", "UNTIL"}),
    ("'('", {"LPAR"}),
    ("')'", {"RPAR"}),
    ("','", {"COMMA"}),
    ("']'", {"RSQB"}),
    ("the end", {"$END"}),
)


def _stray(character: str) -> str:
    advice = _ADVICE.get(character)
    return f"unexpected character {character!r}" + (f"; {advice}" if advice else "")


def _misplaced(text: str, error: UnexpectedToken) -> tuple[int, str]:
    token: Token = error.token
    accepts = set(error.accepts or error.expected)
    if token.type == "$END":
        if "RPAR" in accepts:
            return _opened(text)[-1], "this '(' is never closed"
        return len(text.rstrip()) + 1, f"unexpected end; expected {_expected(accepts)}"
    if token.type == "RPAR" and not _opened(text[: _position(token) - 1]):
        return _position(token), "this ')' closes nothing"
    if token.type == "COMPARATOR" and "AND" in accepts:
        return _position(token), "comparisons cannot be chained; write 'a <= x and x <= b'"
    if token.type == "UNTIL" and "AND" in accepts:
        return _position(token), "'until' cannot be chained; add parentheses"
    return _position(token), f"unexpected {_shorten(str(token))!r}; expected {_expected(accepts)}"


def _expected(accepts: set[str]) -> str:
    if "NAME" in accepts:  # then '(' and a minus sign only begin a value, which is said already
        accepts = accepts - {"LPAR", "MINUS"}
    words = [word for word, terminals in _GROUPS if terminals & accepts]
    return ", ".join(words[:-1]) + " or " + words[-1] if len(words) > 1 else words[0]


def _opened(text: str) -> list[int]:
    """Positions of the opening parentheses that have no partner in ``text``."""
    opened: list[int] = []
    for position, character in enumerate(text, start=1):
        if character == "(":
            opened.append(position)
        elif character == ")" and opened:
            opened.pop()
    return opened


def _place(text: str, position: int) -> str:
    before = text[: position - 1]
    line, column = before.count("\n") + 1, position - (before.rfind("\n") + 1)
    return f"column {column}" if "\n" not in text else f"line {line}, column {column}"


def _shorten(text: str) -> str:
    return text if len(text) <= 120 else text[:117] + "..."
