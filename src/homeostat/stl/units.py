"""Which unit a formula's margin has, and what each comparison is divided by where units mix."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol, assert_never

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
    tags_of,
    walk,
)


class Signal(Protocol):
    """What a unit check needs to know of a tag."""

    @property
    def unit(self) -> str:
        """Unit symbol; ``1`` for a fraction."""
        ...

    @property
    def scale(self) -> float:
        """What counts as one unit of margin where a formula mixes units, in the tag's unit; > 0."""
        ...


_PRODUCT = "*"
"""Stands for the unit of a product or quotient of tags, which is never worked out: it counts as mixed."""


def with_scales(root: Logic, tags: Mapping[str, Signal]) -> tuple[Logic, str]:
    """The tree with every comparison scaled as its units demand, and the unit of its margin.

    All comparisons in one unit: nothing is scaled and the margin has that unit. Otherwise each comparison is divided
    by the largest scale of its tags and the unit is ``1``. A plain number takes the unit of what it is compared with
    and may multiply or divide a tag without changing its unit; a product or quotient of tags counts as mixed.
    """
    units: set[str] = set()
    for node, _ in walk(root):
        if isinstance(node, Comparison):
            units |= _units(node.left, tags) | _units(node.right, tags)
    if units == {_PRODUCT} or len(units) > 1:
        return _scaled(root, tags), "1"
    return root, units.pop() if units else "1"


def _units(node: Arithmetic, tags: Mapping[str, Signal]) -> set[str]:
    match node:
        case Number():
            return set()
        case TagValue():
            return {tags[node.tag].unit}
        case Negate():
            return _units(node.operand, tags)
        case Call():
            return set().union(*(_units(argument, tags) for argument in node.arguments))
        case Binary():
            left, right = _units(node.left, tags), _units(node.right, tags)
            by_number = not right or (node.operator == "*" and not left)
            return left | right if node.operator in "+-" or by_number else {_PRODUCT}
        case _:
            assert_never(node)


def _scaled(node: Logic, tags: Mapping[str, Signal]) -> Logic:
    match node:
        case Truth():
            return node
        case Comparison():
            return replace(node, scale=max((tags[name].scale for name in tags_of(node)), default=1.0))
        case Not() | Always() | Eventually():
            return replace(node, operand=_scaled(node.operand, tags))
        case And() | Or():
            return replace(node, operands=tuple(_scaled(operand, tags) for operand in node.operands))
        case Implies():
            return Implies(_scaled(node.premise, tags), _scaled(node.conclusion, tags))
        case Until():
            return replace(node, condition=_scaled(node.condition, tags), goal=_scaled(node.goal, tags))
        case _:
            assert_never(node)
