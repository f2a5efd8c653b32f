"""The rule language: signal temporal logic over tags, evaluated to signed margins.

Guards, permissives, trip limits, envelopes, symptoms and acceptance criteria are all formulas:

>>> parse("not (P101.speed > 0 and V204.open < 0.5)").holds({"P101.speed": 0.0, "V204.open": 0.2})
True
>>> settled = parse("eventually[0,600] always[0,60] (abs(T1 - T1.sp) <= 1)")
>>> settled.horizon_s
660.0

Grammar, from loose to tight: ``implies`` (or ``->``), ``or``, ``and``, ``f until[a,b] g``, the prefixes ``not``,
``always[a,b]`` and ``eventually[a,b]``, the comparisons ``<= < >= > ==``, then ``+ - * /``, unary ``-``, ``abs(x)``,
``sqrt(x)`` (0 of what is negative),
``min(a,b)``, ``max(a,b)`` over tags and numbers; also ``true`` and ``false``. Bounds are seconds; without them a
temporal operator looks to the end of the trace. A prefix takes one operand: ``always[0,60] a <= 1 and b <= 2`` means
``(always[0,60](a <= 1)) and b <= 2``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from homeostat.stl.evaluator import Bounds, bounds, over_time, term
from homeostat.stl.operations import COLUMNS, POINT, SIGNALS, Program
from homeostat.stl.signals import SignalMap, View, gather
from homeostat.stl.sliding_extrema import FloatArray
from homeostat.stl.spelling import near_matches
from homeostat.stl.text import render
from homeostat.stl.tree import Arithmetic, Comparison, FormulaError, Logic, Node, horizon_of, tags_of, walk
from homeostat.stl.units import Signal, with_scales

__all__ = ["Expression", "Formula", "FormulaError", "Margin", "Node", "parse", "parse_expression"]


@dataclass(frozen=True, slots=True, eq=False)
class Margin:
    """By how much a formula is satisfied (positive) or violated (negative), per ensemble member."""

    value: FloatArray
    """Signed margin in the formula's unit, NaN where undecided; shape (members,)."""
    worst_at_s: FloatArray
    """Time of the sample that decides the value, seconds from the first sample, shape (members,).

    Where the formula demands (``always``, ``and``) it is the worst sample, where it offers a choice (``eventually``,
    ``or``) the best one; the earliest or left-most where several are equal. NaN where no sample decides: a constant,
    an empty window, or an undecided formula."""


@dataclass(frozen=True)
class Formula:
    """A condition over tags, now and in the future. Made by `parse`.

    It is compiled when it is first evaluated, and the result is kept: limits are judged every second.
    """

    text: str
    """As it was written; ``str(formula)`` is the canonical form."""
    root: Logic = field(repr=False)
    """Syntax tree."""
    unit: str = ""
    """Unit of the margins: that of the tags when all comparisons share one; ``1`` when they mix units (each margin is
    then divided by the largest scale of its tags); empty when the formula was parsed without tags."""

    @cached_property
    def tags(self) -> frozenset[str]:
        """Names of the tags it reads."""
        return tags_of(self.root)

    @cached_property
    def _at_point(self) -> Bounds:
        return bounds(self.root, POINT)

    @cached_property
    def _at_columns(self) -> Bounds:
        return bounds(self.root, COLUMNS)

    @cached_property
    def _over_time(self) -> Bounds:
        return bounds(self.root, SIGNALS)

    def __reduce__(self) -> tuple[Any, ...]:
        """What was compiled is not pickled."""
        return Formula, (self.text, self.root, self.unit)

    @cached_property
    def is_one_comparison(self) -> bool:
        """Whether it compares once, so that its margin can only be that comparison's."""
        return sum(isinstance(node, Comparison) for node, _ in walk(self.root)) == 1

    @property
    def horizon_s(self) -> float:
        """How many seconds it looks ahead; ``inf`` when unbounded. A trace that is shorter clips its windows."""
        return horizon_of(self.root)

    def margins(self, signals: SignalMap, dt_s: float) -> FloatArray:
        """Margin at every sample, shape (members, time).

        ``signals`` are sampled every ``dt_s`` seconds. ``and`` is the minimum, ``or`` the maximum, ``not`` the
        negation, ``a <= b`` and ``a < b`` are ``b - a``, and ``a == b`` is ``-|a - b|``. Windows are clipped to the
        trace; ``always`` over an empty window is +inf, ``eventually`` and ``until`` are -inf.

        A margin is NaN where the formula is undecided: values that are NaN, a division by zero or infinity minus
        infinity leave open whether it holds. It is a number where it holds, or is violated, whatever the unknown
        values are; it then says by how much at least.

        Raises `FormulaError` for a missing tag (to forget a signal is a mistake of the caller, unlike a value that
        an instrument did not give), a shape that does not fit, and a bound that is no multiple of ``dt_s``.

        >>> parse("always[0,2](T1 <= 5)").margins({"T1": np.array([1.0, 2.0, 6.0, 3.0])}, dt_s=1.0).tolist()
        [[-1.0, -1.0, -1.0, 2.0]]
        """
        gathered = gather(self.tags, signals, dt_s)
        result = over_time(self._over_time, gathered, gathered.samples, timed=False)
        return np.broadcast_to(result.value, (gathered.members, gathered.samples)).copy()

    def evaluate(self, signals: SignalMap, dt_s: float) -> Margin:
        """Margin at the first sample and the time that decides it. Signals, semantics and errors as in `margins`.

        >>> margin = parse("always(T1 <= 5)").evaluate({"T1": np.array([[1.0, 4.0, 2.0], [7.0, 8.0, 2.0]])}, dt_s=10.0)
        >>> margin.value.tolist(), margin.worst_at_s.tolist()
        ([1.0, -3.0], [10.0, 10.0])
        """
        gathered = gather(self.tags, signals, dt_s)
        result = over_time(self._over_time, gathered, 1, timed=True)
        assert result.at is not None  # asked for
        shape = (gathered.members, 1)
        at = np.broadcast_to(result.at, shape)[:, 0]
        return Margin(np.broadcast_to(result.value, shape)[:, 0].copy(), np.where(at < 0, np.nan, at * dt_s))

    def margin_at(self, values: Mapping[str, float]) -> float:
        """Margin at one point, for a guard on a snapshot; NaN where the point leaves the formula undecided.

        A tag that is absent is unknown, as one that is NaN: an instrument that says nothing must not stop its guard.
        Otherwise a point is a signal of one sample, see `margins`. Raises `FormulaError` for any formula with a
        temporal operator: one point cannot decide what happens next, and vacuous truth must not open a guard.

        >>> limit = parse("B203.level >= 0.25 or P101.cmd <= 0.05")
        >>> limit.margin_at({"B203.level": 0.5}), limit.margin_at({"B203.level": 0.2})
        (0.25, nan)
        """
        compiled = self._at_point
        lower: float = compiled.lower(values)
        if lower >= 0.0:
            return lower
        upper: float = compiled.upper(values)
        return upper if upper < 0.0 else math.nan

    def holds(self, values: Mapping[str, float]) -> bool:
        """Whether `margin_at` is >= 0; an undecided formula does not hold.

        Strictness is not seen: ``a < b`` holds at ``a == b``. To tell two states apart write ``abs(a - b) >= 0.5``.
        """
        lower: float = self._at_point.lower(values)
        return lower >= 0.0

    def holds_each(self, columns: Mapping[str, FloatArray]) -> NDArray[np.bool_]:
        """`holds` for many members at once: ``columns`` has one value per member, shape (members,).

        Raises `FormulaError` for a missing tag, as `margins` does, and for a temporal operator.

        >>> parse("B203.level >= 0.25").holds_each({"B203.level": np.array([0.2, 0.3])}).tolist()
        [False, True]
        """
        with np.errstate(all="ignore"):  # see over_time
            try:
                lower = self._at_columns.lower(columns)
            except KeyError as missing:
                tag = missing.args[0]
                raise FormulaError(f"no value for tag {tag!r}{near_matches(tag, columns)}") from None
        return np.asarray(lower >= 0.0)

    def __str__(self) -> str:
        """Canonical text; reading it gives the same tree."""
        return render(self.root)


