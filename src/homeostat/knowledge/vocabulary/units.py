"""Units of the tables in QUDT: the rows of ``units.csv``, one for each symbol."""

import csv
import functools
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Final

from pyoxigraph import NamedNode

from homeostat.knowledge.vocabulary.vocabulary import OWN_UNITS, PREFIXES

_TABLE: Final = "units.csv"


@dataclass(frozen=True, slots=True)
class KnownUnit:
    """What one symbol stands for."""

    symbol: str
    """As tables write it, such as ``L/s``; ``1`` for a fraction."""
    unit: NamedNode
    """The unit in QUDT, or in our own namespace where QUDT has none."""
    kind: NamedNode | None
    """The kind of quantity that is measured in it; None where there are several."""
    ucum: str
    """UCUM code of a unit that QUDT has not; empty for the others, and where UCUM has no code either."""

    @property
    def own(self) -> bool:
        """Whether QUDT has no such unit."""
        return self.unit.value.startswith(OWN_UNITS)


@functools.cache
def known_units() -> Mapping[str, KnownUnit]:
    """Symbol -> what it stands for."""
    text = resources.files(__package__).joinpath(_TABLE).read_text("utf-8")
    return {row["symbol"]: _unit(row) for row in csv.DictReader(text.splitlines(), strict=True)}


def _unit(row: Mapping[str, str]) -> KnownUnit:
    kind = _term(row["kind"]) if row["kind"] else None
    return KnownUnit(row["symbol"], _term(row["unit"]), kind, row["ucum"])


def _term(name: str) -> NamedNode:
    prefix, _, local = name.partition(":")
    return NamedNode(dict(PREFIXES)[prefix] + local)
