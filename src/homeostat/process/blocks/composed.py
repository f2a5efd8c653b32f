"""The process model that follows from a flowsheet."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from homeostat.process.batch import Kernel
from homeostat.process.blocks.code.source import kernel_source
from homeostat.process.blocks.code.steps import aged, begun, coloured, commanded, sensed, shifted, stuck
from homeostat.process.blocks.flowsheet import COMMANDS, SETPOINTS, Flowsheet
from homeostat.process.blocks.hydraulics.solver import solve_network
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.parts import fault
from homeostat.process.blocks.present.estimation import Estimation, unseen_states
from homeostat.process.blocks.present.resuming import resume_controllers
from homeostat.process.blocks.term import TICK, Leaf, Term, evaluate
from homeostat.process.compiled import compiled
from homeostat.process.departures import reached, restore, show
from homeostat.process.equipment import approach, lag_share, pid_integral, pid_output, pid_tracking
from homeostat.process.kernel import Columns, CompiledKernel
from homeostat.process.types import Cube, Table, Vec

MEASURED = 120
"""Readings whose mean says how what comes in has been lately."""
_BLOCKS: Mapping[str, Any] = {
    "math": math, "approach": approach, "lag_share": lag_share,
    "aged": aged, "begun": begun, "coloured": coloured, "commanded": commanded, "sensed": sensed, "shifted": shifted,
    "stuck": stuck,
    "pid_integral": pid_integral, "pid_output": pid_output, "pid_tracking": pid_tracking,
    "reached": reached, "restore": restore, "show": show,
    "solve_network": solve_network,
}  # fmt: skip


class ComposedModel:
    """A :class:`~homeostat.process.model.ProcessModel` of a flowsheet; everything in it is generated."""

    def __init__(
        self,
        sheet: Flowsheet,
        stated: Mapping[str, float],
        faults: Collection[str],
        tick_s: float = 1.0,
        home: str = "",
    ) -> None:
        """``stated``: symbol -> best estimate of every parameter; ``faults``: those of the plant's tables.

        ``tick_s``: time between two samples of the plant [s]; ``home``: name of the module that the flowsheet is in.

        FlowsheetError where the flowsheet is not complete.
        """
        self.layout = layout = Layout.of(sheet, faults, tick_s)
        """Its columns."""
        self.flowsheet = sheet
        """What it follows from."""
        self.home = home
        """Name of the module that the flowsheet is in; empty where it is in none."""
        self.states: tuple[str, ...] = layout.states
        self.parameters: tuple[str, ...] = layout.parameters
        self.inputs: tuple[str, ...] = layout.inputs
        self.faults: tuple[str, ...] = layout.faults
        errors = dict.fromkeys(f"{c.measured}_err" for c in sheet.controllers.values())
        commands = [a.command for a in sheet.actuators.values() if a.automatic is not None]
        moving = [f"{a.name}_{what}" for a in sheet.actuators.values() for what in ("rate", "travel")]
        self._read = {name: layout.column[name] for name in (*sheet.sensors, *commands, *moving)}
        self.variables: tuple[str, ...] = (*self._read, *self.inputs, *errors)
        self.shown: Mapping[str, int] = self._read
        self.sampled: Mapping[str, float] = {s.name: s.every_s for s in sheet.sensors.values() if s.every_s > tick_s}
        """Instrument that shows each of its samples for some ticks -> time between two of them [s]."""
        self._estimation = Estimation(layout, stated)
        self.unseen: tuple[str, ...] = unseen_states(layout)
        self.kernel: Kernel = compiled_kernel(layout)

    def initial_state(self, parameters: Vec) -> Vec:
        """State in which the plant starts: as the flowsheet says, actuators where they start, instruments true."""
        x, at = np.zeros(len(self.states)), self.layout.column
        values = self._parameter_values(parameters)
        for s in self.flowsheet.states.values():
            x[at[s.name]] = evaluate(s.start, values)
        for a in self.flowsheet.actuators.values():
            x[[at[name] for name in (*a.positions, a.command)]] = a.start
        for kept in self.flowsheet.memories.values():
            x[at[kept.name]] = kept.start
        for d in self.flowsheet.disturbances.values():
            x[at[str(d.now.value)]] = values[Term(Leaf.PARAMETER, value=d.name)]
        self._estimation.fill(x, parameters)
        return x

    def readings(self, state: Vec, inputs: Vec) -> Mapping[str, float]:
        """Variable -> what the instruments say."""
        values = state.tolist()
        read = {name: values[i] for name, i in self._read.items()}
        read.update(zip(self.inputs, inputs.tolist(), strict=True))
        for c in self.flowsheet.controllers.values():
            used = read[c.given] if not math.isnan(read[c.given]) else values[self.layout.column[str(c.used.value)]]
            read[f"{c.measured}_err"] = read[c.measured] - used
        return read

    def truth(self, record: Cube, inputs: Cube) -> Mapping[str, NDArray[np.float64]]:
        """Variable -> true values; deviations as the loops see them, travel from the first sample on."""
        at = self.layout.column
        values = {name: record[:, :, at[name]] for name in self.layout.told}
        values |= {name: record[:, :, i] for name, i in self._read.items()}
        values |= {s.name: record[:, :, at[s.true]] for s in self.flowsheet.sensors.values()}
        shape = record.shape[:2]
        for k, name in enumerate(self.inputs):
            values[name] = np.broadcast_to(inputs[:, :, k], shape)
        for c in self.flowsheet.controllers.values():
            ideal, used = (record[:, :, at[n]] for n in (self.flowsheet.sensors[c.measured].ideal, str(c.used.value)))
            values[f"{c.measured}_err"] = ideal - np.where(np.isnan(values[c.given]), used, values[c.given])
        for a in self.flowsheet.actuators.values():
            travel = record[:, :, at[f"{a.name}_travel"]]
            values[f"{a.name}_travel"] = travel - travel[:, :1]
        return values

    def estimate(self, readings: Mapping[str, float]) -> Vec:
        """A state that agrees with smoothed readings; what no instrument shows, where they say, or a run begins."""
        found = self._estimation.estimate(readings)
        if self.flowsheet.replayed == SETPOINTS:  # its own controllers act on from there
            steady = {name: np.full(2, value) for name, value in readings.items() if name not in self.unseen}
            for guessed in resume_controllers(self.layout, found[None], steady, self._estimation.parameters):
                found[self.layout.column[guessed]] = readings.get(guessed, found[self.layout.column[guessed]])
        return found

    def settle(
        self, states: Table, inputs: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> None:
        """Actuators whose position no instrument shows stand where commands and faults put them."""
        at, begun = self.layout.column, np.where(onset_s <= at_s, severity, 0.0)
        for a in self.flowsheet.actuators.values():
            if a.name in self._estimation.shown_actuators:
                continue
            command = inputs[:, self.inputs.index(a.manual)]
            stands = np.where(np.isnan(command), states[:, at[a.command]], command)
            for name, sign, rest in ((a.stuck_closed, -1.0, 1.0), (a.stuck_open, 1.0, 0.0)):
                if name in self.faults:
                    stuck = begun[:, self.faults.index(name)]
                    stands = np.where(stuck > 0.0, rest + sign * stuck, stands)
            for column in a.positions:
                states[:, at[column]] = np.clip(stands, 0.0, 1.0)

    def correct(self, states: Table, residuals: Mapping[str, Vec]) -> None:
        """Move what instruments show of the states by what they say beyond the model."""
        self._estimation.correct(states, residuals)

    def resume(self, states: Table, readings: Mapping[str, Vec], parameters: Table) -> None:
        """Controllers go on behind the present commands; what comes in stays as it was measured lately."""
        for name, i in self._read.items():
            if name in readings and not name.endswith("_travel"):
                states[:, i] = readings[name][-1]
        resume_controllers(self.layout, states, readings, parameters[0])
        at, column = self.layout.column, self.parameters.index
        for d in self.flowsheet.disturbances.values():
            if d.measured is None or d.measured not in readings:
                continue
            sensor, read = self.flowsheet.sensors[d.measured], readings[d.measured]
            bias = parameters[:, column(str(sensor.bias.value))]
            mean, now = np.mean(read[-MEASURED:]), read[-1]
            parameters[:, column(d.name)] = mean / (1.0 + bias) if sensor.relative else mean - bias
            states[:, at[str(d.now.value)]] = now / (1.0 + bias) if sensor.relative else now - bias
            if d.sd is not None:
                sd = evaluate(
                    d.sd, {Term(Leaf.PARAMETER, value=n): parameters[:, i] for i, n in enumerate(self.parameters)}
                )
                off = states[:, at[str(d.now.value)]] - parameters[:, column(d.name)]
                states[:, at[d.coloured]] = off / np.where(sd > 0.0, sd, np.inf)

    def shown_and_true(
        self, states: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> tuple[Mapping[str, Vec], Mapping[str, Vec]]:
        """Noise-free readings of the instruments next to the truth."""
        at, shown, true = self.layout.column, {}, {}
        wrong = {fault(n): np.where(onset_s[:, i] <= at_s, severity[:, i], 0.0) for i, n in enumerate(self.faults)}
        for s in self.flowsheet.sensors.values():
            true[s.name] = states[:, at[s.true]]
            bias = parameters[:, self.parameters.index(str(s.bias.value))]
            ideal = true[s.name] * (1.0 + bias) if s.relative else true[s.name] + bias
            shown[s.name] = ideal + evaluate(s.off, {**self.layout.healthy, **wrong})
        return shown, true

    def replay_inputs(self, readings: Mapping[str, Vec], inputs: Table) -> Table:
        """Recorded commands by hand, or setpoints where the flowsheet says so, and what was read of what comes in."""
        replay = inputs.copy()
        for a in self.flowsheet.actuators.values() if self.flowsheet.replayed == COMMANDS else ():
            if a.automatic is not None and a.command in readings:
                replay[:, self.inputs.index(a.manual)] = readings[a.command]
        for d in self.flowsheet.disturbances.values():
            if d.measured is not None and d.measured in readings:
                replay[:, self.inputs.index(d.reading)] = readings[d.measured]
        return replay

    def _parameter_values(self, parameters: Vec) -> dict[Term, Any]:
        named = zip(self.parameters, parameters.tolist(), strict=True)
        return {TICK: self.layout.tick_s} | {Term(Leaf.PARAMETER, value=n): v for n, v in named}


def compiled_kernel(layout: Layout) -> CompiledKernel:
    """The kernel of ``layout``: its source is run as Python here, and compiled when it is first needed."""
    source = kernel_source(layout)
    room: dict[str, Any] = {"__name__": "flowsheet", **_BLOCKS}
    exec(compile(source, "<kernel of a flowsheet>", "exec"), room)  # written by `kernel_source`, not by anybody else
    for name in re.findall(r"^def (\w+)", source, re.MULTILINE):
        if name != "advance":
            room[name] = compiled(room[name])
    advance: Callable[..., None] = room["advance"]
    columns = Columns(len(layout.states), len(layout.parameters), len(layout.faults), len(layout.inputs))
    return CompiledKernel(advance, columns, scratch=layout.rooms[""], source=source, tick_s=layout.tick_s)
