"""How the plant behaves: its supervisory state machine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from pyoxigraph import NamedNode

from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.plant.tag import Tag
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore


def state_machine(store: GraphStore, system: NamedNode, tags: Iterable[Tag]) -> StateMachine:
    """The machine with its states and transitions, sorted by name; formulas are read over ``tags``."""
    known = {tag.name: tag for tag in tags}
    found = unique(entries(store, "plant_machine", "state machine", system))
    if len(found) != 1:
        raise GraphError(Code.MISSING_VALUE, "plant", f"needs one state machine, has {len(found)}")
    states = _states(store, system, known)
    if sum(state.initial for state in states) != 1:
        marked = ", ".join(repr(state.name) for state in states if state.initial) or "none"
        raise GraphError(Code.BAD_INITIAL_STATE, found[0].thing, f"needs one initial state, {marked} is marked")
    transitions = tuple(
        _transition(entry, known) for entry in unique(entries(store, "plant_transitions", "transition", system))
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


def _transition(entry: Entry, tags: Mapping[str, Tag]) -> Transition:
    return Transition(
        name=entry.name,
        source=entry.reference("source", Code.UNKNOWN_STATE),
        target=entry.reference("target", Code.UNKNOWN_STATE),
        event=entry.reference("event", Code.MISSING_VALUE),
        guard=entry.formula("guard", tags),
        on_decision=entry.flag("decision"),
    )
