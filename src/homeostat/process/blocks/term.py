"""Terms: what an engineer's equations are made of. Python's arithmetic on them makes a term, not a number.

A term is a tree whose leaves are columns of a process model: its states, parameters, inputs and faults. It is printed
as source code of a kernel, evaluated with arrays, and its unit follows from those of its leaves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from functools import lru_cache
from typing import Any, Final, TypeAlias, cast, final
from weakref import WeakValueDictionary

import numpy as np


class Leaf(Enum):
    """What a leaf stands for."""

    STATE = "state"
    """What a balance is integrated of."""
    HELD = "held"
    """A column of the states that stays as it is for a tick: a position, an output, a reading."""
    PARAMETER = "parameter"
    """A constant that the plant's tables state."""
    INPUT = "input"
    """What is commanded from outside."""
    FAULT = "fault"
    """Severity of a fault that has begun, else 0."""
    TICK = "tick"
    """Time between two samples of the plant [s]."""
    AGE = "age"
    """Seconds since a fault began, else 0."""
    TIME = "time"
    """Seconds since the plant was started."""


MEMBER, EACH_TICK, STAGE = 0, 1, 2
"""How often a term changes: with the member, each tick, or within it, with the states."""
_OFTEN: Final = {
    Leaf.PARAMETER: MEMBER, Leaf.TICK: MEMBER, Leaf.INPUT: EACH_TICK, Leaf.FAULT: EACH_TICK, Leaf.AGE: EACH_TICK,
    Leaf.TIME: EACH_TICK, Leaf.HELD: EACH_TICK, Leaf.STATE: STAGE,
}  # fmt: skip


@final
class Term:
    """A leaf, a number, or an operation on terms. The same tree is the same object, and never changes.

    Equations share their parts many times over: trees that are compared or walked again each time take for ever.
    """

    __slots__ = ("__weakref__", "args", "often", "op", "value")
    op: Leaf | str
    """A kind of leaf, ``number``, or the name of an operation."""
    args: tuple[Term, ...]
    """What the operation is done to."""
    value: str | float
    """Name of a leaf, or a number."""
    often: int
    """How often it changes: ``MEMBER``, ``EACH_TICK`` or ``STAGE``."""

    def __new__(cls, op: Leaf | str, args: tuple[Term, ...] = (), value: str | float = "") -> Term:
        """The term that there is of this tree, or a new one."""
        found = _THERE.get((op, args, value))
        if found is not None:
            return found
        made = object.__new__(cls)
        made.op, made.args, made.value = op, args, value
        made.often = _OFTEN[op] if isinstance(op, Leaf) else max((each.often for each in args), default=MEMBER)
        return _THERE.setdefault((op, args, value), made)

    def __reduce__(self) -> tuple[Any, ...]:
        return (Term, (self.op, self.args, self.value))

    def __bool__(self) -> bool:
        raise TypeError("equations are written down before there are numbers: write where(condition, then, otherwise)")

    def __repr__(self) -> str:
        inner = ", ".join(map(repr, self.args)) if self.args else str(self.value)
        return f"{self.op.value if isinstance(self.op, Leaf) else self.op}({inner})"

    def __add__(self, other: Operand) -> Term:
        return _folded("add", self, term(other))

    def __radd__(self, other: Operand) -> Term:
        return _folded("add", term(other), self)

    def __sub__(self, other: Operand) -> Term:
        return _folded("sub", self, term(other))

    def __rsub__(self, other: Operand) -> Term:
        return _folded("sub", term(other), self)

    def __mul__(self, other: Operand) -> Term:
        return _folded("mul", self, term(other))

    def __rmul__(self, other: Operand) -> Term:
        return _folded("mul", term(other), self)

    def __truediv__(self, other: Operand) -> Term:
        return _folded("div", self, term(other))

    def __rtruediv__(self, other: Operand) -> Term:
        return _folded("div", term(other), self)

    def __pow__(self, other: float) -> Term:
        return _folded("pow", self, term(other))

    def __neg__(self) -> Term:
        return _folded("sub", ZERO, self)

    def __abs__(self) -> Term:
        return Term("abs", (self,))

    def __and__(self, other: Term) -> Term:
        return Term("and", (_condition(self), _condition(other)))

    def __or__(self, other: Term) -> Term:
        return Term("or", (_condition(self), _condition(other)))

    def __lt__(self, other: Operand) -> Term:
        return Term("lt", (self, term(other)))

    def __le__(self, other: Operand) -> Term:
        return Term("le", (self, term(other)))

    def __gt__(self, other: Operand) -> Term:
        return Term("lt", (term(other), self))

    def __ge__(self, other: Operand) -> Term:
        return Term("le", (term(other), self))


_THERE: Final[WeakValueDictionary[tuple[Leaf | str, tuple[Term, ...], str | float], Term]] = WeakValueDictionary()
Operand: TypeAlias = "Term | float | str"
"""A term; a number; or a string, which is the symbol of a parameter."""
Values: TypeAlias = Mapping[Term, Any]
"""Leaf -> a number, or an array of them."""


def term(value: Operand) -> Term:
    """``value`` as a term; TypeError where it is none of those that can be one, ValueError where it is not finite."""
    if isinstance(value, Term):
        return value
    if isinstance(value, str):
        return Term(Leaf.PARAMETER, value=value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r:.100} is no term; give a term, a number, or the symbol of a parameter")
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is no number that an equation can have; it must be finite")
    return Term("number", value=float(value))


def number(value: float, unit: str) -> Term:
    """A number with a unit, as ``number(9.81, "m/s2")``; one without takes the unit of its partner."""
    return Term("unit", (term(float(value)),), unit)


