"""The reactor as it truly is, as a :class:`~homeostat.process.truth.TrueModel`."""

import numpy as np

from homeostat.plants.cstr.layout import S
from homeostat.plants.cstr.true.kernel import DEPARTURES, SHOWN, advance
from homeostat.process.batch import Kernel
from homeostat.process.departures import Departures
from homeostat.process.types import Vec


class TrueCstr:
    """What the reactor has that no model of it knows; equations in ``kernel``."""

    departures: Departures = DEPARTURES
    kernel: Kernel = advance

    def own_states(self, state: Vec) -> Vec:
        """Nothing lags yet, instruments show what they show, and the wall is as warm as the liquid."""
        return np.array([*DEPARTURES.begin(state[list(SHOWN)].tolist()), state[S.T]])


TRUE = TrueCstr()
