"""Input errors: what a model gets wrong that is right about where the plant stands, once the plant is moved.

An input does a little less or more than the model says, and a little later; a reading may come late as well. A valve
that begins to move a second late leaves a level that is off for as long as it stands: no constant error and no
parameter of the model is that. What follows are directions in which readings may differ although nothing is wrong.
"""

from dataclasses import replace

import numpy as np

from homeostat.process.batch import Batch, simulate
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Moves
from homeostat.process.types import Cube, Indices, Table, Vec
from homeostat.twin.carried import Carried
from homeostat.twin.history import Window
from homeostat.twin.replay import open_loop, starting_states

SETTLED = 15
"""Ticks at the beginning of a window that say where an input stood then."""
LATE = (1, 2)
"""By how many ticks commands and readings are late in the directions: a dead time and a lag differ in both."""


def weaker_inputs(
    model: ProcessModel, window: Window, parameters: Table, carried: Carried, variables: tuple[str, ...], share: float
) -> Cube:
    """Changes of readings where what an input moved by did less by ``share`` [1], shape (moved, ticks, variables).

    ``parameters``: shape (1, parameters); ``carried`` is what one member carries.
    """
    batch = _one(model, window, parameters, carried, variables)
    own, schedules = _given(batch), []
    for i in _moving(own).tolist():
        schedules.append(own.copy())
        schedules[-1][:, i] -= share * (own[:, i] - own[0, i])
    return _changes(model, batch, carried, np.stack([own, *schedules]))[1]


def distant_inputs(
    model: ProcessModel,
    window: Window,
    parameters: Table,
    carried: Carried,
    variables: tuple[str, ...],
    share: float,
    usual: Vec,
) -> Cube:
    """Changes of readings where an input that stands elsewhere than usual does less of it by ``share`` [1].

    A model is right where it was learned; how far an input stands from there is how far it is wrong, although it stands
    still throughout the window. ``usual``: where each input stood then, shape (inputs,). Shape of the result: (inputs
    that are known, ticks, variables).
    """
    batch = _one(model, window, parameters, carried, variables)
    own, schedules = _given(batch), []
    for i in np.flatnonzero(np.all(np.isfinite(own), axis=0) & np.isfinite(usual) & (own[0] != usual)).tolist():
        schedules.append(own.copy())
        schedules[-1][:, i] -= share * (float(np.mean(own[:SETTLED, i])) - usual[i])
    return _changes(model, batch, carried, np.stack([own, *schedules]))[1]


def late_inputs(
    model: ProcessModel, window: Window, parameters: Table, carried: Carried, variables: tuple[str, ...], lag: float
) -> Cube:
    """Changes of readings by lags of ``lag`` ticks, shape (directions, ticks, variables); arguments as above."""
    batch = _one(model, window, parameters, carried, variables)
    own, schedules, size = _given(batch), [], []
    for late in LATE:
        for i in _moving(own).tolist():
            schedules.append(own.copy())
            schedules[-1][late:, i], schedules[-1][:late, i] = own[:-late, i], own[0, i]
            size.append(lag / late)
    shown, change = _changes(model, batch, carried, np.stack([own, *schedules]))
    of_actuators = change * np.array(size)[:, None, None]
    return np.concatenate([of_actuators, *(_of_instruments(shown, late, lag / late) for late in LATE)])


def _one(model: ProcessModel, window: Window, parameters: Table, carried: Carried, variables: tuple[str, ...]) -> Batch:
    start = starting_states(model, window, parameters, carried, variables)
    batch = open_loop(model, window, start, parameters, carried)
    return replace(batch, record=tuple(model.shown[v] for v in variables))


def _given(batch: Batch) -> Table:
    """The inputs of the one member of ``batch``, shape (ticks, inputs)."""
    return np.asarray(batch.inputs[batch.input_of[0]])


def _moving(own: Table) -> Indices:
    """Columns of inputs that are known and do not stand still."""
    return np.flatnonzero(np.any(own != own[0], axis=0) & np.all(np.isfinite(own), axis=0))


def _changes(model: ProcessModel, batch: Batch, carried: Carried, schedules: Cube) -> tuple[Table, Cube]:
    """What the first of ``schedules`` shows, and by how much the others differ from it."""
    count = len(schedules)
    members = batch.members(np.zeros(count, dtype=np.int64))
    many = replace(members, inputs=schedules, input_of=np.arange(count))
    many = replace(many, moves=Moves.of(carried.repeated(count).moves))
    shown = simulate(model.kernel, many, model.states.__getitem__).record
    return shown[0], shown[1:] - shown[0]


def _of_instruments(shown: Table, late: int, size: float) -> Cube:
    """What each reading of ``shown``, shape (ticks, variables), changes by where it comes ``late`` ticks."""
    change = np.zeros((shown.shape[1], *shown.shape))
    for j in range(shown.shape[1]):
        change[j, late:, j] = (shown[:-late, j] - shown[late:, j]) * size
    return change
