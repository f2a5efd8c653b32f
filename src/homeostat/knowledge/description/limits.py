"""What must hold: interlocks, permissives, envelopes and acceptance criteria."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum

from pyoxigraph import NamedNode

from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.plant.tag import Tag
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.store.store import GraphStore


class _Kind(StrEnum):
    INTERLOCK = "interlock"
    PERMISSIVE = "permissive"
    ENVELOPE = "envelope"
    CRITERION = "criterion"


def limits(store: GraphStore, system: NamedNode, tags: Iterable[Tag]) -> Limits:
    """The limits and criteria, each sorted by name; formulas are read over ``tags``."""
    known = {tag.name: tag for tag in tags}
    found = unique(entries(store, "plant_limits", "limit", system))
    kinds = [(entry, entry.word("kind", _Kind)) for entry in found]
    return Limits(
        limits=tuple(_limit(entry, LimitKind(kind), known) for entry, kind in kinds if kind is not _Kind.CRITERION),
        criteria=tuple(_criterion(entry, known) for entry, kind in kinds if kind is _Kind.CRITERION),
    )


def _limit(entry: Entry, kind: LimitKind, tags: Mapping[str, Tag]) -> Limit:
    return Limit(
        name=entry.name,
        kind=kind,
        formula=entry.formula("formula", tags),
        hard=entry.flag("hard"),
        source=entry.text("source"),
        description=entry.words("description"),
    )


def _criterion(entry: Entry, tags: Mapping[str, Tag]) -> Criterion:
    return Criterion(
        name=entry.name,
        owner=entry.word("owner", Owner),
        formula=entry.formula("formula", tags),
        hard=entry.flag("hard"),
        source=entry.text("source"),
        description=entry.words("description"),
    )
