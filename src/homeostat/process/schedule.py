"""From commands to the inputs of every tick: ramps, as the basic control system executes them."""

import math
from collections.abc import Mapping

import numpy as np

from homeostat.domain.recovery import Command
from homeostat.process.types import Table, Vec


class InputRamp:
    """Inputs that move towards their targets at limited rates, one row per tick.

    The inputs t seconds after a command are start + min(t rate, distance), computed from t each time: no rounding
    adds up, targets are met exactly, and a schedule made in advance has the bits of the inputs that follow.
    """

    def __init__(self, inputs: tuple[str, ...], current: Vec, tick_s: float = 1.0) -> None:
        """Start at ``current`` (shape (inputs,)) with nothing to do; ``tick_s``: time between two rows [s]."""
        self._inputs, self._tick_s = inputs, tick_s
        self._start = current.copy()
        self._target = current.copy()
        self._rate = np.full(len(inputs), np.inf)
        self._ticks = 0
        self._arrived = True
        self.current = current.copy()
        """The inputs of the last tick, shape (inputs,); NaN where a manual output is on automatic."""

    def command(self, commands: tuple[Command, ...], variables: Mapping[str, str], start: Mapping[str, float]) -> None:
        """Take all commands or, where one cannot be taken, none.

        Args:
            variables: tag -> variable.
            start: input name -> present output, for every input that has an automatic mode; a manual output
                starts from there.

        Raises:
            ValueError: a tag is no input, or is to be automatic and has no automatic mode.
        """
        columns = [self._column(c, variables, start) for c in commands]
        self._start = self.current.copy()
        self._ticks, self._arrived = 0, False
        for c, i in zip(commands, columns, strict=True):
            if c.value is None:
                self._start[i] = self._target[i] = math.nan
                continue
            if math.isnan(self._start[i]):
                self._start[i] = start.get(self._inputs[i], c.value)
            self._target[i] = c.value
            self._rate[i] = math.inf if c.rate is None else c.rate
        self.current = self._start.copy()

    @property
    def targets(self) -> Vec:
        """Where the inputs are going, shape (inputs,); NaN where a manual output is on automatic."""
        return self._target.copy()

    def advance(self) -> Vec:
        """The inputs of the next tick, shape (inputs,); the caller may keep the array, and must not change it."""
        if not self._arrived:
            self._ticks += 1
            self.current = self._after(np.array([self._ticks]))[0]
            self._arrived = np.array_equal(self.current, self._target, equal_nan=True)
        return self.current

    def schedule(self, steps: int) -> Table:
        """The inputs of the next ``steps`` ticks without advancing, shape (steps, inputs)."""
        return self._after(self._ticks + np.arange(1, steps + 1))

    def _after(self, ticks: np.ndarray) -> Table:
        """The inputs ``ticks`` after the last command, shape (ticks, inputs)."""
        reach = self._rate * (self._tick_s * ticks[:, None])
        distance = self._target - self._start
        return np.where(np.abs(distance) <= reach, self._target, self._start + np.copysign(reach, distance))

    def _column(self, command: Command, variables: Mapping[str, str], start: Mapping[str, float]) -> int:
        """Position of the commanded input."""
        name = variables.get(command.tag)
        if name not in self._inputs:
            can = ", ".join(repr(t) for t, v in variables.items() if v in self._inputs)
            raise ValueError(f"{command.tag!r} cannot be commanded; these can: {can}")
        if command.value is None and name not in start:
            raise ValueError(f"{command.tag!r} has no automatic mode; command a value")
        return self._inputs.index(name)
