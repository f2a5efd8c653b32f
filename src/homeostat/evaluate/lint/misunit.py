"""Which row states the unit that a rule cannot work with: the rule is where it is noticed, not where it is wrong."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from homeostat.evaluate.lint.places import Places
from homeostat.stl.formula import FormulaError, parse, parse_expression

_READ: Final = re.compile(r"(?P<kind>formula|expression) '(?P<text>.*)', (?:line \d+, )?column \d+: .* is in .* and ")
_UNITS: Final = (("parameters", "symbol"), ("signals", "tag"))
"""Tables that state units, with the column of the name: a parameter is likelier to be wrong than an instrument."""
_TOLD: Final = 2
"""So many rows are told that could be wrong."""


@dataclass(frozen=True, slots=True)
class _Stated:
    """A name of a rule as the check of units sees it."""

    unit: str
    """Its unit."""
    scale: float = 1.0
    """Not used for units."""


def misunit(places: Places, message: str) -> str:
    """Rows that let the rule in ``message`` agree, were they in another unit of the plant; empty where none does."""
    read = _READ.search(message)
    if read is None:
        return ""
    stated = {name: unit for table, column in _UNITS for name, unit in places.column(table, column, "unit").items()}
    for table, column in _UNITS:
        names = [name for name in places.column(table, column, "unit") if _names(read["text"], name)]
        fits = {
            name: unit
            for name in names
            for unit in sorted(set(stated.values()) - {stated[name], ""})
            if _agrees(read["kind"], read["text"], stated | {name: unit})
        }
        if fits:
            told = [f"{places.row(table, **{column: n})} were in {u!r}" for n, u in fits.items()]
            return " or if ".join(told[:_TOLD])
    return ""


def _names(text: str, name: str) -> bool:
    return re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", text) is not None


def _agrees(kind: str, text: str, stated: Mapping[str, str]) -> bool:
    tags = {name: _Stated(unit) for name, unit in stated.items()}
    try:
        parse(text, tags) if kind == "formula" else parse_expression(text, tags)
    except FormulaError:
        return False
    return True
