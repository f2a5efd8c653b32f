"""Effects: how what a process model has no equation of becomes a move beside its equations, for twin and true plant."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from homeostat.domain.diagnosis import Effect, EffectKind
from homeostat.domain.plant.description import PlantDescription
from homeostat.process.model import ProcessModel, column
from homeostat.process.moves import Move, MoveKind

LEAST_CAPACITY: Final = 1e-9
"""What a balance holds at least per unit of its state: an empty vessel is no singularity."""
NEVER_S: Final = 1e12
"""How much longer an actuator takes to move that is stuck [s]: in years of a slow plant it has not moved."""
LEAST_SHARE: Final = 0.01
"""Share of its value that is left of a positive parameter at least [1]."""


class Effects:
    """Turns effects on one process into moves."""

    def __init__(self, model: ProcessModel, plant: PlantDescription) -> None:
        """``plant`` says between what commands and parameters can be."""
        self._model, self._variables = model, plant.variables
        self._commands = {s.variable: s.tag.range for s in plant.signals}
        self._least = {p.symbol: LEAST_SHARE * p.value for p in plant.parameters if p.value > 0.0}

    def per_unit(self, effect: Effect, values: Mapping[str, float]) -> float:
        """Change of the effect's quantity for each unit of severity, per second for a balance; 0 where nobody knows.

        ``values``: variable -> its value, for what a balance holds.
        """
        if effect.capacity is None:
            return effect.per_unit
        held = effect.capacity.value({tag: values[v] for tag, v in self._variables.items() if v in values})
        return 0.0 if math.isnan(held) else effect.per_unit / max(held, LEAST_CAPACITY)

    def move(self, effect: Effect, size: float, onset_s: float) -> Move:
        """A change of the effect's quantity by ``size``, in its unit, from ``onset_s`` on [s]; what grows has no end.

        ``size`` is per second of what grows, and of a balance.
        """
        match effect.kind:
            case EffectKind.PARAMETER:
                least = self._least.get(effect.quantity, -np.inf)
                i = column(self._model.parameters, effect.quantity)
                return Move(MoveKind.PARAMETER, i, onset_s, size, effect.grows, least)
            case EffectKind.STUCK:
                return Move(MoveKind.PARAMETER, column(self._model.parameters, effect.quantity), onset_s, NEVER_S)
            case EffectKind.POSITION:
                i, span = column(self._model.inputs, effect.quantity), self._commands[effect.quantity]
                return Move(MoveKind.INPUT, i, onset_s, size, effect.grows, span.low, span.high)
            case EffectKind.BALANCE:
                i = column(self._model.states, effect.quantity)
                nothing = 0.0  # is the least that anything holds
                return Move(MoveKind.STATE, i, onset_s, size, effect.grows, nothing)
            case EffectKind.READING:
                return Move(MoveKind.READING, self._model.shown[effect.quantity], onset_s, size, effect.grows)
            case _:
                return Move(MoveKind.FROZEN, self._model.shown[effect.quantity], onset_s, 0.0)
