"""What faults without an equation do to a true plant: those of the tables that are generated fault modes."""

import math
from collections.abc import Sequence
from typing import final

import numpy as np

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.description import PlantDescription
from homeostat.process.effects import Effects
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Moves
from homeostat.process.moving import H
from homeostat.process.types import Table


@final
class Moved:
    """Faults that act on members of one true plant, beside its equations."""

    def __init__(
        self, model: ProcessModel, plant: PlantDescription, faults: Sequence[FaultState], members: int = 1
    ) -> None:
        """Those of ``faults`` that have no equation; ValueError where a size is not finite, or an onset no time."""
        modes = {mode.name: mode.effect for mode in plant.faults}
        self._model, self._effects = model, Effects(model, plant)
        self._faults = [(effect, state) for state in faults if (effect := modes.get(state.fault)) is not None]
        for _, state in self._faults:
            if not math.isfinite(state.severity) or math.isnan(state.onset_s):
                raise ValueError(f"{state!r}: severity must be finite, the onset a time [s]")
        own = [
            self._effects.move(effect, state.severity * effect.per_unit, state.onset_s)
            for effect, state in self._faults
        ]
        self.moves = Moves.of([own] * members)
        """What is moved, of every member; written as time goes."""
        self._held = [k for k, (effect, _) in enumerate(self._faults) if effect.capacity is not None]

    def __bool__(self) -> bool:
        return bool(self._faults)

    @property
    def names(self) -> frozenset[str]:
        """The faults that have no equation."""
        return frozenset(state.fault for _, state in self._faults)

    def hold(
        self, moves: Moves, states: Table, parameters: Table, severity: Table, onset_s: Table, at_s: float
    ) -> None:
        """Let balances of ``moves`` change by what the members hold at ``at_s`` [s], in place; rows are members.

        A kilowatt warms a full vessel less than an empty one.
        """
        if not self._held:
            return
        known = states[:, : len(self._model.states)], parameters[:, : len(self._model.parameters)]
        _, true = self._model.shown_and_true(*known, severity, onset_s, at_s)
        for member in range(len(states)):
            values = {variable: float(found[member]) for variable, found in true.items()}
            for k in self._held:
                effect, state = self._faults[k]
                row = member * len(self._faults) + k
                moves.how[row, H.size] = state.severity * self._effects.per_unit(effect, values)


def forget_moved(moves: Moves) -> None:
    """Parameters were set anew, without what ``moves`` did to them so far."""
    moves.how[:, H.done] = 0.0


def end(moves: Moves) -> None:
    """Nothing is moved any more: every fault is repaired."""
    moves.how[:, H.onset_s] = np.inf
