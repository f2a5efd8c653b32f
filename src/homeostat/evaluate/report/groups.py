"""Groups of rows that are scored together, in an order that does not depend on the order of the rows."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Final

from homeostat.record.row import DO_NOTHING, FALLBACK_ONLY, HINDSIGHT, SEARCH, WHOLE, Row

ALL: Final = "all"
"""Name of all scenarios of a plant together."""
_POLICIES: Final = (FALLBACK_ONLY, DO_NOTHING, HINDSIGHT)
"""In the order of tables."""
_KINDS: Final = ("none", "single", "paired", "unknown", "disturbed")


class Origin(Enum):
    """Where figures come from. Lines of tables say so."""

    MEASURED = "measured"
    """From runs in which the proposer itself was asked."""
    REPLAYED = "replayed"
    """From runs in which recorded answers of a language model were said again."""
    SCRIPTED = "scripted"
    """From runs in which a script answered instead of a language model; it says nothing about any model."""
    REFERENCE = "reference policy"
    """From runs of a reference policy: what was possible, or what happens if nobody proposes."""


@dataclass(frozen=True, slots=True)
class Group:
    """Rows of one proposer in one scenario of one plant, or in several scenarios."""

    case: str
    """Name of the plant."""
    scenario: str
    """Name of the scenario, or of what several have in common; ``all`` for all of them."""
    proposer: str
    """Who proposes."""
    ablation: str
    """What is left out; ``none`` for nothing."""
    rows: tuple[Row, ...]
    """At least one row, in order of scenario and seed."""

    @property
    def name(self) -> str:
        """Proposer, and what it goes without."""
        return arm(self.rows[0])

    @property
    def source(self) -> Origin:
        """Where its figures come from."""
        return source(self.proposer)


def succeeded(row: Row) -> bool:
    """Whether a run counts as a success; where a fallback had to act it does not, as in the paper."""
    return row.success and row.fallbacks == 0


def violated(row: Row) -> bool:
    """Whether the plant truly left a hard limit."""
    return row.exposure_s > 0.0 or row.least_margin < 0.0


def source(proposer: str) -> Origin:
    """Where figures of ``proposer`` come from, by its name."""
    if proposer.startswith(("replay:", "situated:")):
        return Origin.REPLAYED
    if proposer.startswith("scripted:"):
        return Origin.SCRIPTED
    return Origin.REFERENCE if proposer in _POLICIES else Origin.MEASURED


def arm(row: Row) -> str:
    """Proposer of a row, and what it goes without: the unit of every comparison."""
    return row.proposer if row.ablation == WHOLE else f"{row.proposer}, {row.ablation}"


def in_order(rows: Iterable[Row]) -> tuple[Row, ...]:
    """The rows by plant, scenario, proposer, ablation and seed."""
    return tuple(sorted(rows, key=lambda row: (row.case, _by_kind(row), _by_arm(row), row.seed, row.job)))


def plants(rows: Sequence[Row]) -> list[str]:
    """Names of the plants."""
    return sorted({row.case for row in rows})


def arms(rows: Sequence[Row]) -> list[str]:
    """Names of proposers with what they go without: the search first, reference policies last."""
    return list(dict.fromkeys(arm(row) for row in sorted(rows, key=_by_arm)))


def scenarios(rows: Sequence[Row]) -> list[str]:
    """Names of the scenarios: without a fault first, unknown faults last."""
    return list(dict.fromkeys(row.scenario for row in sorted(rows, key=_by_kind)))


def overall(rows: Iterable[Row]) -> list[Group]:
    """One group per plant, proposer and ablation."""
    return grouped(rows, lambda row: ALL)


def by_scenario(rows: Iterable[Row]) -> list[Group]:
    """One group per plant, scenario, proposer and ablation."""
    return grouped(rows, lambda row: row.scenario)


def grouped(rows: Iterable[Row], named: Callable[[Row], str]) -> list[Group]:
    """One group per plant, name of the scenario, proposer and ablation."""
    found: dict[tuple[str, str, str, str], list[Row]] = {}
    for row in in_order(rows):
        found.setdefault((row.case, named(row), row.proposer, row.ablation), []).append(row)
    return [Group(*key, tuple(members)) for key, members in found.items()]


def _by_kind(row: Row) -> tuple[int, str, str]:
    known = _KINDS.index(row.kind) if row.kind in _KINDS else len(_KINDS)
    return known, row.kind, row.scenario


def _by_arm(row: Row) -> tuple[int, str, bool, str]:
    rank = 2 + _POLICIES.index(row.proposer) if row.proposer in _POLICIES else int(row.proposer != SEARCH)
    return rank, row.proposer, row.ablation != WHOLE, row.ablation
