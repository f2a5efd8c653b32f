"""Unseen beginning: how readings may differ because a state that no instrument shows began elsewhere.

It was followed to where it is taken to be by what was believed to move it, with a size that nobody knew exactly.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from homeostat.process.model import ProcessModel, column
from homeostat.process.types import Cube, Table
from homeostat.twin.carried import Carried
from homeostat.twin.history import Window
from homeostat.twin.replay import replay

SHARE: Final = 0.3
"""Error of a state that was followed, as a share of how far it is from where it usually is [1]."""


def unseen_beginning(
    model: ProcessModel,
    window: Window,
    parameters: Table,
    carried: Carried,
    variables: tuple[str, ...],
    initial: Mapping[str, float],
) -> Cube:
    """Changes of readings where each unseen state began a standard deviation off, (states, ticks, variables).

    ``parameters`` and ``carried`` are of one member; ``initial``: state -> error that the tables state of a beginning.
    None where nobody followed any. Raises ProcessError as the engine does.
    """
    usual = model.estimate(window.beginning) if window.unseen else np.zeros(0)
    at = {state: column(model.states, state) for state in window.unseen}
    sd = {
        state: np.hypot(initial.get(state, 0.0), SHARE * (to - usual[at[state]])) for state, to in window.unseen.items()
    }
    off = [(at[state], size) for state, size in sd.items() if size > 0.0]
    if not off:
        return np.zeros((0, window.length - 1, len(variables)))
    offset = np.zeros((1 + len(off), len(model.states)))
    for k, (i, size) in enumerate(off):
        offset[1 + k, i] = size
    many = carried.repeated(len(offset))
    predicted = replay(model, window, parameters.repeat(len(offset), axis=0), many, variables, offset).predicted
    return np.asarray(predicted[1:] - predicted[0])