@dataclass(frozen=True)
class Expression:
    """An arithmetic term over tags. Made by `parse_expression`."""

    text: str
    """As it was written; ``str(expression)`` is the canonical form."""
    root: Arithmetic = field(repr=False)
    """Syntax tree."""

    @cached_property
    def tags(self) -> frozenset[str]:
        """Names of the tags it reads."""
        return tags_of(self.root)

    @cached_property
    def _at_point(self) -> Program:
        return term(self.root, POINT)

    @cached_property
    def _over_time(self) -> Program:
        return term(self.root, SIGNALS)

    def __reduce__(self) -> tuple[Any, ...]:
        """What was compiled is not pickled."""
        return Expression, (self.text, self.root)

    def evaluate(self, signals: SignalMap) -> FloatArray:
        """Value at every sample, NaN where it has none; shape (members, time). Errors as in `Formula.margins`.

        >>> parse_expression("F2 - 0.5 * P1.pos").evaluate({"F2": np.array([1.0, 2.0]), "P1.pos": 1.0}).tolist()
        [[0.5, 1.5]]
        """
        gathered = gather(self.tags, signals, dt_s=1.0)
        with np.errstate(all="ignore"):  # see over_time
            value = self._over_time(View(gathered, 0, gathered.samples, timed=False))
        return np.broadcast_to(value, (gathered.members, gathered.samples)).astype(np.float64)

    def value(self, values: Mapping[str, float]) -> float:
        """Value at one point; NaN where a tag is absent or NaN, and where arithmetic has no result.

        >>> parse_expression("max(T1, T2) - 1").value({"T1": 3.0, "T2": 5.0})
        4.0
        """
        value: float = self._at_point(values)
        return value

    def __str__(self) -> str:
        """Canonical text; reading it gives the same tree."""
        return render(self.root)


def parse(text: str, tags: Mapping[str, Signal] | None = None) -> Formula:
    """Read a condition; with ``tags`` given, check its names and units and work out the unit of its margin.

    Raises `FormulaError` that names the column, and for an unknown tag the nearest known ones. Terms of different units
    cannot be added or compared; ``!=`` is refused because its margin ``|a - b|`` is never negative.

    >>> str(parse("always[0,600] T1<=313 and F1>0 -> F2>0"))
    'always[0,600](T1 <= 313) and F1 > 0 implies F2 > 0'
    >>> parse("T1 <= 5 and and T2 > 3")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    homeostat.stl.tree.FormulaError: formula 'T1 <= 5 and and T2 > 3', column 13: unexpected 'and'; ...
    """
    from homeostat.stl.parser import read_logic  # the parser library is loaded by the first formula only

    root = read_logic(text, tags)
    if tags is None:
        return Formula(text, root)
    return Formula(text, *with_scales(root, tags))


def parse_expression(text: str, tags: Mapping[str, Signal] | None = None) -> Expression:
    """Read an arithmetic term; with ``tags`` given, check its names and units. Raises `FormulaError` as `parse` does.

    >>> parse_expression("F2 - 0.08 * P1.pos").tags == {"F2", "P1.pos"}
    True
    """
    from homeostat.stl.parser import read_arithmetic  # see parse

    return Expression(text, read_arithmetic(text, tags))
