"""Replay: drive the model with recorded commands from a state that agrees with the readings."""

from dataclasses import dataclass, replace

import numpy as np

from homeostat.process.batch import Batch, BatchResult, simulate, tick_of
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Moves, moved_inputs
from homeostat.process.types import Cube, Table
from homeostat.twin.carried import Carried
from homeostat.twin.history import Window
from homeostat.twin.shared_prefix import simulate_with_prefix


@dataclass(frozen=True, slots=True)
class Replay:
    """What the model says the instruments should have shown."""

    predicted: Cube
    """Noise-free readings, shape (members, times, variables), for every tick of the window but the first."""
    state: Table
    """States at the end of the window, shape (members, states)."""


def replay(
    model: ProcessModel,
    window: Window,
    parameters: Table,
    carried: Carried,
    variables: tuple[str, ...],
    offset: Table | None = None,
) -> Replay:
    """Follow ``window`` with every member open loop.

    ``offset`` adds to the initial states, shape (members, states). Raises ProcessError as the engine does.
    """
    states = starting_states(model, window, parameters, carried, variables)
    if offset is not None:
        states = states + offset
    result = _run(model, window, states, parameters, carried, variables, window.length - 1)
    return Replay(result.record, result.state)


def starting_states(
    model: ProcessModel, window: Window, parameters: Table, carried: Carried, variables: tuple[str, ...]
) -> Table:
    """States at the beginning of ``window``, shape (members, states).

    Each is that of the smoothed readings, moved so that the member's own instruments (with their calibration and
    faults) would show them. What no instrument shows stands where the member's own faults have put it: a valve that was
    stuck before the window does not move into its place within it.
    """
    first = window.beginning
    states = np.tile(model.estimate(first | _manual(window)), (len(parameters), 1))
    commanded = model.replay_inputs(window.readings, window.inputs)[:1]
    arrived, follows = moved_inputs(commanded, carried.moves, window.start_s, tick_of(model.kernel))
    model.settle(states, arrived[follows, 0], parameters, carried.severity, carried.onset_s, window.start_s)
    shown = _run(model, window, states, parameters, carried, variables, 1).record
    model.correct(states, {v: first[v] - shown[:, 0, j] for j, v in enumerate(variables)})
    return states


def open_loop(model: ProcessModel, window: Window, states: Table, parameters: Table, carried: Carried) -> Batch:
    """Members that follow the commands of ``window`` from ``states`` on, without noise; nothing is recorded yet.

    ``states``: shape (members, states); ``parameters``: shape (members, parameters); ``carried`` has one for each.
    """
    members = len(states)
    commanded = model.replay_inputs(window.readings, window.inputs)[1:]
    inputs, follows = moved_inputs(commanded, carried.moves, window.start_s, tick_of(model.kernel))
    return Batch(
        state=states,
        parameters=parameters,
        severity=carried.severity,
        onset_s=carried.onset_s,
        inputs=inputs,
        input_of=follows,
        start_s=window.start_s,
        steps=window.length - 1,
        stride=1,
        record=(),
        seeds=np.zeros(members, dtype=np.int64),
        process_noise=np.zeros(members),
        sensor_noise=np.zeros(members),
    )


def _run(
    model: ProcessModel,
    window: Window,
    states: Table,
    parameters: Table,
    carried: Carried,
    variables: tuple[str, ...],
    steps: int,
) -> BatchResult:
    shown = tuple(model.shown[v] for v in variables)
    batch = replace(open_loop(model, window, states, parameters, carried), record=shown, steps=steps)
    name = model.states.__getitem__
    if carried.moved:
        return simulate(model.kernel, replace(batch, moves=Moves.of(carried.moves)), name)
    return simulate_with_prefix(model.kernel, batch, name)


def _manual(window: Window) -> dict[str, float]:
    """Readings that must not be averaged: the first of those that are not finite throughout."""
    return {v: float(r[0]) for v, r in window.readings.items() if not np.all(np.isfinite(r))}
