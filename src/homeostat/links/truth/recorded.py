"""The truth of a run, kept in blocks: what is appended is copied once and never moved again."""

import numpy as np

from homeostat.process.types import Table, Vec

BLOCK = 1024
"""Ticks per block."""


class TruthRecord:
    """States and inputs of every tick so far."""

    def __init__(self) -> None:
        """Nothing is recorded yet."""
        self._states: list[Table] = []
        self._inputs: list[Table] = []
        self.length = 0
        """Ticks that are recorded."""

    def append(self, state: Vec, inputs: Vec) -> None:
        """Record one tick: ``state`` of shape (states,), ``inputs`` of shape (inputs,); both are copied."""
        row = self.length % BLOCK
        if row == 0:
            self._states.append(np.empty((BLOCK, state.size)))
            self._inputs.append(np.empty((BLOCK, inputs.size)))
        self._states[-1][row] = state
        self._inputs[-1][row] = inputs
        self.length += 1

    def arrays(self) -> tuple[Table, Table]:
        """Copies of all states, shape (ticks, states), and inputs, shape (ticks, inputs); not before the first."""
        return np.concatenate(self._states)[: self.length], np.concatenate(self._inputs)[: self.length]