ZERO: Final = Term("number", value=0.0)
ONE: Final = Term("number", value=1.0)
TICK: Final = Term(Leaf.TICK)
"""The time between two samples of the plant [s]."""
TIME: Final = Term(Leaf.TIME, value="time")
"""Seconds since the plant was started."""


def _folded(op: str, a: Term, b: Term) -> Term:
    """The operation, without what does nothing: a sum of one, a product with 1 or 0."""
    if op == "add" and a == ZERO:
        return b
    if op in ("add", "sub") and b == ZERO:
        return a
    if (op == "mul" and ZERO in (a, b)) or (op == "div" and a == ZERO):
        return ZERO
    if op == "mul" and a == ONE:
        return b
    if op in ("mul", "div", "pow") and b == ONE:
        return a
    return Term(op, (a, b))


def exp(of: Operand) -> Term:
    """e to the power of ``of`` [1]."""
    return Term("exp", (term(of),))


def log(of: Operand) -> Term:
    """Natural logarithm of ``of`` [1]."""
    return Term("log", (term(of),))


def sqrt(of: Operand) -> Term:
    """Square root; 0 of what is negative, as the flow of a head that is none."""
    return Term("sqrt", (term(of),))


def minimum(a: Operand, b: Operand) -> Term:
    """The smaller one."""
    return Term("min", (term(a), term(b)))


def maximum(a: Operand, b: Operand) -> Term:
    """The larger one."""
    return Term("max", (term(a), term(b)))


def limited(value: Operand, low: Operand, high: Operand) -> Term:
    """``value`` within ``low`` and ``high``."""
    return minimum(maximum(value, low), high)


def where(condition: Term, then: Operand, otherwise: Operand) -> Term:
    """``then`` where the comparison ``condition`` holds, else ``otherwise``; both are worked out."""
    return Term("where", (_condition(condition), term(then), term(otherwise)))


def _condition(of: Term) -> Term:
    """``of``; TypeError where it is no comparison, nor several of them with ``&`` and ``|``."""
    if not isinstance(of, Term) or of.op not in ("lt", "le", "and", "or"):
        raise TypeError(f"{of!r:.100} is no comparison; write one, as where(V > 0.1, then, otherwise)")
    return of


NUMPY: Final[Mapping[str, Any]] = {
    "div": np.divide, "pow": np.power, "abs": np.abs,
    "exp": np.exp, "log": np.log, "sqrt": lambda a: np.sqrt(np.maximum(a, 0.0)), "min": np.minimum, "max": np.maximum,
    "unit": lambda a: a, "lt": np.less, "le": np.less_equal, "where": np.where,
    "and": np.logical_and, "or": np.logical_or,
}  # fmt: skip
"""Operation -> what carries it out on numbers and arrays."""
INFIX: Final[Mapping[str, str]] = {"add": " + ", "sub": " - ", "mul": " * "}
"""Operations for which Python's own sign is as good and quicker."""


def evaluate(of: Term, values: Values) -> Any:
    """``of`` where its leaves have ``values``, in the shape that these give; KeyError names a leaf without one."""
    own, function = _worked_out(of)
    try:
        given = [values[each] for each in own]
    except KeyError as missing:
        raise KeyError(f"{missing.args[0]!r} has no value") from None
    with np.errstate(all="ignore"):
        return function(*given)


@lru_cache(maxsize=4096)
def _worked_out(of: Term) -> tuple[tuple[Term, ...], Callable[..., Any]]:
    own, function = together((of,))
    return own, lambda *given: function(*given)[0]


def together(terms: Sequence[Term]) -> tuple[tuple[Term, ...], Callable[..., Any]]:
    """The leaves of terms, and a function of their values: what is the same is worked out once, in straight lines."""
    own = tuple(sorted(leaves(*terms), key=repr))
    names = {each: f"x{i}" for i, each in enumerate(own)}
    lines = [f"def function({', '.join(names.values())}):"]

    def name(each: Term) -> str:
        if each.op == "number":
            return f"({each.value!r})"
        if each not in names:
            op, arguments = str(each.op), [name(a) for a in each.args]
            names[each] = new = f"t{len(names)}"
            made = INFIX[op].join(arguments) if op in INFIX else f"{op}_({', '.join(arguments)})"
            lines.append(f"    {new} = {made}")
        return names[each]

    results = "".join(f"{name(each)}, " for each in terms)
    lines.append(f"    return ({results})")
    room: dict[str, Any] = {f"{op}_": does for op, does in NUMPY.items()}
    exec("\n".join(lines), room)
    return own, cast(Callable[..., Any], room["function"])


def replaced(of: Term, by: Mapping[Term, Term]) -> Term:
    """``of`` with every leaf that ``by`` has in its place, and in what comes there as well."""
    done: dict[Term, Term] = {}

    def found(each: Term) -> Term:
        if each not in done:
            kept = Term(each.op, tuple(map(found, each.args)), each.value) if each.args else each
            done[each] = found(by[each]) if each in by else kept
        return done[each]

    return found(of)


def nearest(*of: Term) -> tuple[Term, ...]:
    """The leaves of terms, those first that fewest operations are between."""
    seen, found, level = set[Term](), list[Term](), list(of)
    while level:
        fresh = [each for each in dict.fromkeys(level) if each not in seen]
        seen.update(fresh)
        found += [each for each in fresh if isinstance(each.op, Leaf)]
        level = [arg for each in fresh for arg in each.args]
    return tuple(found)


def leaves(*of: Term) -> frozenset[Term]:
    """The leaves of terms."""
    seen: set[Term] = set()
    todo = list(of)
    while todo:
        each = todo.pop()
        if each not in seen:
            seen.add(each)
            todo.extend(each.args)
    return frozenset(each for each in seen if isinstance(each.op, Leaf))
