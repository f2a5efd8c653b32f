"""Syntax tree of the rule language: what a parsed formula is made of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias, assert_never


class FormulaError(ValueError):
    """A formula that cannot be read, or cannot be evaluated on the given signals; the message says where and why."""


class Flaw(Exception):
    """What is wrong at one place of a formula's text; the reader makes a `FormulaError` of it."""

    def __init__(self, position: int, message: str) -> None:
        """``position`` counts the characters of the text from 1."""
        super().__init__(message)
        self.position = position


@dataclass(frozen=True, slots=True)
class Number:
    """A constant."""

    value: float
    """Finite and >= 0; a minus sign is a `Negate`."""


@dataclass(frozen=True, slots=True)
class TagValue:
    """The value of a tag at the current sample."""

    tag: str
    """Name of the tag."""
    column: int = field(default=0, compare=False)
    """Offset of the name in the formula's text, counted from 1; 0 when unknown. Not part of equality."""


@dataclass(frozen=True, slots=True)
class Negate:
    """Arithmetic minus."""

    operand: Arithmetic
    """What is negated."""


@dataclass(frozen=True, slots=True)
class Binary:
    """Sum, difference, product or quotient."""

    operator: Literal["+", "-", "*", "/"]
    """Which one."""
    left: Arithmetic
    """Left operand."""
    right: Arithmetic
    """Right operand."""


@dataclass(frozen=True, slots=True)
class Call:
    """Absolute value or square root of one operand, smaller or larger of two."""

    function: Literal["abs", "sqrt", "min", "max"]
    """Which one."""
    arguments: tuple[Arithmetic, ...]
    """One operand for ``abs`` and ``sqrt``, two for ``min`` and ``max``."""


@dataclass(frozen=True, slots=True)
class Truth:
    """``true`` (margin +inf) or ``false`` (margin -inf)."""

    value: bool
    """Which one."""


Comparator: TypeAlias = Literal["<=", "<", ">=", ">", "=="]


@dataclass(frozen=True, slots=True)
class Comparison:
    """A comparison of two arithmetic terms; the only place where a margin is born."""

    operator: Comparator
    """Which one; strict and non-strict have the same margin."""
    left: Arithmetic
    """Left operand."""
    right: Arithmetic
    """Right operand."""
    scale: float = 1.0
    """What the difference is divided by; 1 unless the formula mixes units."""
    column: int = field(default=0, compare=False)
    """Offset of the operator in the formula's text, counted from 1; 0 when unknown. Not part of equality."""
    unit: str = field(default="", compare=False)
    """Unit of what is compared where the formula mixes units; empty elsewhere, and where it is not known."""


@dataclass(frozen=True, slots=True)
class Not:
    """Logical negation."""

    operand: Logic
    """What is negated."""


@dataclass(frozen=True, slots=True)
class And:
    """Conjunction of two or more conditions."""

    operands: tuple[Logic, ...]
    """The conditions, as written from left to right."""


@dataclass(frozen=True, slots=True)
class Or:
    """Disjunction of two or more conditions."""

    operands: tuple[Logic, ...]
    """The conditions, as written from left to right."""


@dataclass(frozen=True, slots=True)
class Implies:
    """Whenever the premise holds, so does the conclusion."""

    premise: Logic
    """Left side."""
    conclusion: Logic
    """Right side."""


@dataclass(frozen=True, slots=True)
class Always:
    """The condition holds at every sample of the window."""

    operand: Logic
    """The condition."""
    low_s: float = 0.0
    """Start of the window, seconds from now."""
    high_s: float = math.inf
    """End of the window (included), seconds from now."""


@dataclass(frozen=True, slots=True)
class Eventually:
    """The condition holds at some sample of the window."""

    operand: Logic
    """The condition."""
    low_s: float = 0.0
    """Start of the window, seconds from now."""
    high_s: float = math.inf
    """End of the window (included), seconds from now."""


@dataclass(frozen=True, slots=True)
class Until:
    """The goal holds at some sample of the window, and the condition at every sample from now to just before it."""

    condition: Logic
    """What must hold until then."""
    goal: Logic
    """What must come."""
    low_s: float = 0.0
    """Start of the window, seconds from now."""
    high_s: float = math.inf
    """End of the window (included), seconds from now."""


Arithmetic: TypeAlias = Number | TagValue | Negate | Binary | Call
Logic: TypeAlias = Truth | Comparison | Not | And | Or | Implies | Always | Eventually | Until
Node: TypeAlias = Arithmetic | Logic


def children(node: Node) -> tuple[Node, ...]:
    """The direct operands of a node, from left to right."""
    match node:
        case Number() | TagValue() | Truth():
            return ()
        case Negate() | Not() | Always() | Eventually():
            return (node.operand,)
        case Binary() | Comparison():
            return (node.left, node.right)
        case Call():
            return node.arguments
        case And() | Or():
            return node.operands
        case Implies():
            return (node.premise, node.conclusion)
        case Until():
            return (node.condition, node.goal)
        case _:
            assert_never(node)


def walk(root: Node) -> Iterator[tuple[Node, int]]:
    """Every node below and including ``root`` with its depth (the root has 1), in reading order; not recursive."""
    stack = [(root, 1)]
    while stack:
        node, depth = stack.pop()
        yield node, depth
        stack.extend((child, depth + 1) for child in reversed(children(node)))


def negated_equalities(root: Node) -> Iterator[Comparison]:
    """Every ``==`` below ``root`` that is negated once negations are pushed inwards; not recursive."""
    stack = [(root, False)]
    while stack:
        node, negated = stack.pop()
        match node:
            case Comparison() if negated and node.operator == "==":
                yield node
            case Not():
                stack.append((node.operand, not negated))
            case Implies():
                stack += [(node.conclusion, negated), (node.premise, not negated)]
            case _:
                stack += [(child, negated) for child in reversed(children(node))]


def tags_of(root: Node) -> frozenset[str]:
    """Names of the tags that occur below ``root``."""
    return frozenset(node.tag for node, _ in walk(root) if isinstance(node, TagValue))


def horizon_of(root: Node) -> float:
    """How many seconds after the current sample ``root`` looks; ``inf`` when it is unbounded."""
    below = max((horizon_of(child) for child in children(root)), default=0.0)
    return below + root.high_s if isinstance(root, Always | Eventually | Until) else below
