"""Permissives with a comparison the wrong way round: they forbid what the plant is by design, or permit the opposite.

Two signs of it, each said with the comparison: turned round, the permissive would hold where it forbids what the plant
is by design; or it asks for a value at which a hard limit of the same reading is violated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.limits import Limit, LimitKind
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.knowledge.checks.intervals import Bound, bounds
from homeostat.stl.formula import Formula
from homeostat.stl.text import render
from homeostat.stl.tree import And, Comparator, Comparison, Implies, Logic, Not, Or, walk

HOLDS: Final = 0.95
"""Share of the moments at which it was forbidden at which a permissive has to hold once it is turned round [1]."""
_OTHER: Final[Mapping[Comparator, Comparator]] = {"<=": ">=", "<": ">", ">=": "<=", ">": "<"}
TURN: Final = "turn the comparison round, or correct its value"
"""What to do about it."""


class _Turned(NamedTuple):
    """A comparison that would let a permissive hold if it were turned round."""

    stated: Comparison
    other: Comparison
    protects: Limit | None
    """The limit nearest to its value, where that asks for the other side; None where there is none."""
    measured: bool
    """Whether it reads what is measured, and no command."""

    def __str__(self) -> str:
        if self.protects is None:
            return f"it would hold with '{render(self.other)}' in place of '{render(self.stated)}'"
        return (
            f"'{render(self.stated)}' is the wrong way round: {self.protects.name}, '{self.protects.formula}', "
            f"asks for the other side, and with '{render(self.other)}' it would hold"
        )


def turned_round(d: PlantDescription, limit: Limit, signals: Mapping[str, NDArray[np.float64]], dt_s: float) -> str:
    """Which comparison of ``limit`` is the wrong way round if the plant has to be as ``signals`` say; empty for none.

    ``signals``: tag -> values at the moments at which it does not hold, shape (1, times), every ``dt_s`` [s].
    """
    found = [each for each in _candidates(d, limit) if _holds(limit, each, signals, dt_s)]
    for chosen in (
        [each for each in found if each.protects],
        [each for each in found if each.measured],
        found,
    ):
        if chosen:
            return ", or ".join(map(str, chosen))
    return ""


def turned_at(bench: Bench, name: str, values: Mapping[str, float], given: Mapping[str, float]) -> str:
    """As :func:`turned_round`, of the permissive called ``name`` at one moment: ``values`` after what is ``given``."""
    d = bench.plant.description
    limit = next(each for each in d.limits.limits if each.name == name)
    said_of(bench).add(name)
    at_once = {**values, **limit.following(given)}
    return turned_round(d, limit, {tag: np.full((1, 1), value) for tag, value in at_once.items()}, 1.0)


def said_of(bench: Bench) -> set[str]:
    """Permissives of which it was said that they forbid what the plant is by design."""
    return bench.kept("permissives that forbid the design", set)


def inverted(bench: Bench) -> Iterator[Finding]:
    """Permissives that ask for what violates a hard limit; of one that forbids the design it was said already."""
    d, said = bench.plant.description, said_of(bench)
    for limit in d.limits.of_kind(LimitKind.PERMISSIVE):
        for bound in bounds(limit.formula.root) if limit.name not in said else ():
            for hard in d.limits.hard:
                if _against(bound, hard):
                    stated = f"{bound.tag} {bound.operator} {bound.value:g}"
                    what = (
                        f"'{limit.formula}' permits by '{stated}' exactly what violates {hard.name}, "
                        f"'{hard.formula}', and forbids what keeps it: the comparison is the wrong way round"
                    )
                    place = bench.places.row("limits", id=limit.name)
                    yield Finding(Severity.ERROR, "rules", place, what, TURN)


def _against(bound: Bound, hard: Limit) -> bool:
    """Whether what ``bound`` asks for violates a limit that is about its tag, by one transmitter or several."""
    own = [each for each in bounds(hard.formula.root) if each.operator != "=="]
    upper = {each.operator in ("<=", "<") for each in own}
    if len(upper) != 1 or bound.operator == "==":
        return False
    for each in own:
        beyond = bound.value >= each.value if upper == {True} else bound.value <= each.value
        if each.tag == bound.tag and beyond and (bound.operator in (">=", ">")) == (upper == {True}):
            return True
    return False


def _candidates(d: PlantDescription, limit: Limit) -> Iterator[_Turned]:
    measured = {s.tag.name for s in d.signals if s.relation is Relation.MEASURES} - set(d.positions.values())
    for node, _ in walk(limit.formula.root):
        if isinstance(node, Comparison) and node.operator in _OTHER:
            other = replace(node, operator=_OTHER[node.operator])
            tags = {bound.tag for bound in bounds(node)}
            yield _Turned(node, other, _protects(d, node), bool(tags & measured))


def _protects(d: PlantDescription, node: Comparison) -> Limit | None:
    """The limit or envelope whose bound of the same tag is nearest, where that asks for the other side."""
    own = next(iter(bounds(node)), None)
    if own is None:
        return None
    near = [
        (abs(bound.value - own.value), limit.name, bound.operator, limit)
        for limit in d.limits.limits
        if limit.kind is not LimitKind.PERMISSIVE
        for bound in bounds(limit.formula.root)
        if bound.tag == own.tag and bound.operator in _OTHER
    ]
    if not near:
        return None
    _, _, operator, limit = min(near, key=lambda each: each[:2])
    return limit if operator[0] != own.operator[0] else None


def _holds(limit: Limit, turned: _Turned, signals: Mapping[str, NDArray[np.float64]], dt_s: float) -> bool:
    root = _with(limit.formula.root, turned.stated, turned.other)
    margins = Formula(render(root), root, limit.formula.unit).margins(signals, dt_s)
    return float(np.mean(margins >= 0.0)) >= HOLDS


def _with(node: Logic, before: Comparison, after: Comparison) -> Logic:
    """``node`` with ``after`` in place of ``before``."""
    match node:
        case Comparison():
            return after if node is before else node
        case Not():
            return replace(node, operand=_with(node.operand, before, after))
        case And() | Or():
            return replace(node, operands=tuple(_with(each, before, after) for each in node.operands))
        case Implies():
            premise, conclusion = (_with(each, before, after) for each in (node.premise, node.conclusion))
            return replace(node, premise=premise, conclusion=conclusion)
        case _:
            return node
