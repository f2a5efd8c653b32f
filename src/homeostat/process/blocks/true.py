"""The true plant of a simulated run from a flowsheet: its model's with other laws, and what no twin of it knows."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from homeostat.process.batch import Kernel
from homeostat.process.blocks.composed import ComposedModel, compiled_kernel
from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.term import Leaf, Term, evaluate
from homeostat.process.departures import Departures
from homeostat.process.truth import TrueModel
from homeostat.process.types import Vec


@dataclass(frozen=True, eq=False)
class TrueFlowsheet:
    """What a plant truly is: the flowsheet of its model with other laws and more states, and departures."""

    sheet: Flowsheet
    """Neutral parameters of the plant's own make it the model."""
    departures: Departures
    """What stands before actuators and behind instruments, and the plant's own parameters."""

    def behind(self, model: ComposedModel) -> TrueModel:
        """The true plant behind ``model``; FlowsheetError where it has other inputs than that, or lacks a state."""
        return _true_plant(self, model)


@final
class TruePlant:
    """A :class:`~homeostat.process.truth.TrueModel` of a flowsheet: its model's, and what no twin of it knows."""

    def __init__(self, sheet: Flowsheet, model: ComposedModel, departures: Departures) -> None:
        """``sheet``: the flowsheet of ``model`` with other laws and more states; neutral parameters make it the model.

        FlowsheetError where it has other inputs than the model, or not all of its states.
        """
        self.departures = departures
        """Its own parameters."""
        self._layout = Layout.true(sheet, model.layout, departures)
        self.kernel: Kernel = compiled_kernel(self._layout)
        """Compiled code that advances the states."""

    def own_states(self, state: Vec) -> Vec:
        """Nothing lags yet, instruments show what they show, and what it has more begins as its flowsheet says."""
        at, sheet = self._layout.column, self._layout.sheet
        values: dict[Term, Any] = {Term(Leaf.HELD, value=n): v for n, v in zip(at, state.tolist(), strict=False)}
        values |= {s.term: values.get(Term(Leaf.HELD, value=n), np.nan) for n, s in sheet.states.items()}
        shown = [float(state[at[name]]) for name in self.departures.instruments]
        extra = [evaluate(sheet.states[n].start, values) if n in sheet.states else 0.0 for n in self._layout.extra]
        return np.array([*self.departures.begin(shown), *extra])


@functools.lru_cache(maxsize=8)
def plain_truth(model: ComposedModel) -> TrueModel:
    """The true plant behind ``model`` where nobody wrote one: its own flowsheet, and what any plant may depart by.

    It departs before every actuator and behind every instrument, and has no parameters of its own.
    """
    sheet = model.flowsheet
    return TruePlant(sheet, model, Departures(tuple(sheet.actuators), tuple(sheet.sensors)))


@functools.lru_cache(maxsize=8)
def _true_plant(flowsheet: TrueFlowsheet, model: ComposedModel) -> TruePlant:
    return TruePlant(flowsheet.sheet, model, flowsheet.departures)
