"""The ways to the safe state that engineering has fixed in advance."""

from __future__ import annotations

from itertools import groupby

from pyoxigraph import NamedNode

from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy

from ..graph_error import Code, GraphError
from ..store import GraphStore
from .entry import Entry, entries


def fallback_strategies(store: GraphStore, system: NamedNode) -> tuple[FallbackStrategy, ...]:
    """The strategies, sorted by name, their commands in the order of their steps.

    A command ramps at the rate limit of its tag. One without a value hands a manual output back to automatic.
    """
    rows = entries(store, "plant_fallbacks", "fallback", system)
    return tuple(_strategy(tuple(group)) for _, group in groupby(rows, key=lambda entry: entry.name))


def _strategy(rows: tuple[Entry, ...]) -> FallbackStrategy:
    first = rows[0]
    steps = [row.whole("order") for row in rows]
    if len(set(steps)) < len(steps):
        raise GraphError(Code.DUPLICATE_ID, first.thing, f"steps {steps} are not all different")
    commands = tuple(_command(row) for row in sorted(rows, key=lambda row: row.whole("order")))
    target = first.reference("target", Code.UNKNOWN_STATE)
    return FallbackStrategy(first.name, first.made(lambda: ActionSet(commands, target), Code.DUPLICATE_ID))


def _command(row: Entry) -> Command:
    tag, value, rate = row.reference("tag", Code.UNKNOWN_TAG), row.optional_number("value"), row.optional_number("rate")
    return row.made(lambda: Command(tag, value, rate), Code.BAD_NUMBER)
