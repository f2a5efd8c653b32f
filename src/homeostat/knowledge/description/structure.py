"""What the plant is made of: its parts, control loops and equations."""

from __future__ import annotations

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import Component, ComponentKind, ControlLoop, Equation
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.openmath import split
from homeostat.stl.formula import parse_expression


def root(store: GraphStore, system: NamedNode) -> tuple[str, str]:
    """Name and label of the whole plant; GraphError where ``system`` is not in the graph."""
    found = unique(entries(store, "plant_root", "plant", system))
    if not found:
        thing = f"system {system.value!r}"
        raise GraphError(Code.MISSING_VALUE, thing, "is not in the graph; check its name, or build the graph")
    return found[0].name, found[0].words("label")


def components(store: GraphStore, system: NamedNode) -> tuple[Component, ...]:
    """The parts of the plant, the whole included, sorted by name."""
    return tuple(
        Component(
            name=entry.name,
            kind=entry.word("kind", ComponentKind),
            part_of=entry.optional_reference("part_of", Code.UNKNOWN_COMPONENT),
            label=entry.words("label"),
        )
        for entry in unique(entries(store, "plant_components", "component", system))
    )


def loops(store: GraphStore, system: NamedNode) -> tuple[ControlLoop, ...]:
    """The control loops, sorted by name."""
    return tuple(
        ControlLoop(
            name=entry.name,
            controller=entry.reference("controller", Code.UNKNOWN_COMPONENT),
            process_variable=entry.reference("pv", Code.UNKNOWN_TAG),
            setpoint=entry.reference("sp", Code.UNKNOWN_TAG),
            manipulated_variable=entry.reference("mv", Code.UNKNOWN_TAG),
            gain=entry.reference("gain", Code.UNKNOWN_PARAMETER),
            reset=entry.reference("reset", Code.UNKNOWN_PARAMETER),
            label=entry.words("label"),
        )
        for entry in unique(entries(store, "plant_loops", "loop", system))
    )


def equations(store: GraphStore, system: NamedNode) -> tuple[Equation, ...]:
    """The equations of the process operators, sorted by name."""
    return tuple(_equation(entry) for entry in unique(entries(store, "plant_equations", "equation", system)))


def _equation(entry: Entry) -> Equation:
    result, right = entry.made(lambda: split(entry.text("text")), Code.BAD_FORMULA)
    return Equation(
        name=entry.name,
        operator=entry.reference("operator", Code.UNKNOWN_OPERATOR),
        result=result,
        expression=entry.made(lambda: parse_expression(right), Code.BAD_FORMULA),
        label=entry.words("label"),
    )
