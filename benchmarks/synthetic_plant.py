"""A plant of any size for measuring graph queries: a chain of equal modules, written as N-Triples.

One module has 12 states, 24 actions, 24 transitions, 30 components (10 actuators, 10 sensors, 10 others), 20 tags,
10 limits, 6 faults and 8 symptoms.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.knowledge.vocabulary.vocabulary import RDF, RDFS
from tests.knowledge.terms import DIN17359, HS, UML, VDI2206, VDI3682, CPSMod

NAMESPACE: Final = "urn:synthetic:"


def node(module: int, kind: str, number: int = 0) -> NamedNode:
    """The thing ``number`` of its kind in a module, for example ``node(3, "state", 7)``."""
    return NamedNode(f"{NAMESPACE}m{module}/{kind}{number}")


def plant(modules: int) -> bytes:
    """A plant of that many modules, as N-Triples."""
    lines = (f"{triple} .\n" for module in range(modules) for triple in _module(module))
    return "".join(lines).encode()


def _module(m: int) -> Iterator[Triple]:
    module, machine, operator = node(m, "module"), node(m, "machine"), node(m, "operator")
    yield from _named(module, VDI2206.Module, f"module {m}")
    yield from _named(machine, UML.StateMachine, f"machine {m}")
    yield from _named(operator, VDI3682.ProcessOperator, f"operator {m}")
    yield Triple(operator, VDI3682.isAssignedTo, module)
    yield Triple(operator, CPSMod.processRealizesBehavior, machine)
    yield Triple(operator, VDI3682.hasInput, node(m, "product"))
    yield Triple(operator, VDI3682.hasOutput, node(m + 1, "product"))
    if m:
        yield Triple(operator, VDI3682.hasPredecessor, node(m - 1, "operator"))
    yield from _behaviour(m, machine)
    yield from _equipment(m, module)
    yield from _diagnosis(m)


def _behaviour(m: int, machine: NamedNode) -> Iterator[Triple]:
    for i in range(12):
        state = node(m, "state", i)
        yield from _named(state, UML.State, f"state {i}")
        yield Triple(machine, UML.containsState, state)
        yield Triple(state, HS.requiresComponent, node(m, "component", i))
        for j in (2 * i, 2 * i + 1):
            action = node(m, "action", j)
            yield from _named(action, UML.Action, f"action {j}")
            yield Triple(state, UML.doAction, action)
            yield Triple(action, CPSMod.isChangedByActuator, node(m, "component", j % 10))
    for i in range(24):
        transition = node(m, "transition", i)
        yield from _named(transition, UML.Transition, f"transition {i}")
        yield Triple(machine, UML.containsTransition, transition)
        yield Triple(transition, UML.sourceState, node(m, "state", i % 12))
        yield Triple(transition, UML.targetState, node(m, "state", (i + 1 + i // 12) % 12))
        yield Triple(transition, UML.transitionGuard, Literal(f"m{m}.level >= {i / 100}"))
        yield Triple(transition, HS.requiresActuator, node(m, "component", i % 10))


def _equipment(m: int, module: NamedNode) -> Iterator[Triple]:
    for i in range(30):
        component = node(m, "component", i)
        kind = (VDI2206.Actuator, VDI2206.Sensor, VDI2206.Component)[i // 10]
        yield from _named(component, kind, f"component {i}")
        yield Triple(module, VDI2206.ModuleConsistsOfComponent, component)
        if i < 20:
            tag = node(m, "tag", i)
            yield from _named(tag, HS.Tag, f"tag {i}")
            yield Triple(tag, HS.name, Literal(f"m{m}.t{i}"))
            yield Triple(tag, HS.drives if i < 10 else HS.measures, component)
    for i in range(10):
        limit = node(m, "limit", i)
        yield from _named(limit, HS.Envelope, f"limit {i}")
        yield Triple(limit, HS.formula, Literal(f"m{m}.t{i + 10} <= 1"))
        yield Triple(limit, HS.protects, module if i % 2 else node(m, "component", i))
        yield Triple(limit, HS.constrains, node(m, "tag", i + 10))


def _diagnosis(m: int) -> Iterator[Triple]:
    for i in range(6):
        fault = node(m, "fault", i)
        yield from _named(fault, DIN17359.Fault, f"fault {i}")
        yield Triple(fault, HS.priorProbability, Literal(1 / 6))
        yield Triple(fault, HS.affects, node(m, "component", i))
        yield Triple(fault, HS.disables, node(m, "component", i))
        yield Triple(fault, HS.disables, node(m, "transition", i))
    for i in range(8):
        symptom = node(m, "symptom", i)
        yield from _named(symptom, DIN17359.Symptom, f"symptom {i}")
        for j in (i % 6, (i + 1) % 6):
            yield Triple(symptom, DIN17359.SymptomIndicatesFault, node(m, "fault", j))


def _named(thing: NamedNode, kind: NamedNode, label: str) -> Iterator[Triple]:
    yield Triple(thing, RDF.type, kind)
    yield Triple(thing, RDFS.label, Literal(label))
