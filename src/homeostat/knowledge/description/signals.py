"""The tags of the plant and where they come from."""

from __future__ import annotations

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import Relation, Signal
from homeostat.domain.plant.tag import Role, Tag
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.store.error import Code
from homeostat.knowledge.store.store import GraphStore


def tags(store: GraphStore, system: NamedNode) -> tuple[Tag, ...]:
    """The tags, sorted by name."""
    return tuple(signal.tag for signal in signals(store, system))


def signals(store: GraphStore, system: NamedNode) -> tuple[Signal, ...]:
    """The tags with their places, sorted by name."""
    return tuple(_signal(entry) for entry in unique(entries(store, "plant_signals", "tag", system)))


def _signal(entry: Entry) -> Signal:
    relation = entry.word("relation", Relation)
    return Signal(
        tag=entry.made(lambda: _tag(entry), Code.BAD_NUMBER),
        component=entry.reference("component", Code.UNKNOWN_COMPONENT),
        relation=relation,
        variable=entry.text("variable"),
    )


def _tag(entry: Entry) -> Tag:
    return Tag(
        name=entry.name,
        role=entry.word("role", Role),
        unit=entry.text("unit"),
        range=entry.range("low", "high"),
        scale=entry.number("scale"),
        description=entry.words("description"),
        rate_limit=entry.optional_number("rate_limit"),
        increment=entry.optional_number("increment"),
    )
