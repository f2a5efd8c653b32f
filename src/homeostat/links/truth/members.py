"""Many copies of one true plant at once, as an exhaustive search by hindsight needs them."""

import math
from itertools import pairwise

import numpy as np

from homeostat.domain.plant.description import PlantDescription
from homeostat.links.truth.disturbed import Disturbed, Targets
from homeostat.links.truth.moved import Moved, end, forget_moved
from homeostat.links.truth.process import PlantConfiguration, fault_tables
from homeostat.process.batch import Batch, BatchResult, BatchRun, tick_of
from homeostat.process.model import ProcessModel
from homeostat.process.types import Cube, Table, Vec

PIECE = 5
"""For so many ticks what a disturbance does to a parameter is held."""


class Members:
    """A true plant, again and again: the same parameters, faults, noise and disturbances, other commands.

    What people would do to setpoints does not happen: the commands are those of who searches.
    """

    def __init__(self, model: ProcessModel, plant: PlantDescription, truth: PlantConfiguration) -> None:
        self._model, self._plant, self._truth, departed = model, plant, truth, truth.departed
        self._kernel = departed.model.kernel if departed else model.kernel
        self._usual = np.concatenate([truth.parameters, departed.parameters]) if departed else truth.parameters
        self._disturbed = None
        if departed:
            targets = Targets(model, departed.model.departures, plant)
            self._disturbed = Disturbed(targets, departed.disturbances, tick_of(model.kernel), departed.seed)

    def start(self) -> Vec:
        """The state in which the plant starts, shape (states,)."""
        state, departed = self._model.initial_state(self._truth.parameters), self._truth.departed
        return np.concatenate([state, departed.model.own_states(state)]) if departed else state

    def simulate(
        self, states: Table, inputs: Cube, start_s: float, steps: int, stride: int, refuse: bool = True
    ) -> BatchResult:
        """One member for each of ``inputs`` from ``states`` on; every state of the model is recorded.

        ProcessError where one leaves the physical world; without ``refuse`` it is NaN from then on.
        """
        members = len(states)
        moved = Moved(self._model, self._plant, self._truth.faults, members)
        severity, onset = fault_tables(self._model, self._truth.faults, moved)
        noise = np.full(members, self._truth.noise)
        batch = Batch(
            state=states,
            parameters=np.tile(self._usual, (members, 1)),
            severity=np.tile(severity, (members, 1)),
            onset_s=np.tile(onset, (members, 1)),
            inputs=self._reaching(inputs, start_s, steps, moved),
            input_of=np.arange(members),
            start_s=start_s,
            steps=steps,
            stride=stride,
            record=tuple(range(len(self._model.states))),
            seeds=np.full(members, self._truth.noise_seed),
            process_noise=noise,
            sensor_noise=noise,
            moves=moved.moves if moved else None,
        )
        run = BatchRun(self._kernel, batch, self._model.states.__getitem__, refuse)
        tick_s = tick_of(self._model.kernel)
        repaired = (self._truth.repaired_s - start_s) / tick_s
        every = range(0, steps, PIECE) if self._disturbed or moved else (0,)
        pieces = sorted({*every, steps, *_whole(repaired, steps)})
        for reached, until in pairwise(pieces):
            if self._disturbed is not None:
                row = self._usual.copy()
                self._disturbed.act(self._usual, row, start_s + reached * tick_s)
                run.parameters[:] = row
                forget_moved(run.moves)
            if reached >= repaired:
                run.severity[:], run.onset_s[:] = 0.0, np.inf
                end(run.moves)
            moved.hold(run.moves, run.state, run.parameters, run.severity, run.onset_s, start_s + reached * tick_s)
            run.advance(until)
        return BatchResult(run.record, run.state)

    def _reaching(self, inputs: Cube, start_s: float, steps: int, moved: Moved) -> Cube:
        """What of the commanded ``inputs`` reaches the plant, tick by tick; ``inputs`` stay as they are."""
        disturbed = self._disturbed if self._disturbed and self._disturbed.acts_on_inputs else None
        if disturbed is None and not moved:
            return inputs
        reached = inputs.copy()
        for k in range(steps):
            at_s = start_s + k * tick_of(self._model.kernel)
            if disturbed is not None:
                for schedule in reached:
                    schedule[k] = disturbed.inputs(schedule[k], at_s)
            if at_s < self._truth.repaired_s:
                reached[:, k] = moved.moves.arriving(reached[:, k], at_s)
        return reached


def _whole(tick: float, steps: int) -> tuple[int, ...]:
    """``tick`` as a whole number, where it lies in the ``steps``."""
    return (math.ceil(tick),) if 0.0 < tick < steps else ()
