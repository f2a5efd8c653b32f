"""What the plant is made of: its parts, tags, control loops, equations and parameters."""

from functools import partial
from itertools import groupby

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import Component, ComponentKind, ControlLoop, Equation, Relation, Signal
from homeostat.domain.plant.parameter import ModelParameter
from homeostat.domain.plant.tag import Role, Tag
from homeostat.domain.plant.timing import Timing
from homeostat.knowledge.description.entry import Entry, entries, unique
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.openmath import split
from homeostat.stl.formula import parse_expression


def root(store: GraphStore, system: NamedNode) -> tuple[str, str, Timing]:
    """Name, label and timing of the whole plant; GraphError where ``system`` is not in the graph."""
    found = unique(entries(store, "plant_root", "plant", system))
    if not found:
        thing = f"system {system.value!r}"
        raise GraphError(Code.MISSING_VALUE, thing, "is not in the graph; check its name, or build the graph")
    usual = Timing()
    tick_s = found[0].optional_number("tick") or usual.tick_s
    timing = Timing(tick_s, found[0].optional_number("response") or usual.response_s)
    return found[0].name, found[0].words("label"), timing


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


def signals(store: GraphStore, system: NamedNode) -> tuple[Signal, ...]:
    """The tags with their places, sorted by name."""
    return tuple(
        Signal(
            relation=entry.word("relation", Relation),
            tag=entry.made(partial(_tag, entry), Code.BAD_NUMBER),
            component=entry.reference("component", Code.UNKNOWN_COMPONENT),
            variable=entry.text("variable"),
        )
        for entry in unique(entries(store, "plant_signals", "tag", system))
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


def model_parameters(store: GraphStore, system: NamedNode) -> tuple[ModelParameter, ...]:
    """The parameters, sorted by symbol; relative uncertainties are converted to the parameter's unit.

    A parameter that several components share is listed once, under the first of them.
    """
    rows = entries(store, "plant_parameters", "parameter", system)
    return tuple(_parameter(tuple(group)) for _, group in groupby(rows, key=lambda entry: entry.name))


def _parameter(rows: tuple[Entry, ...]) -> ModelParameter:
    made = {
        ModelParameter(
            symbol=entry.name,
            value=entry.number("value"),
            unit=entry.text("unit"),
            sd=_standard_deviation(entry),
            component=min(row.reference("component", Code.UNKNOWN_COMPONENT) for row in rows),
            description=entry.words("description"),
        )
        for entry in rows
    }
    if len(made) > 1:
        raise GraphError(Code.DUPLICATE_ID, rows[0].thing, "is stated more than once with different values")
    return made.pop()


def _standard_deviation(entry: Entry) -> float:
    absolute, relative = entry.optional_number("sd"), entry.optional_number("relative")
    if absolute is not None and relative is not None:
        raise GraphError(Code.DUPLICATE_ID, entry.thing, "has an absolute and a relative uncertainty; state one")
    if absolute is None and relative is None:
        raise GraphError(Code.MISSING_VALUE, entry.thing, "has no uncertainty; give sd and spread absolute or relative")
    sd = absolute if absolute is not None else abs(entry.number("value")) * (relative or 0.0)
    if sd < 0:
        raise GraphError(Code.BAD_NUMBER, entry.thing, f"standard deviation {sd:g} must be >= 0 {entry.text('unit')}")
    return sd
