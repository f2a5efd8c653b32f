"""The Mixing Module as it truly is, as a :class:`~homeostat.process.truth.TrueModel`."""

import numpy as np

from homeostat.plants.mixing_module.true.kernel import DEPARTURES, SHOWN, advance
from homeostat.process.batch import Kernel
from homeostat.process.departures import Departures
from homeostat.process.types import Vec


class TrueMixingModule:
    """What the module has that no model of it knows; equations in ``kernel``."""

    departures: Departures = DEPARTURES
    kernel: Kernel = advance

    def own_states(self, state: Vec) -> Vec:
        """Nothing lags yet, and instruments show what they show."""
        return np.array(DEPARTURES.begin(state[list(SHOWN)].tolist()))


TRUE = TrueMixingModule()
