"""What the plant said lately, as arrays."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice

import numpy as np

from homeostat.domain.snapshot import Snapshot
from homeostat.process.types import Row, Table


@dataclass(frozen=True, slots=True)
class Window:
    """Readings of consecutive seconds."""

    start_s: float
    """Process time of the first reading [s]."""
    readings: Mapping[str, Row]
    """Variable -> readings, shape (n,)."""
    inputs: Table
    """Inputs of the process model, shape (n, inputs)."""
    settle_rows: int = 20
    """First readings that are averaged to find the state at the start."""

    @property
    def length(self) -> int:
        """Number of readings."""
        return int(self.inputs.shape[0])

    @property
    def end_s(self) -> float:
        """Process time of the last reading [s]."""
        return self.start_s + self.length - 1

    def mean(self, first: int, last: int) -> dict[str, float]:
        """Mean reading of each variable over rows ``first`` to ``last`` - 1; manual outputs keep their last value."""
        return {v: float(np.mean(r[first:last])) for v, r in self.readings.items()}

    def at(self, row: int) -> dict[str, float]:
        """Readings of one row."""
        return {v: float(r[row]) for v, r in self.readings.items()}


class History:
    """The last ``capacity`` snapshots, one per second."""

    def __init__(
        self, variables: Mapping[str, str], inputs: tuple[str, ...], settle_rows: int = 20, capacity: int = 3600
    ) -> None:
        """``variables``: tag -> variable; ``inputs``: names of the process model's input columns."""
        self._settle_rows = settle_rows
        self._variables = dict(variables)
        self._inputs = inputs
        self._tag_of = {v: t for t, v in variables.items()}
        self._rows: deque[Snapshot] = deque(maxlen=capacity)
        self._windows: dict[int, Window] = {}

    def append(self, snapshot: Snapshot) -> None:
        """Take one more snapshot; one that is already known is ignored."""
        if not self._rows or snapshot.at_s > self._rows[-1].at_s:
            self._rows.append(snapshot)
            self._windows.clear()

    @property
    def length(self) -> int:
        """Number of snapshots held."""
        return len(self._rows)

    @property
    def whole(self) -> Window:
        """Everything that is held."""
        return self.window(len(self._rows))

    def window(self, seconds: int) -> Window:
        """The last ``seconds`` readings, shorter where history is; worked out once per snapshot."""
        found = self._windows.get(seconds)
        if found is None or found.end_s != self._rows[-1].at_s:
            found = self._windows[seconds] = self._read(seconds)
        return found

    def _read(self, seconds: int) -> Window:
        rows = list(islice(reversed(self._rows), seconds))[::-1]
        if not rows:
            raise ValueError("the twin has no snapshot yet; observe the plant before asking")
        readings = {v: np.array([r.values[t] for r in rows]) for t, v in self._variables.items()}
        inputs = np.full((len(rows), len(self._inputs)), np.nan)
        for k, name in enumerate(self._inputs):
            if name in self._tag_of:
                inputs[:, k] = readings[name]
        return Window(rows[0].at_s, readings, inputs, self._settle_rows)
