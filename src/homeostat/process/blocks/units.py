"""Do the units of equations agree? The unit of a term follows from those of its leaves.

What is added, compared or chosen between has one unit. A number takes the unit of its partner; as a factor it may
convert (``1000 * Q``), so that the size of what it stands in is not checked, its kind is. pint reads the units.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from homeostat.process.blocks.term import Leaf, Term, nearest

_SAME = ("add", "sub", "min", "max", "lt", "le", "where")
_PLAIN = ("exp", "log")
_CLOSE = 1e-6
_SHORT = 40
_NEAR = 4
"""Most characters of a term that a message shows."""


class UnitError(ValueError):
    """Units do not agree; the message says which, and where."""

    def __init__(self, text: str, *about: Term, apart: Unit | None = None) -> None:
        """``about``: the terms whose units do not agree; ``apart``: the unit of the first through that of the other."""
        super().__init__(text)
        self.about = about
        """The terms whose units do not agree; empty where it is no matter of terms."""
        self.apart = apart
        """By what unit two terms differ; None where it is no matter of two."""


class NoUnitError(UnitError):
    """No unit is known of a leaf."""


@dataclass(frozen=True, slots=True)
class Unit:
    """Kind and size of a unit."""

    kind: tuple[tuple[str, float], ...]
    """Dimension -> exponent, sorted."""
    size: float | None
    """In basic units; None where a number may have converted it."""
    any: bool = False
    """Whether it is a number's, which takes that of its partner."""

    def times(self, other: Unit, power: float = 1.0) -> Unit:
        """The product with ``other`` to a power."""
        kind = dict(self.kind)
        for name, exponent in other.kind:
            kind[name] = kind.get(name, 0.0) + power * exponent
        sizes = self.size, other.size
        size = None if None in sizes else float(sizes[0] or 0.0) * float(sizes[1] or 0.0) ** power
        left = tuple(sorted((name, e) for name, e in kind.items() if abs(e) > _CLOSE))
        return Unit(left, size)

    def agrees(self, other: Unit) -> bool:
        """Whether the two may be added."""
        if self.any or other.any:
            return True
        if self.kind != other.kind:
            return False
        return self.size is None or other.size is None or math.isclose(self.size, other.size, rel_tol=_CLOSE)


NONE = Unit((), 1.0)


def read(symbol: str) -> Unit:
    """The unit that ``symbol`` is, as tables write it (``J/(L K)``, ``m3/h``, ``1``); UnitError if it is none."""
    registry, written = _registry(), re.sub(r"(?<=[A-Za-z])(\d)", r"^\1", symbol.strip())
    if not written:
        raise UnitError("an empty cell is no unit; write one as 'J/(kg K)', or 1 for a fraction")
    if written in ("1", "%"):
        return NONE if written == "1" else Unit((), 0.01)
    try:
        found: Any = registry.parse_units(written.replace("degC", "delta_degC"))
    except Exception:  # pint has many
        raise UnitError(f"{symbol!r} is no unit; write one as 'J/(kg K)', or 1 for a fraction") from None
    basic = (1 * found).to_base_units()
    kind = tuple(sorted((str(name).strip("[]"), float(e)) for name, e in found.dimensionality.items()))
    return Unit(kind, float(basic.magnitude))


def of_term(term: Term, units: Mapping[Term, Unit], named: Mapping[Term, str]) -> Unit:
    """Unit of ``term``, where its leaves have ``units``; ``named``: what a message calls a term.

    UnitError where two that are added, compared or chosen between have different ones, or a leaf has none.
    """
    done: dict[Term, Unit] = {}

    def found(each: Term) -> Unit:
        if each not in done:
            done[each] = _of(each, [found(arg) for arg in each.args], units, named)
        return done[each]

    return found(term)


def _of(term: Term, args: list[Unit], units: Mapping[Term, Unit], named: Mapping[Term, str]) -> Unit:
    if isinstance(term.op, Leaf):
        if term not in units:
            raise NoUnitError(f"{term.op.value} {term.value!r} has no unit; the tables do not state it", term)
        return units[term]
    if term.op == "number":
        return Unit((), None, any=True)
    if term.op == "unit":
        return read(str(term.value))
    if term.op in _SAME:
        chosen = args[1:] if term.op == "where" else args
        pair = [u for u in chosen if not u.any]
        if len(pair) == 2 and not pair[0].agrees(pair[1]):
            told = " and ".join(told_term(a, named) for a in term.args[-2:])
            what = f"{told} are {_WORDS.get(str(term.op), 'combined')}, and their units differ"
            raise UnitError(what, *term.args[-2:], apart=pair[0].times(pair[1], -1.0))
        return (pair or chosen)[0]
    if term.op in ("mul", "div"):
        power = 1.0 if term.op == "mul" else -1.0
        if all(unit.any for unit in args):
            return Unit((), None, any=True)
        a, b = (_factor(unit, each) for unit, each in zip(args, term.args, strict=True))
        return a.times(b, power)
    if term.op == "pow":
        return NONE.times(args[0], _number(term.args[1]))
    if term.op == "sqrt":
        return NONE.times(args[0], 0.5)
    if term.op in _PLAIN and args[0].kind:
        raise UnitError(
            f"{told_term(term.args[0], named)} has a unit, and {term.op} is taken of it; divide it away", term
        )
    return args[0] if term.op == "abs" else NONE


def _factor(unit: Unit, term: Term) -> Unit:
    """``unit`` as that of a factor: a number other than 1 may convert."""
    if not unit.any:
        return unit
    return NONE if term.op == "number" and abs(float(term.value)) == 1.0 else Unit((), None)


_WORDS = {"add": "added", "sub": "subtracted", "lt": "compared", "le": "compared"}


def _number(term: Term) -> float:
    return float(term.value) if term.op == "number" else math.nan


def told_term(term: Term, named: Mapping[Term, str]) -> str:
    """``term`` as an engineer would write it; where that is long, the nearest symbols that it is made of."""
    text = _written(term, named)
    if len(text) <= _SHORT:
        return text
    names = [str(leaf.value) for leaf in nearest(term) if leaf.value and leaf.op is not Leaf.FAULT]
    more = f" and {len(names) - _NEAR} more" if len(names) > _NEAR else ""
    return f"a term of {', '.join(names[:_NEAR])}{more}"


_SIGNS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "pow": "**", "lt": "<", "le": "<="}


def _written(term: Term, named: Mapping[Term, str]) -> str:
    if term in named or not term.args:
        return named.get(term, f"{term.value:g}" if isinstance(term.value, float) else str(term.value))
    args = [_written(each, named) for each in term.args]
    if term.op == "unit":
        return f"{args[0]} {term.value}"
    if term.op in _SIGNS:
        return f"({args[0]} {_SIGNS[str(term.op)]} {args[1]})"
    return f"{term.op}({', '.join(args)})"


@functools.cache
def _registry() -> Any:
    import pint  # half a second, and only who checks units needs it

    return pint.UnitRegistry()
