"""Wandering: what readings vary by because something that nobody measures wanders, as the model itself has it.

A model may be disturbed at random: a demand, a feed's strength, a draught (`Flowsheet.disturbance`). Its replay follows
the mean, the plant its own path, and over minutes the two part as no noise of an instrument does. Paths that are drawn
from the model, less the mean, are directions along which readings may differ: n of them, each by 1/sqrt(n) of itself,
have the covariance of the wandering in the mean. What the inputs that are read tell is in the replay already.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from homeostat.process.batch import simulate
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Moves
from homeostat.process.seeds import Stream, generator
from homeostat.process.types import Cube, Table
from homeostat.twin.carried import Carried
from homeostat.twin.history import Window
from homeostat.twin.replay import open_loop, starting_states

PATHS = 32
"""Paths that stand for all of them: minutes of wandering have few directions that matter."""


def paths(seed: int) -> tuple[int, ...]:
    """Noise seeds of the paths, of a twin with this ``seed``."""
    drawn = generator(seed, Stream.TWIN_WANDERING).integers(1, 2**62, size=PATHS, dtype=np.int64)
    return tuple(drawn.tolist())


def wandering(
    model: ProcessModel,
    window: Window,
    parameters: Table,
    carried: Carried,
    variables: tuple[str, ...],
    seeds: tuple[int, ...],
) -> Cube:
    """How readings may differ because the model wanders, shape (paths, ticks, variables), in their units.

    ``parameters`` and ``carried`` are of one member, ``seeds`` of the noise of each path. No paths where there are no
    seeds, or where nothing wanders that is not read. Raises ProcessError as the engine does.
    """
    nothing = np.zeros((0, window.length - 1, len(variables)))
    if not seeds:
        return nothing
    start = starting_states(model, window, parameters, carried, variables)
    shown = tuple(model.shown[v] for v in variables)

    def drawn(own: tuple[int, ...]) -> Cube:
        count = 1 + len(own)
        many = carried.repeated(count)
        batch = open_loop(model, window, start.repeat(count, axis=0), parameters.repeat(count, axis=0), many)
        noise = np.minimum(np.arange(count), 1.0)
        batch = replace(batch, record=shown, seeds=np.array([0, *own]), process_noise=noise, moves=Moves.of(many.moves))
        record = simulate(model.kernel, batch, model.states.__getitem__).record
        return np.asarray(record[1:] - record[0])

    if not np.any(drawn(seeds[:1])):
        return nothing
    return np.asarray(drawn(seeds) / np.sqrt(len(seeds)))
