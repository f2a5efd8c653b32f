"""Which tables a plant has, what their rows are, and which columns tell one row from another."""

from collections.abc import Mapping
from typing import Final

from homeostat.knowledge.build.tables import behaviour, diagnosis, guarding, short, structure
from homeostat.knowledge.build.tables.cells import TableRow

SCHEMAS: Final[Mapping[str, tuple[type[TableRow], tuple[str, ...]]]] = {
    "equipment": (structure.Equipment, ("id",)),
    "signals": (structure.Signal, ("tag",)),
    "sensors": (structure.Sensor, ("component",)),
    "loops": (structure.Loop, ("id",)),
    "parameters": (structure.ModelParameter, ("symbol",)),
    "operators": (structure.ProcessOperator, ("id",)),
    "flows": (structure.Flow, ("operator", "direction", "flow")),
    "equations": (structure.OperatorEquation, ("id",)),
    "states": (behaviour.OperatingState, ("id",)),
    "state_requirements": (behaviour.StateRequirement, ("state", "component")),
    "setpoints": (behaviour.Setpoint, ("state", "tag")),
    "transitions": (behaviour.Transition, ("id",)),
    "limits": (behaviour.Limit, ("id",)),
    "criteria": (behaviour.Criterion, ("id",)),
    "prices": (behaviour.Price, ("kind", "item")),
    "fallbacks": (behaviour.FallbackStep, ("strategy", "step")),
    "fallback_waivers": (behaviour.Waiver, ("strategy", "permissive")),
    "fallback_limits": (behaviour.FallbackLimit, ("strategy", "limit")),
    "quality": (guarding.Quality, ("tag",)),
    "trips": (guarding.Trip, ("limit",)),
    "start_up": (guarding.StartUpLimit, ("limit",)),
    "writables": (guarding.Writable, ("tag",)),
    "faults": (diagnosis.Fault, ("id",)),
    "features": (diagnosis.Feature, ("id",)),
    "symptoms": (diagnosis.Symptom, ("id",)),
    "symptom_faults": (diagnosis.SymptomFault, ("symptom", "fault")),
}
"""Table -> what its rows are, and the columns that tell one from another."""
SHORT_SCHEMAS: Final[Mapping[str, tuple[type[TableRow], tuple[str, ...]]]] = {
    "instruments": (short.Instrument, ("id",)),
    "streams": (short.Stream, ("stream",)),
    "guards": (short.NamedGuard, ("name",)),
    "omitted": (short.Omitted, ("table", "row")),
}
"""The same of the tables that only a plant with a table of instruments has: rows of the others follow from them."""
EVERY: Final[Mapping[str, tuple[type[TableRow], tuple[str, ...]]]] = {**SCHEMAS, **SHORT_SCHEMAS}
"""The same of all tables."""
