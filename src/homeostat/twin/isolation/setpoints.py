"""Setpoints: what a controller really followed, wherever its setpoint comes from."""

from __future__ import annotations

import numpy as np

from homeostat.domain.plant.description import ControlLoop, PlantDescription, Relation
from homeostat.process.model import ProcessModel
from homeostat.process.types import Indices, Table, Vec
from homeostat.twin.history import Window


def followed(window: Window, description: PlantDescription, loop: ControlLoop) -> Vec:
    """The setpoint that ``loop`` followed when it worked out the command of each row, shape (n,), in its unit.

    It is as read where it is commanded. Where another controller or a ratio makes it, it is what the controller reports
    to be off by less than its reading, which is exact: what the other one would send is known only as well as its
    scale is, and not at all while its output stands at a limit. NaN where neither is known.
    """
    variables, unknown = description.variables, np.full(window.length, np.nan)
    given = window.readings.get(variables[loop.setpoint], unknown)
    reading, off = variables[loop.process_variable], _deviation(description, loop)
    if off not in window.readings or reading not in window.readings:
        return given
    told = window.readings[reading] - window.readings[off]
    for each in (reading, off):
        told = np.where(window.held[each], np.nan, told) if each in window.held else told
    return np.where(np.isnan(given), told, given)


def as_followed(window: Window, description: PlantDescription, model: ProcessModel, rows: Indices) -> Table:
    """Inputs of ``rows`` under which each controller follows what it did, shape (rows, inputs)."""
    inputs = window.inputs[rows].copy()
    for loop in description.loops:
        variable = description.variables[loop.setpoint]
        if variable in model.inputs:
            column = inputs[:, model.inputs.index(variable)]
            column[:] = np.where(np.isnan(column), followed(window, description, loop)[rows], column)
    return inputs


def _deviation(description: PlantDescription, loop: ControlLoop) -> str:
    """Variable of what the controller of ``loop`` reports to be off by; empty where it reports none."""
    own = (s for s in description.signals if s.component == loop.controller and s.relation is Relation.REPORTS)
    return next((s.variable for s in own if s.tag.name.startswith(f"{loop.process_variable}.")), "")
