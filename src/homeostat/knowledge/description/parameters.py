"""The parameters of the process model with their uncertainty."""

from __future__ import annotations

from itertools import groupby

from pyoxigraph import NamedNode

from homeostat.domain.plant.parameter import ModelParameter
from homeostat.knowledge.description.entry import Entry, entries
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.store.store import GraphStore


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
