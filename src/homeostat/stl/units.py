"""Units of a formula: what may be added and compared, the unit of its margin, and what scales it where units mix."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol, assert_never

from homeostat.stl.text import render
from homeostat.stl.tree import (
    Always,
    And,
    Arithmetic,
    Binary,
    Call,
    Comparison,
    Eventually,
    Flaw,
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
    children,
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


def in_unit(unit: str) -> str:
    """What a message appends to a number in ``unit``: a space and the unit, and nothing to a share, whose unit is 1."""
    return "" if unit in ("", "1") else f" {unit}"


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
        case Call(function="sqrt"):
            return {_PRODUCT} if _units(node.arguments[0], tags) else set()
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
            unit = _common(node.left, node.right, tags)
            scale = max((tags[name].scale for name in tags_of(node)), default=1.0)
            return replace(node, scale=scale, unit="" if unit is None else unit.symbol)
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


@dataclass(frozen=True, slots=True)
class _Unit:
    """Unit of a term that is worked out."""

    symbol: str
    """As a person reads it."""
    powers: Mapping[str, int]
    """Base symbol -> its power, none of them zero."""


def check_units(root: Node, tags: Mapping[str, Signal]) -> None:
    """Raise `Flaw` where terms of different units are added, subtracted, compared, or the smaller or larger is taken.

    A number has the unit of its partner. As a factor it may convert anything into anything: coefficients carry units
    that nobody wrote down, so such a product has an unknown unit, which goes with any other.
    """
    if isinstance(root, Number | TagValue | Negate | Binary | Call):
        _unit(root, tags)
    elif isinstance(root, Comparison):
        _common(root.left, root.right, tags)
    else:
        for child in children(root):
            check_units(child, tags)


def _unit(node: Arithmetic, tags: Mapping[str, Signal]) -> _Unit | None:
    """The unit of a term; None where it is unknown."""
    match node:
        case Number():
            return None
        case TagValue():
            symbol = tags[node.tag].unit
            return _Unit(symbol, _powers(symbol)) if symbol else None
        case Negate():
            return _unit(node.operand, tags)
        case Call(function="abs"):
            return _unit(node.arguments[0], tags)
        case Call(function="sqrt"):
            return _rooted(node, _unit(node.arguments[0], tags))
        case Call():
            return _common(node.arguments[0], node.arguments[1], tags)
        case Binary(operator="+" | "-"):
            return _common(node.left, node.right, tags)
        case Binary():
            return _multiplied(node, _unit(node.left, tags), _unit(node.right, tags))
        case _:
            assert_never(node)


def _common(left: Arithmetic, right: Arithmetic, tags: Mapping[str, Signal]) -> _Unit | None:
    first, second = _unit(left, tags), _unit(right, tags)
    if first is None or second is None:
        return first or second
    if first.powers != second.powers:
        column = next((node.column for node, _ in walk(right) if isinstance(node, TagValue)), 0)
        units = f"{render(left)!r} is in {first.symbol} and {render(right)!r} in {second.symbol}"
        raise Flaw(max(column, 1), f"{units}; convert one of them with a coefficient, or split the rule")
    return first


def _rooted(node: Call, of: _Unit | None) -> _Unit | None:
    """Half the powers of ``of``; unknown where one of them is odd, which no table can write."""
    if of is None or any(power % 2 for power in of.powers.values()):
        return None
    return _Unit(render(node), {symbol: power // 2 for symbol, power in of.powers.items()})


def _multiplied(node: Binary, left: _Unit | None, right: _Unit | None) -> _Unit | None:
    if left is None or right is None:
        return None
    sign = 1 if node.operator == "*" else -1
    powers = Counter(left.powers)
    for symbol, power in right.powers.items():
        powers[symbol] += sign * power
    symbol = left.symbol if not right.powers else f"{left.symbol} {node.operator} {right.symbol}"
    return _Unit(symbol, _plain(powers))


_FACTOR = re.compile(r"(?P<symbol>[^\W\d]+|%)(?P<power>-?[0-9]+)?")
"""A base symbol and its power, such as ``s`` or ``m3``."""
_SAME: Mapping[str, Mapping[str, int]] = {
    "W": {"J": 1, "s": -1},
    "kW": {"kJ": 1, "s": -1},
    "MW": {"MJ": 1, "s": -1},
    "Hz": {"s": -1},
}
"""Symbol -> the product of others that is the same, to the digit."""


_TIMES = frozenset({"s", "min", "h", "d"})


def is_rate(unit: str) -> bool:
    """Whether ``unit`` is one of something per time: ``L/s``, ``kg/h`` or ``kW``."""
    return any(power < 0 for symbol, power in _powers(unit).items() if symbol in _TIMES)


def _plain(powers: Mapping[str, int]) -> Mapping[str, int]:
    """Without powers of 0; in a product, a temperature in degC is a difference, which is the same in K."""
    found = Counter({symbol: power for symbol, power in powers.items() if power})
    if len(found) > 1 or found["degC"] not in (0, 1):
        found["K"] += found.pop("degC", 0)
    return {symbol: power for symbol, power in found.items() if power}


def _powers(unit: str) -> Mapping[str, int]:
    """The factors of a unit such as ``kJ/(kg K)``; a symbol that cannot be taken apart is a factor by itself."""
    powers: Counter[str] = Counter()
    for index, part in enumerate(unit.split("/")):
        for factor in re.split(r"[ .*·]+", part.strip(" ()")):
            if factor == "1":
                continue
            match = _FACTOR.fullmatch(factor)
            if match is None:
                return {unit: 1}
            times = int(match["power"] or 1) * (1 if index == 0 else -1)
            for symbol, power in _SAME.get(match["symbol"], {match["symbol"]: 1}).items():
                powers[symbol] += times * power
    return _plain(powers)
