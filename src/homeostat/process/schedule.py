"""From commands to the inputs of every second: ramps, as the basic control system executes them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from homeostat.domain.recovery import Command
from homeostat.process.types import Row, Table


class InputRamp:
    """Inputs that move towards their targets at limited rates, one row per second."""

    def __init__(self, inputs: tuple[str, ...], current: Row) -> None:
        """Start at ``current`` (shape (inputs,)) with nothing to do."""
        self._inputs = inputs
        self.current = current.copy()
        self._target = current.copy()
        self._rate = np.full(len(inputs), np.inf)

    def command(self, commands: tuple[Command, ...], variables: Mapping[str, str], start: Mapping[str, float]) -> None:
        """Take commands; a manual output on automatic starts from ``start`` (input name -> present output)."""
        for c in commands:
            i = self._inputs.index(variables[c.tag])
            if c.value is None:
                self.current[i] = self._target[i] = math.nan
                continue
            if math.isnan(self.current[i]):
                self.current[i] = start.get(self._inputs[i], c.value)
            self._target[i] = c.value
            self._rate[i] = math.inf if c.rate is None else c.rate

    def advance(self) -> Row:
        """The inputs of the next second, shape (inputs,)."""
        step = self._target - self.current
        self.current = self.current + np.clip(step, -self._rate, self._rate)
        return self.current

    def schedule(self, steps: int) -> Table:
        """The inputs of the next ``steps`` seconds without advancing, shape (steps, inputs)."""
        seconds = np.arange(1, steps + 1)[:, None]
        step = self._target - self.current
        with np.errstate(invalid="ignore"):
            reach = np.where(np.isinf(self._rate), np.inf, self._rate * seconds)
        return np.asarray(self.current + np.clip(step, -reach, reach))
