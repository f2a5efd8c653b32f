"""Lint: what is likely to be a mistake in any graph that uses the vocabularies, whatever plant it describes.

A graph from elsewhere has no tables and no process model to compare it with, and need not have our shapes. This check
asks for less: that names mean something, that a state machine can be entered and says when it moves on, and that no
part of the plant was forgotten where its like are connected.
"""

import difflib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final, TypeAlias

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.knowledge.checks.statements import (
    BASIC,
    Statements,
    Thing,
    full_name,
    local_name,
    read_statements,
    split,
)
from homeostat.knowledge.store.error import Code, Found, Mistake
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.tbox import meant_terms, terms_below
from homeostat.knowledge.vocabulary.vocabulary import HS, RDF, UML, VDI2206, VDI3682
from homeostat.stl.spelling import near_matches

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
    found = [*names(said), *_transitions(said), *_machines(said), *_components(said)]
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


CLOSE: Final = 0.9
"""Likeness from which a name is taken for a misspelling [1]; two terms of one published vocabulary are less alike."""

Names: TypeAlias = Mapping[str, tuple[NamedNode, ...]]
"""Local name -> everything of that name."""


def names(graph: Statements) -> Found:
    """Every finding about a name, terms before individuals."""
    described = {split(thing)[0] for thing in graph.individuals}
    vocabularies = {split(term)[0] for term in graph.declared}
    known = frozenset((described | vocabularies) - {""})
    yield from _terms(graph, known)
    yield from _references(graph, known)


def _terms(graph: Statements, known: frozenset[str]) -> Found:
    """Properties and classes that nobody declares although a declared one is likely to be meant.

    One that is like no other is left alone: of some vocabularies our T-Box has a part only.
    """
    by_name = _by_name(graph.declared)
    properties = _uses(graph, lambda fact: None if _is_basic(fact) else fact.predicate)
    classes = _uses(graph, lambda fact: fact.object if fact.predicate == RDF.type else None)
    for kind, uses in (("property", properties), ("class", classes)):
        for term, users in uses.items():
            if term in graph.declared or split(term)[0] not in known:
                continue
            meant = meant_terms().get(term) or _likely(term, by_name)
            if meant is not None:
                same = split(meant)[1] == split(term)[1]
                told = f"no vocabulary declares it, but {_users(users, 'use')} it; write {_instead(term, meant)}"
                yield (Code.SWAPPED_PREFIX if same else Code.UNKNOWN_TERM, f"{kind} {full_name(term)!r}", told)


def _references(graph: Statements, known: frozenset[str]) -> Found:
    """Individuals that are referred to and not described."""
    by_name = _by_name(graph.individuals)
    for thing, users in _uses(graph, lambda fact: None if _is_basic(fact) else fact.object).items():
        space, local = split(thing)
        if thing in graph.individuals or thing in graph.declared or space not in known or not local:
            continue
        told = f"nothing is said about it, but {_users(users, 'refer')} to it by {full_name(users[0].predicate)!r}"
        if elsewhere := by_name.get(local):
            message = f"{told}; write {_instead(thing, elsewhere[0])}"
            yield Code.SWAPPED_PREFIX, f"individual {full_name(thing)!r}", message
        else:
            siblings = [name for name, things in by_name.items() if any(split(item)[0] == space for item in things)]
            yield Code.DANGLING_REFERENCE, f"individual {local_name(thing)!r}", f"{told}; {_remedy(local, siblings)}"


def _remedy(local: str, siblings: list[str]) -> str:
    other_case = next((name for name in siblings if name.casefold() == local.casefold()), None)
    if other_case is not None:
        return f"write {other_case!r}, which differs in case only"
    return f"describe it or correct the reference{near_matches(local, siblings)}"


def _likely(term: NamedNode, by_name: Names) -> NamedNode | None:
    """The declared term that is likely to be meant: of the same name elsewhere, or of nearly the same name here."""
    space, local = split(term)
    if elsewhere := by_name.get(local):
        return elsewhere[0]
    here = {name: item for name, items in by_name.items() for item in items if split(item)[0] == space}
    folded = {name.casefold(): item for name, item in here.items()}
    # No term has a colon: what stands before one is a term to which another name was glued.
    for exact in (folded.get(local.casefold()), here.get(local.partition(":")[0])):
        if exact is not None:
            return exact
    close = difflib.get_close_matches(local, here, n=1, cutoff=CLOSE)
    return here[close[0]] if close else None


def _instead(term: NamedNode, meant: NamedNode) -> str:
    (space, local), (other_space, other) = split(term), split(meant)
    if local == other:
        return f"{full_name(meant)!r}, which has the same name in another namespace"
    only_case = space == other_space and local.casefold() == other.casefold()
    return repr(full_name(meant)) + (", which differs in case only" if only_case else "")


def _uses(graph: Statements, name: Callable[[Triple], object]) -> dict[NamedNode, list[Triple]]:
    """What ``name`` makes of a fact -> the facts, sorted by it."""
    uses = defaultdict(list)
    for fact in graph.facts:
        if isinstance(term := name(fact), NamedNode):
            uses[term].append(fact)
    return dict(sorted(uses.items(), key=lambda item: item[0].value))


def _is_basic(fact: Triple) -> bool:
    return fact.predicate.value.startswith(BASIC)


def _users(facts: list[Triple], verb: str) -> str:
    """Who does something with a name, in words."""
    first, *more = sorted({local_name(fact.subject) for fact in facts})
    return f"{first!r} and {len(more)} more {verb}" if more else f"{first!r} {verb}s"


def _by_name(terms: Iterable[NamedNode]) -> Names:
    found: dict[str, tuple[NamedNode, ...]] = {}
    for term in sorted(terms, key=lambda term: term.value):
        name = split(term)[1]
        found[name] = (*found.get(name, ()), term)
    return found
