"""The ways to the safe state that engineering has fixed in advance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import groupby

from pyoxigraph import NamedNode

from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy
from homeostat.knowledge.description.entry import Entry, entries
from homeostat.knowledge.description.guarding import bounded_number
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore


def fallback_strategies(store: GraphStore, system: NamedNode) -> tuple[FallbackStrategy, ...]:
    """The strategies, sorted by name, their commands in the order of their steps, and the permissives they set aside.

    A command ramps at the rate limit of its tag. One without a value hands a manual output back to automatic.
    """
    rows = entries(store, "plant_fallbacks", "fallback", system)
    waived, served = _waivers(store, system), _effects(store, system)
    found = (_strategy(tuple(group), waived) for _, group in groupby(rows, key=lambda entry: entry.name))
    return tuple(replace(strategy, serves=served.get(strategy.name, {})) for strategy in found)


def _waivers(store: GraphStore, system: NamedNode) -> dict[str, dict[str, str]]:
    """Strategy -> permissive -> why it is set aside."""
    found: dict[str, dict[str, str]] = {}
    for row in entries(store, "plant_waivers", "waiver of fallback", system):
        strategy = row.reference("strategy", Code.UNKNOWN_FALLBACK)
        permissive = row.reference("permissive", Code.UNKNOWN_LIMIT)
        if permissive in found.setdefault(strategy, {}):
            raise GraphError(Code.DUPLICATE_ID, row.thing, f"sets {permissive!r} aside more than once; keep one row")
        found[strategy][permissive] = row.text("reason")
    return found


def _effects(store: GraphStore, system: NamedNode) -> dict[str, dict[str, Effect]]:
    """Strategy -> hard limit -> what it does about it."""
    found: dict[str, dict[str, Effect]] = {}
    for row in entries(store, "plant_fallback_limits", "limit of fallback", system):
        strategy = row.reference("strategy", Code.UNKNOWN_FALLBACK)
        limit = row.reference("limit", Code.UNKNOWN_LIMIT)
        if limit in found.setdefault(strategy, {}):
            raise GraphError(Code.DUPLICATE_ID, row.thing, f"serves {limit!r} more than once; keep one row")
        found[strategy][limit] = Effect(bounded_number(row, "acts_within_s"), bounded_number(row, "rest"))
    return found


def _strategy(rows: tuple[Entry, ...], waived: Mapping[str, Mapping[str, str]]) -> FallbackStrategy:
    first = rows[0]
    steps = [row.whole("order") for row in rows]
    if len(set(steps)) < len(steps):
        raise GraphError(Code.DUPLICATE_ID, first.thing, f"steps {steps} are not all different")
    commands = tuple(_command(row) for row in sorted(rows, key=lambda row: row.whole("order")))
    target = first.reference("target", Code.UNKNOWN_STATE)
    actions = first.made(lambda: ActionSet(commands, target), Code.DUPLICATE_ID)
    forced = frozenset(row.reference("tag", Code.UNKNOWN_TAG) for row in rows if row.flag("out_of_service"))
    return FallbackStrategy(first.name, actions, waived.get(first.name, {}), forced)


def _command(row: Entry) -> Command:
    tag, value, rate = row.reference("tag", Code.UNKNOWN_TAG), row.optional_number("value"), row.optional_number("rate")
    return row.made(lambda: Command(tag, value, rate), Code.BAD_NUMBER)
