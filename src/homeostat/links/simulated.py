"""A simulated plant: a process model with its own true parameters that keeps running while agents think."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass

import numpy as np

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.ports import Clock
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.process.batch import ProcessError
from homeostat.process.model import ProcessModel, column
from homeostat.process.schedule import InputRamp
from homeostat.process.types import Row


@dataclass(frozen=True, slots=True)
class PlantConfiguration:
    """What the plant truly is; the twin never sees this."""

    parameters: Row
    """True parameters, shape (parameters,)."""
    inputs: Row
    """Inputs at the start, shape (inputs,)."""
    faults: tuple[FaultState, ...]
    """Injected faults."""
    end_s: float
    """Process time at which the run ends [s]."""
    noise_seed: int
    """Seed of the disturbances and the sensor noise."""
    noise: float = 1.0
    """Scale of all noise; 0 for a quiet plant."""


class SimulatedPlant:
    """Implements :class:`homeostat.domain.ports.Plant` over a process model; one second per snapshot."""

    def __init__(
        self, model: ProcessModel, variables: Mapping[str, str], configuration: PlantConfiguration, clock: Clock,
        sample: Callable[[Snapshot], tuple[Command, ...]] | None = None,
    ) -> None:  # fmt: skip
        """``variables``: tag -> variable of the model; ``sample``: what the basic control system commands after each
        snapshot, whoever thinks meanwhile."""
        self._sample = sample
        wrong = np.flatnonzero(~np.isfinite(configuration.parameters))
        if wrong.size:
            name, value = model.parameters[wrong[0]], float(configuration.parameters[wrong[0]])
            raise ValueError(f"true parameter {name!r} is {value!r}; must be finite")
        self._model = model
        self._variables = dict(variables)
        self._clock = clock
        self._end_s = configuration.end_s
        self._parameters = np.array(configuration.parameters, dtype=np.float64, ndmin=2)
        self._state = model.initial_state(configuration.parameters).reshape(1, -1)
        self._severity, self._onset = fault_tables(model, configuration.faults)
        self._ramp = InputRamp(model.inputs, configuration.inputs)
        self._seeds = np.array([configuration.noise_seed], dtype=np.int64)
        self._noise = np.array([configuration.noise])
        self._now_s = 0.0
        self._owed_s = 0.0
        self._states: list[Row] = []
        self._inputs: list[Row] = []
        self._snapshots: list[Snapshot] = []
        self._picks = np.empty(0, dtype=np.int64)
        self._out = np.empty((1, 1, 0))
        self._index = np.zeros(1, dtype=np.int64)

    async def snapshots(self) -> AsyncIterator[Snapshot]:
        """One snapshot per second, those that passed while agents thought included, until the end of the run."""
        given = 0
        while True:
            if given == len(self._snapshots):
                self._catch_up()
            if given == len(self._snapshots):
                if self._now_s >= self._end_s:
                    return
                self._step()
            yield self._snapshots[given]
            given += 1

    async def since(self, at_s: float) -> tuple[Snapshot, ...]:
        """Snapshots after ``at_s``; the time that thinking took has passed. At least the freshest one."""
        self._catch_up()
        if not self._snapshots:
            self._step()
        first = min(max(int(at_s), 0), len(self._snapshots) - 1)
        return tuple(self._snapshots[first:])

    async def write(self, commands: tuple[Command, ...]) -> None:
        """Hand commands to the basic control system, which ramps them from the next second on."""
        self._catch_up()
        self._command(commands)

    def _command(self, commands: tuple[Command, ...]) -> None:
        readings = self._model.readings(self._state[0], self._ramp.current)
        present = {name: readings[name.replace("_man", "_cmd")] for name in self._model.inputs if name.endswith("_man")}
        self._ramp.command(commands, self._variables, present)

    def truth(self) -> Trajectory:
        """True values of every tag and of the model's unmeasured variables; only scoring may look."""
        record, inputs = np.stack(self._states)[None], np.stack(self._inputs)[None]
        values = self._model.truth(record, inputs)
        signals = {tag: values[v] for tag, v in self._variables.items()}
        signals.update({name: v for name, v in values.items() if name not in signals})
        return Trajectory(start_s=1.0, dt_s=1.0, signals=signals)

    def _catch_up(self) -> None:
        """Let the process time that thinking took pass, in whole seconds; what passed too early is set off later."""
        self._owed_s += self._clock.collect_s()
        seconds = max(math.ceil(self._owed_s - 1e-9), 0)
        self._owed_s -= seconds
        for _ in range(seconds):
            if self._now_s < self._end_s:
                self._step()

    def _step(self) -> None:
        """One second of the plant."""
        inputs = self._ramp.advance()
        broken = np.full(1, np.nan)
        self._model.kernel(
            0, 1, self._state, self._parameters, self._severity, self._onset, inputs[None, None], self._index,
            self._now_s, self._index, 1, 1, self._seeds, self._noise, self._noise, self._picks, self._out, broken,
        )  # fmt: skip
        if not math.isnan(broken[0]):
            raise ProcessError(f"the simulated plant left the physical world at t = {broken[0]:.0f} s")
        self._now_s += 1.0
        self._states.append(self._state[0].copy())
        self._inputs.append(inputs)
        readings = self._model.readings(self._state[0], inputs)
        snapshot = Snapshot(self._now_s, {tag: readings[v] for tag, v in self._variables.items()})
        self._snapshots.append(snapshot)
        if self._sample is not None and (commands := self._sample(snapshot)):
            self._command(commands)


def fault_tables(model: ProcessModel, faults: tuple[FaultState, ...]) -> tuple[Row, Row]:
    """Severity and onset rows of one member, shape (1, faults) each."""
    severity = np.zeros((1, len(model.faults)))
    onset = np.full((1, len(model.faults)), np.inf)
    for fault in faults:
        i = column(model.faults, fault.fault)
        if not math.isfinite(fault.severity) or math.isnan(fault.onset_s):
            raise ValueError(f"{fault!r}: severity must be finite, the onset a time [s]")
        severity[0, i], onset[0, i] = fault.severity, fault.onset_s
    return severity, onset
