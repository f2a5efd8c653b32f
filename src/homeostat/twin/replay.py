"""Replay: drive the model with recorded commands from a state that agrees with the readings."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from homeostat.process.batch import Batch, BatchResult, simulate, tick_of
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Move, MoveKind, Moves, moved_inputs
from homeostat.process.types import Cube, Indices, Table, Vec
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
    refuse: bool = True,
) -> Replay:
    """Follow ``window`` with every member open loop.

    ``offset`` adds to the initial states, shape (members, states). Raises ProcessError as the engine does; without
    ``refuse`` the state of a member that leaves the physical world on its way is NaN, and all others go on.
    """
    states = starting_states(model, window, parameters, carried, variables)
    if offset is not None:
        states = states + offset
    result = _run(model, window, states, parameters, carried, variables, window.length - 1, refuse)
    return Replay(result.record, result.state)


def replay_ends(
    model: ProcessModel,
    window: Window,
    parameters: Vec,
    before: Carried,
    after: Carried,
    variables: tuple[str, ...],
    ends: Indices,
) -> Replay:
    """Follow ``window`` with one member that goes on as ``after`` from each of the ticks ``ends`` on, 1 at least.

    ``before``, ``after``: what it carries, one each; ``parameters``: shape (parameters,). One member for each end.
    Raises ProcessError as the engine does.
    """
    shown, name = [model.shown[v] for v in variables], model.states.__getitem__
    states = starting_states(model, window, parameters[None], before, variables)
    until = open_loop(model, window, states, parameters[None], before)
    whole = tuple(range(len(model.states)))
    until = replace(until, record=whole, steps=int(ends.max()), moves=Moves.of(before.moves) if before.moved else None)
    there = simulate(model.kernel, until, name).record[0]
    count = len(ends)
    rest = open_loop(model, window, there[ends - 1], np.tile(parameters, (count, 1)), after.repeated(count))
    moves = Moves.of(after.moves * count) if after.moved else None
    rest = replace(rest, record=tuple(shown), begin=ends.astype(np.int64), moves=moves)
    result = simulate(model.kernel, rest, name)
    for m, end in enumerate(ends.tolist()):
        result.record[m, :end] = there[:end, shown]
    return Replay(result.record, result.state)


def starting_states(
    model: ProcessModel, window: Window, parameters: Table, carried: Carried, variables: tuple[str, ...]
) -> Table:
    """States at the beginning of ``window``, shape (members, states).

    Each is that of the smoothed readings, moved so that the member's own instruments (with their calibration and
    faults) would show them; those that were stuck before it show nothing. What no instrument shows stands where the
    member's own faults have put it: a valve that was stuck before the window does not move into its place within it.
    Where such a state has been for long, it stands where it was followed to.
    """
    first, taken = window.begun(model.estimate)
    states = np.tile(taken, (len(parameters), 1))
    commanded = model.replay_inputs(window.readings, window.inputs)[:1]
    arrived, follows = moved_inputs(commanded, carried.moves, window.start_s, tick_of(model.kernel))
    model.settle(states, arrived[follows, 0], parameters, carried.severity, carried.onset_s, window.start_s)
    shown = _run(model, window, states, parameters, carried, variables, 1).record
    correct(model, states, {v: first[v] - shown[:, 0, j] for j, v in enumerate(variables)}, carried, window.start_s)
    return states


def correct(model: ProcessModel, states: Table, residuals: Mapping[str, Vec], carried: Carried, at_s: float) -> None:
    """Move ``states`` in place by ``residuals``, each member by instruments that are not stuck at ``at_s`` [s].

    What a stuck one shows says nothing of the process: as a residual of nothing it would hold a state where it was.
    """
    blind = [_stuck(model, own, residuals, at_s) for own in carried.moves]
    if not any(blind):
        model.correct(states, residuals)
        return
    for unseen in dict.fromkeys(blind):
        rows = np.array([k for k, own in enumerate(blind) if own == unseen])
        mine = states[rows]
        model.correct(mine, {v: r[rows] for v, r in residuals.items() if v not in unseen})
        states[rows] = mine


def _stuck(model: ProcessModel, moves: Sequence[Move], variables: Collection[str], at_s: float) -> frozenset[str]:
    """Those of ``variables`` whose reading stands still at ``at_s`` [s]."""
    stuck = {move.column for move in moves if move.kind is MoveKind.FROZEN and move.onset_s <= at_s}
    return frozenset(v for v in variables if model.shown[v] in stuck) if stuck else frozenset()


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
    refuse: bool = True,
) -> BatchResult:
    shown = tuple(model.shown[v] for v in variables)
    batch = replace(open_loop(model, window, states, parameters, carried), record=shown, steps=steps)
    name = model.states.__getitem__
    if carried.moved:
        return simulate(model.kernel, replace(batch, moves=Moves.of(carried.moves)), name, refuse)
    return simulate_with_prefix(model.kernel, batch, name, refuse)
