"""Replay: drive the model with recorded commands from a state that agrees with the readings."""

from dataclasses import dataclass

import numpy as np

from homeostat.domain.diagnosis import FaultState
from homeostat.process.batch import Batch
from homeostat.process.model import ProcessModel, column
from homeostat.process.types import Cube, Table
from homeostat.twin.history import Window
from homeostat.twin.shared_prefix import simulate_with_prefix


@dataclass(frozen=True, slots=True)
class Replay:
    """What the model says the instruments should have shown."""

    predicted: Cube
    """Noise-free readings, shape (members, times, variables), for every second of the window but the first."""
    state: Table
    """States at the end of the window, shape (members, states)."""


def fault_columns(model: ProcessModel, sets: list[tuple[FaultState, ...]]) -> tuple[Table, Table]:
    """Severity and onset of each member, shape (members, faults)."""
    severity = np.zeros((len(sets), len(model.faults)))
    onset = np.full((len(sets), len(model.faults)), np.inf)
    for m, faults in enumerate(sets):
        for f in faults:
            i = column(model.faults, f.fault)
            severity[m, i], onset[m, i] = f.severity, f.onset_s
    return severity, onset


def replay(
    model: ProcessModel,
    window: Window,
    parameters: Table,
    faults: tuple[Table, Table],
    variables: tuple[str, ...],
    offset: Table | None = None,
) -> Replay:
    """Follow ``window`` with every member open loop.

    Each member starts from the smoothed readings at the beginning, moved so that its own instruments (with their
    calibration and faults) would show them. ``offset`` adds to the initial states, shape (members, states).
    """
    severity, onset = faults
    members = parameters.shape[0]
    first = window.mean(0, min(window.settle_rows, window.length))
    states = np.tile(model.estimate(first | _manual(window)), (members, 1))
    inputs = model.replay_inputs(window.readings, window.inputs)[None, 1:]
    picks = tuple(model.shown[v] for v in variables)

    def run(states: Table, inputs: Cube, start_s: float, steps: int) -> tuple[Cube, Table]:
        batch = Batch(
            state=states,
            parameters=parameters,
            severity=severity,
            onset_s=onset,
            inputs=inputs,
            input_of=np.zeros(members, dtype=np.int64),
            start_s=start_s,
            steps=steps,
            stride=1,
            record=picks,
            seeds=np.zeros(members, dtype=np.int64),
            process_noise=np.zeros(members),
            sensor_noise=np.zeros(members),
        )
        result = simulate_with_prefix(model.kernel, batch, model.states.__getitem__)
        return result.record, result.state

    shown, _ = run(states, inputs, window.start_s, 1)
    model.correct(states, {v: first[v] - shown[:, 0, j] for j, v in enumerate(variables)})
    if offset is not None:
        states = states + offset
    predicted, end = run(states, inputs, window.start_s, window.length - 1)
    return Replay(predicted, end)


def _manual(window: Window) -> dict[str, float]:
    """Readings that must not be averaged: the first of those that are not finite throughout."""
    return {v: float(r[0]) for v, r in window.readings.items() if not np.all(np.isfinite(r))}
