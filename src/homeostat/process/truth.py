"""What the true plant of a simulated run offers beyond its process model."""

from typing import Protocol

from homeostat.process.batch import Kernel
from homeostat.process.departures import Departures
from homeostat.process.types import Vec


class TrueModel(Protocol):
    """Equations of a plant as it truly is: its process model's columns first, its own after them."""

    departures: Departures
    """Its own parameters."""
    kernel: Kernel
    """Compiled code that advances the states."""

    def own_states(self, state: Vec) -> Vec:
        """Its own states at the start, where those of the model are ``state``."""
        ...
