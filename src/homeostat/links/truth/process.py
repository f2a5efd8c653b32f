"""The process behind a simulated plant: a model with its own true parameters, faults and noise, tick by tick."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.disturbance import Disturbance
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Trajectory
from homeostat.links.truth.disturbed import Disturbed, Targets
from homeostat.links.truth.moved import Moved, end, forget_moved
from homeostat.links.truth.recorded import TruthRecord
from homeostat.process.batch import ProcessError, tick_of
from homeostat.process.model import ProcessModel, column
from homeostat.process.schedule import InputRamp
from homeostat.process.truth import TrueModel
from homeostat.process.types import Table, Vec


@dataclass(frozen=True, slots=True)
class Departed:
    """How a true plant differs from its process model."""

    model: TrueModel
    """Equations of the true plant."""
    parameters: Vec
    """Its own parameters, shape (departures.parameters,)."""
    disturbances: tuple[Disturbance, ...] = ()
    """What happens to it."""
    seed: int = 0
    """Of the courses that chance gives what happens to it."""


@dataclass(frozen=True, slots=True)
class PlantConfiguration:
    """What the plant truly is; the twin never sees this."""

    parameters: Vec
    """True parameters, shape (parameters,)."""
    inputs: Vec
    """Inputs at the start, shape (inputs,)."""
    faults: tuple[FaultState, ...]
    """Injected faults."""
    end_s: float
    """Process time at which the run ends [s]."""
    noise_seed: int
    """Seed of the disturbances and the sensor noise."""
    noise: float = 1.0
    """Scale of all noise; 0 for a quiet plant."""
    departed: Departed | None = None
    """How it differs from its process model; None where it is one."""
    repaired_s: float = math.inf
    """Process time at which every fault ends [s]."""
    wandering: float = 1.0
    """Scale of what comes from outside and varies by the model, beside ``noise``; 0 where it stands still [1]."""


class TrueProcess:
    """Implements :class:`homeostat.links.virtual.VirtualPlant` over a process model."""

    def __init__(
        self, model: ProcessModel, plant: PlantDescription, configuration: PlantConfiguration, record: bool = True
    ) -> None:
        """``plant`` says which tag shows which variable of the model; ``record`` keeps the whole truth, for scoring.

        Raises:
            ValueError: a true parameter or the size of a fault is not finite.
            KeyError: the model has no such fault.
            DisturbanceError: the plant cannot have one of the disturbances.
        """
        wrong = np.flatnonzero(~np.isfinite(configuration.parameters))
        if wrong.size:
            name, value = model.parameters[wrong[0]], float(configuration.parameters[wrong[0]])
            raise ValueError(f"true parameter {name!r} is {value!r}; must be finite")
        self._model = model
        self._variables, self._automatic = plant.variables, plant.automatic
        self._usual, state = configuration.parameters, model.initial_state(configuration.parameters)
        self._kernel, self._disturbed = model.kernel, None
        if departed := configuration.departed:
            self._kernel = departed.model.kernel
            self._usual = np.concatenate([self._usual, departed.parameters])
            state = np.concatenate([state, departed.model.own_states(state)])
            targets = Targets(model, departed.model.departures, plant)
            self._disturbed = Disturbed(targets, departed.disturbances, tick_of(model.kernel), departed.seed)
        self._parameters, self._state = np.array(self._usual, dtype=np.float64, ndmin=2), state.reshape(1, -1)
        self._plant = plant
        self.inject(configuration.faults)
        self._repaired_s = configuration.repaired_s
        self._ramp = InputRamp(model.inputs, configuration.inputs, tick_of(model.kernel))
        self._seeds = np.array([configuration.noise_seed], dtype=np.int64)
        self._noise = np.array([configuration.noise], dtype=np.float64)
        self._wandering = configuration.wandering * self._noise
        self._picks = np.empty(0, dtype=np.int64)
        self._out = np.empty((1, 1, 0))
        self._index = np.zeros(1, dtype=np.int64)
        self._record = TruthRecord() if record else None
        self._writable = {tag: model.inputs.index(v) for tag, v in self._variables.items() if v in model.inputs}
        self._accepted = self._targets()
        self._timing, self._reached = plant.timing, 0
        self.now_s = 0.0
        """Process time [s]."""
        self.end_s = configuration.end_s
        """Process time at which the run ends [s]."""

    @property
    def accepted(self) -> Mapping[str, float | None]:
        """Writable tag -> the target that was accepted last, in the tag's unit; None for automatic."""
        return self._accepted

    @property
    def manual(self) -> frozenset[str]:
        """Writable tags that may be handed back to automatic."""
        return frozenset(tag for tag in self._writable if self._variables[tag] in self._automatic)

    def command(self, commands: tuple[Command, ...]) -> None:
        """Ramp to ``commands`` from the next tick on; ValueError, and none is taken, where one cannot be."""
        if not commands:
            return  # a ramp that starts again from where it is rounds differently
        readings = self._model.readings(self._state[0], self._ramp.current)
        present = {manual: readings[command] for manual, command in self._automatic.items()}
        self._ramp.command(commands, self._variables, present)
        self._accepted = self._targets()

    def advance(self) -> Mapping[str, float]:
        """One tick later: tag -> reading in the tag's unit; ProcessError where the plant left the physical world."""
        moves = self._moved.moves
        if moves:
            self._parameters[0] = self._usual
            forget_moved(moves)
        if self._disturbed is not None:
            self.command(self._disturbed.commands(self._accepted, self.now_s))
            self._disturbed.act(self._usual, self._parameters[0], self.now_s)
        if self.now_s >= self._repaired_s:
            self._severity[:], self._onset[:] = 0.0, np.inf
            end(moves)
        inputs = self._ramp.advance()
        if self._disturbed is not None:
            inputs = self._disturbed.inputs(inputs, self.now_s)
        inputs = moves.arriving(inputs[None], self.now_s)[0]
        faults = self._severity, self._onset
        self._moved.hold(moves, self._state, self._parameters, *faults, self.now_s)
        broken, begin = np.full(1, np.nan), np.zeros(1, dtype=np.int64)
        member = self._state, self._parameters, *faults, inputs[None, None], self._index
        noise = self._seeds, self._wandering, self._noise
        self._kernel(0, 1, *member, self.now_s, begin, 1, 1, *noise, self._picks, self._out, broken, moves)
        if not math.isnan(broken[0]):
            raise ProcessError(f"the simulated plant left the physical world at t = {broken[0]:.10g} s")
        self._reached += 1
        self.now_s = self._timing.at_s(self._reached)
        if self._record is not None:
            self._record.append(self._state[0, : len(self._model.states)], inputs)
        readings = self._model.readings(self._state[0], inputs)
        return {tag: readings[v] for tag, v in self._variables.items()}

    @property
    def reached(self) -> tuple[Vec, Vec]:
        """The true state, shape (states,), and the inputs, shape (inputs,), at :attr:`now_s`."""
        return self._state[0, : len(self._model.states)].copy(), np.array(self._ramp.current)

    def inject(self, faults: tuple[FaultState, ...]) -> None:
        """Let ``faults`` act instead of those before, from their onsets on; raises as the constructor does."""
        moved = Moved(self._model, self._plant, faults)
        self._severity, self._onset = fault_tables(self._model, faults, moved)
        self._moved, self._parameters[0] = moved, self._usual

    def truth(self) -> Trajectory:
        """True values of every tag and of the model's unmeasured variables; only scoring may look."""
        states, inputs = self._recorded.arrays()
        values = self._model.truth(states[None], inputs[None])
        signals = {tag: values[v] for tag, v in self._variables.items()}
        signals.update({name: v for name, v in values.items() if name not in signals})
        return Trajectory(start_s=tick_of(self._model.kernel), dt_s=tick_of(self._model.kernel), signals=signals)

    def measured(self) -> Trajectory:
        """What the instruments said, every tag."""
        rows = [self._model.readings(*row) for row in zip(*self._recorded.arrays(), strict=True)]
        signals = {tag: np.array([[row[v] for row in rows]]) for tag, v in self._variables.items()}
        return Trajectory(start_s=tick_of(self._model.kernel), dt_s=tick_of(self._model.kernel), signals=signals)

    @property
    def _recorded(self) -> TruthRecord:
        if self._record is None:
            raise ValueError("the truth of this plant was not recorded; open it with record=True")
        if not self._record.length:
            raise ValueError("nothing is recorded before the first tick; advance the plant first")
        return self._record

    def _targets(self) -> Mapping[str, float | None]:
        targets = self._ramp.targets.tolist()
        return {tag: None if math.isnan(targets[i]) else targets[i] for tag, i in self._writable.items()}


def fault_tables(model: ProcessModel, faults: tuple[FaultState, ...], moved: Moved) -> tuple[Table, Table]:
    """Severity and onset rows of one member, shape (1, faults) each, but for what is ``moved``."""
    severity = np.zeros((1, len(model.faults)))
    onset = np.full((1, len(model.faults)), np.inf)
    for fault in faults:
        if fault.fault in moved.names:
            continue
        i = column(model.faults, fault.fault)
        if not math.isfinite(fault.severity) or math.isnan(fault.onset_s):
            raise ValueError(f"{fault!r}: severity must be finite, the onset a time [s]")
        severity[0, i], onset[0, i] = fault.severity, fault.onset_s
    return severity, onset
