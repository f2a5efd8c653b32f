"""Lags: actuators and instruments are slower than the model says, by a little that nobody knows.

A valve that begins to move a second late leaves a level that is off for as long as it stands: no constant error and no
parameter of the model is that. What each command would do a second and two seconds later, and what each reading would
be, are directions in which readings may differ although nothing is wrong.
"""

from dataclasses import replace

import numpy as np

from homeostat.process.batch import Batch
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Movers, simulate_moved
from homeostat.process.types import Cube, Table
from homeostat.twin.carried import Carried
from homeostat.twin.history import Window
from homeostat.twin.replay import open_loop, starting_states

LATE_S = (1, 2)
"""By how much commands and readings are late in the directions [s]: a dead time and a lag differ in both."""


def lag_directions(
    model: ProcessModel, window: Window, parameters: Table, carried: Carried, variables: tuple[str, ...], lag_s: float
) -> Cube:
    """Changes of readings by lags of ``lag_s`` [s], shape (directions, seconds, variables).

    ``parameters``: shape (1, parameters); ``carried`` is what one member carries.
    """
    start = starting_states(model, window, parameters, carried, variables)
    batch = open_loop(model, window, start, parameters, carried)
    schedules = _late(batch)
    count = len(schedules)
    many = replace(
        batch.members(np.zeros(count, dtype=np.int64)),
        inputs=schedules,
        input_of=np.arange(count),
        record=tuple(model.shown[v] for v in variables),
    )
    movers = Movers(carried.repeated(count).moves, -np.inf)
    shown = simulate_moved(model.kernel, many, movers, model.states.__getitem__).record
    size = lag_s / np.array([late for late in LATE_S for _ in range((count - 1) // len(LATE_S))])
    of_actuators = (shown[1:] - shown[0]) * size[:, None, None]
    return np.concatenate([of_actuators, *(_of_instruments(shown[0], late, lag_s / late) for late in LATE_S)])


def _late(batch: Batch) -> Cube:
    """The schedule of ``batch``, and that with each moving input later, shape (1 + directions, seconds, inputs)."""
    own = batch.inputs[0]
    moving = np.flatnonzero(np.any(own != own[0], axis=0))
    found = [own]
    for late in LATE_S:
        for i in moving.tolist():
            schedule = own.copy()
            schedule[late:, i], schedule[:late, i] = own[:-late, i], own[0, i]
            found.append(schedule)
    return np.array(found)


def _of_instruments(shown: Table, late: int, size: float) -> Cube:
    """What each reading of ``shown``, shape (seconds, variables), changes by where it comes ``late`` [s]."""
    change = np.zeros((shown.shape[1], *shown.shape))
    for j in range(shown.shape[1]):
        change[j, late:, j] = (shown[:-late, j] - shown[late:, j]) * size
    return change
