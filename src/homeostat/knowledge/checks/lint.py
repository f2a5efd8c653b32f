"""Lint: what is likely to be a mistake in any graph that uses the vocabularies, whatever plant it describes.

A graph from elsewhere has no tables and no process model to compare it with, and need not have our shapes. This check
asks for less: that names mean something, that a state machine can be entered and says when it moves on, and that no
part of the plant was forgotten where its like are connected.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from pyoxigraph import Literal, NamedNode

from homeostat.knowledge.checks import lint_names
from homeostat.knowledge.checks.statements import Statements, Thing, local_name, read_statements
from homeostat.knowledge.store.error import Code, Found, Mistake
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.tbox import terms_below
from homeostat.knowledge.vocabulary.vocabulary import HS, UML, VDI2206, VDI3682

LINKS: Final = {
    "interface": (VDI2206.hasInterface,),
    "connection": (HS.isConnectedTo,),
    "flow": (VDI2206.hasInput, VDI2206.hasOutput, VDI3682.hasInput, VDI3682.hasOutput),
}
"""How a component can be tied to others: kind -> its properties, those below them included."""
MOST: Final = 3 / 4
"""Share of the others of its class that must have a link for one without it to be a finding [1]."""
_INITIAL: Final = NamedNode(UML.iri + "initialState")
"""How published graphs name the first state; no vocabulary declares it."""


def lint(store: GraphStore, graph: NamedNode | None = None) -> tuple[Mistake, ...]:
    """The lint findings in ``graph``, or in the default graph, in a fixed order."""
    said = read_statements(store, graph)
    found = [*lint_names.names(said), *_transitions(said), *_machines(said), *_components(said)]
    return tuple(map(Mistake._make, found))


def _transitions(graph: Statements) -> Found:
    for transition in graph.of_kind(UML.Transition):
        stated = graph.values(transition, UML.transitionGuard, UML.transitionEvent)
        if not any(not isinstance(value, Literal) or value.value.strip() for value in stated):
            message = "has neither guard nor event, so nothing says when it is taken; state one, or the guard true"
            yield Code.TRANSITION_WITHOUT_CONDITION, f"transition {local_name(transition)!r}", message


def _machines(graph: Statements) -> Found:
    for machine in graph.of_kind(UML.StateMachine):
        states = graph.values(machine, UML.containsState)
        marked = {state for state in states if any(map(_is_true, graph.values(state, HS.isInitialState)))}
        marked |= set(graph.values(machine, _INITIAL))
        if len(marked) != 1:
            names = ", ".join(sorted(repr(local_name(state)) for state in marked))
            told = f"marks {len(marked)} states as initial: {names}" if marked else "marks no state as initial"
            message = f"{told}, so nothing says where it starts; give hs:isInitialState true to one of its states"
            yield Code.BAD_INITIAL_STATE, f"state machine {local_name(machine)!r}", message


def _components(graph: Statements) -> Found:
    linked = {kind: _linked(graph, properties) for kind, properties in LINKS.items()}
    for sort in sorted(terms_below(VDI2206.Component), key=lambda term: term.value):
        siblings = tuple(graph.of_kind(sort))
        others = len(siblings) - 1
        having = {kind: len(reached.intersection(siblings)) for kind, reached in linked.items()}
        usual = [kind for kind, count in having.items() if others and count >= MOST * others]
        for component in siblings:
            missing = [kind for kind in usual if component not in linked[kind]]
            if missing:
                told = " and ".join(f"no {kind} ({having[kind]} of its {others} siblings have one)" for kind in missing)
                thing = f"{local_name(sort).lower()} {local_name(component)!r}"
                yield Code.UNREACHED_COMPONENT, thing, f"has {told}; state what it is tied to"


def _linked(graph: Statements, properties: tuple[NamedNode, ...]) -> set[Thing]:
    """Everything that stands at either end of one of the properties."""
    below = frozenset(term for above in properties for term in terms_below(above))
    return {end for thing, about in graph.said.items() for end in _ends(thing, about, below)}


def _ends(
    thing: Thing, about: dict[NamedNode, tuple[object, ...]], properties: frozenset[NamedNode]
) -> Iterator[Thing]:
    for term in properties & about.keys():
        yield thing
        yield from (value for value in about[term] if isinstance(value, Thing))


def _is_true(value: object) -> bool:
    return isinstance(value, Literal) and value.value in ("true", "1")
