"""How the plant behaves and must not behave: its state machine, limits and criteria, and the ways to the safe state."""

from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from itertools import groupby

from pyoxigraph import NamedNode

from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits, Owner
from homeostat.domain.plant.prices import Price, PriceKind
from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.plant.tag import Tag
from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.description.guarding import bounded_number, optional_bounded
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore


def state_machine(store: GraphStore, system: NamedNode, tags: Mapping[str, Tag]) -> StateMachine:
    """The machine with its states and transitions, sorted by name; formulas are read over ``tags``."""
    found = unique(entries(store, "plant_machine", "state machine", system))
    if len(found) != 1:
        raise GraphError(Code.MISSING_VALUE, "plant", f"needs one state machine, has {len(found)}")
    states = _states(store, system, tags)
    if sum(state.initial for state in states) != 1:
        marked = ", ".join(repr(state.name) for state in states if state.initial) or "none"
        raise GraphError(Code.BAD_INITIAL_STATE, found[0].thing, f"needs one initial state, {marked} is marked")
    transitions = tuple(
        Transition(
            name=entry.name,
            source=entry.reference("source", Code.UNKNOWN_STATE),
            target=entry.reference("target", Code.UNKNOWN_STATE),
            event=entry.reference("event", Code.MISSING_VALUE),
            guard=entry.formula("guard", tags),
            on_decision=entry.flag("decision"),
        )
        for entry in unique(entries(store, "plant_transitions", "transition", system))
    )
    return found[0].made(lambda: StateMachine(found[0].name, states, transitions), Code.UNKNOWN_STATE)


def _states(store: GraphStore, system: NamedNode, tags: Mapping[str, Tag]) -> tuple[State, ...]:
    required = entries(store, "plant_requirements", "state", system)
    setpoints = entries(store, "plant_setpoints", "state", system)
    return tuple(
        State(
            name=entry.name,
            label=entry.words("label"),
            risk=entry.whole("risk"),
            initial=entry.flag("initial"),
            recovery_target=entry.flag("recovery_target"),
            settled_when=entry.formula("settled_when", tags),
            requires=frozenset(
                item.reference("component", Code.UNKNOWN_COMPONENT) for item in required if item.name == entry.name
            ),
            setpoints=_setpoints(tuple(item for item in setpoints if item.name == entry.name)),
        )
        for entry in unique(entries(store, "plant_states", "state", system))
    )


def _setpoints(rows: tuple[Entry, ...]) -> tuple[SetpointRange, ...]:
    ranges: list[SetpointRange] = []
    for entry in rows:
        tag = entry.reference("tag", Code.UNKNOWN_TAG)
        if any(other.tag == tag for other in ranges):
            raise GraphError(Code.DUPLICATE_ID, entry.thing, f"has more than one setpoint range of {tag!r}")
        low, high = entry.number("low"), entry.number("high")
        if low > high:
            message = f"setpoint range of {tag!r} [{low:g}, {high:g}] is reversed"
            raise GraphError(Code.REVERSED_RANGE, entry.thing, message)
        ranges.append(SetpointRange(tag, low, high, entry.optional_number("design")))
    return tuple(ranges)


class _Kind(StrEnum):
    TRIP_LIMIT = "trip limit"
    PERMISSIVE = "permissive"
    ENVELOPE = "envelope"
    CRITERION = "criterion"


def limits(store: GraphStore, system: NamedNode, tags: Mapping[str, Tag], timing: Timing = REFERENCE) -> Limits:
    """The limits and criteria, each sorted by name; formulas are read over ``tags``, times are for this ``timing``."""
    found = unique(entries(store, "plant_limits", "limit", system))
    kinds = [(entry, entry.word("kind", _Kind)) for entry in found]
    return Limits(
        limits=tuple(_limit(entry, LimitKind(kind), tags) for entry, kind in kinds if kind is not _Kind.CRITERION),
        criteria=tuple(_criterion(entry, tags, timing) for entry, kind in kinds if kind is _Kind.CRITERION),
    )


def _limit(entry: Entry, kind: LimitKind, tags: Mapping[str, Tag]) -> Limit:
    return Limit(
        name=entry.name,
        kind=kind,
        formula=entry.formula("formula", tags),
        hard=entry.flag("hard"),
        source=entry.text("source"),
        description=entry.words("description"),
        lead=optional_bounded(entry, "lead") or 0.0,
    )


def _criterion(entry: Entry, tags: Mapping[str, Tag], timing: Timing) -> Criterion:
    return Criterion(
        name=entry.name,
        owner=entry.word("owner", Owner),
        formula=entry.formula("formula", tags),
        hard=entry.flag("hard"),
        source=entry.text("source"),
        description=entry.words("description"),
        asks_after_s=optional_bounded(entry, "asks_after_s", timing),
    )


def prices(store: GraphStore, system: NamedNode) -> tuple[Price, ...]:
    """What the tables price, sorted by kind and subject; GraphError where something has two prices."""
    found: dict[tuple[str, str], Price] = {}
    for entry in entries(store, "plant_prices", "price of", system):
        kind = entry.word("kind", PriceKind)
        if (kind, entry.name) in found:
            raise GraphError(Code.DUPLICATE_ID, entry.thing, f"is stated more than once for {kind}; keep one row")
        found[kind, entry.name] = Price(kind, entry.name, entry.number("amount"))
    return tuple(found.values())


def fallback_strategies(
    store: GraphStore, system: NamedNode, timing: Timing = REFERENCE
) -> tuple[FallbackStrategy, ...]:
    """The strategies, sorted by name, their commands in the order of their steps, and the permissives they set aside.

    A command ramps at its own rate, or else at the rate limit of its tag. One without a value hands a manual output
    back to automatic.
    """
    rows = entries(store, "plant_fallbacks", "fallback", system)
    waived, served = _waivers(store, system), _effects(store, system, timing)
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


def _effects(store: GraphStore, system: NamedNode, timing: Timing) -> dict[str, dict[str, Effect]]:
    """Strategy -> hard limit -> what it does about it."""
    found: dict[str, dict[str, Effect]] = {}
    for row in entries(store, "plant_fallback_limits", "limit of fallback", system):
        strategy = row.reference("strategy", Code.UNKNOWN_FALLBACK)
        limit = row.reference("limit", Code.UNKNOWN_LIMIT)
        if limit in found.setdefault(strategy, {}):
            raise GraphError(Code.DUPLICATE_ID, row.thing, f"serves {limit!r} more than once; keep one row")
        found[strategy][limit] = Effect(bounded_number(row, "acts_within_s", timing), bounded_number(row, "rest"))
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
    if rate is None:
        rate = row.optional_number("ordinary_rate")
    return row.made(lambda: Command(tag, value, rate), Code.BAD_NUMBER)
