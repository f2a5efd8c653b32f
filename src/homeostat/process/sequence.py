"""Sequences: members that carry out commands step by step, each at its own pace, as its instruments tell.

A schedule is known in advance; a sequence is not: when a step ends depends on what the member's instruments show. So
the engine advances all members by one tick, looks at their readings, and lets those go on whose guard holds: exactly
what the sequencer does with the plant, once per tick.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from homeostat.process.batch import Batch, BatchRun, tick_of
from homeostat.process.model import ProcessModel
from homeostat.process.moves import Moves
from homeostat.process.types import Cube, Indices, Table, Vec

Guard = Callable[[Mapping[str, Vec]], NDArray[np.bool_]]
"""Whether a guard holds for each member; readings by variable, shape (members,)."""


@dataclass(frozen=True, slots=True, eq=False)
class InputSequence:
    """What is commanded in each step, and what must be read before the next one begins."""

    targets: Table
    """Values that the inputs are brought to, shape (steps, inputs); NaN where a step leaves them, infinite where a
    manual output goes back to automatic."""
    rates: Table
    """Fastest change of each input in its unit per second, shape (steps, inputs)."""
    guards: tuple[Guard, ...]
    """Guards of the second and later steps."""
    outputs: Mapping[int, str] = field(default_factory=dict)
    """Column of a manual output -> variable that shows the output on automatic, from which a manual one starts."""


@dataclass(frozen=True, slots=True, eq=False)
class SequenceResult:
    """What came of it."""

    record: Cube
    """Every state, shape (members, ticks, states); the first row is a tick after the start."""
    inputs: Cube
    """Inputs of the same ticks, shape (members, ticks, inputs)."""
    step: NDArray[np.int64]
    """Step that each member was in during each tick, shape (members, ticks)."""
    reached: NDArray[np.int64]
    """Step that each member has reached at the end, shape (members,)."""

    def taken(self, number: int) -> Vec:
        """Ticks from the start after which each member took step ``number``; infinite where it did not."""
        before = (self.step < number).sum(axis=1, dtype=np.float64)
        return np.where(self.reached >= number, before, np.inf)


def run_sequences(
    model: ProcessModel, batch: Batch, sequences: Sequence[InputSequence], present: Vec, refuse: bool = True
) -> SequenceResult:
    """Advance ``batch`` by its ticks; its members follow ``sequences``, chosen by ``input_of``.

    They begin with inputs ``present``; ``batch.inputs`` is not looked at.

    Raises ProcessError as :func:`~homeostat.process.batch.simulate` does, whatever breaks without ``refuse`` is NaN.
    """
    members, ticks = len(batch.state), batch.steps
    followed = np.empty((members, ticks), dtype=np.int64)
    walk = Walk(model, sequences, batch.input_of, present, batch.state)
    inputs, every = np.zeros((members, ticks, len(model.inputs))), tuple(range(len(model.states)))
    commanded = np.zeros_like(inputs)
    moves = batch.moves or Moves.none(members)
    own = replace(batch, stride=1, input_of=np.arange(members), inputs=inputs, record=every)
    run = BatchRun(model.kernel, own, model.states.__getitem__, refuse)
    tick_s = tick_of(model.kernel)
    for k in range(ticks):
        followed[:, k] = walk.step
        commanded[:, k] = walk.advance()
        run.inputs[:, k] = moves.arriving(commanded[:, k], batch.start_s + k * tick_s)
        run.advance(k + 1)
        walk.look(run.state)
    return SequenceResult(run.record, commanded, followed, walk.step)


class Walk:
    """Where each member stands in its sequence, and its inputs."""

    def __init__(
        self, model: ProcessModel, sequences: Sequence[InputSequence], sequence_of: Indices, present: Vec, state: Table
    ) -> None:
        """Every member begins with inputs ``present`` in step 0 of its sequence, ``sequence_of`` (shape (members,)).

        ``state``: that of each member, shape (members, states).
        """
        self._model, self._sequences, self._tick_s = model, sequences, tick_of(model.kernel)
        self._mine = [sequence_of == s for s in range(len(sequences))]
        self.step = np.zeros(len(sequence_of), dtype=np.int64)
        """Step that each member is in, shape (members,)."""
        self._now = np.tile(present, (len(sequence_of), 1))
        self._target = self._now.copy()
        self._rate = np.full_like(self._now, np.inf)
        self._enter(np.ones(len(sequence_of), dtype=bool), state)

    def advance(self) -> Table:
        """Inputs of the next tick, shape (members, inputs)."""
        most = self._rate * self._tick_s
        self._now = self._now + np.clip(self._target - self._now, -most, most)
        return self._now

    def look(self, state: Table) -> None:
        """Let those go on whose next guard holds on what their instruments show."""
        shown: dict[str, Vec] | None = None
        fired = np.zeros(len(self.step), dtype=bool)
        for sequence, mine in zip(self._sequences, self._mine, strict=True):
            for j in set(self.step[mine].tolist()):
                if j < len(sequence.guards):
                    if shown is None:
                        shown = {name: state[:, i] for name, i in self._model.shown.items()}
                        shown.update(zip(self._model.inputs, self._now.T, strict=True))
                    fired |= mine & (self.step == j) & sequence.guards[j](shown)
        if fired.any():
            self.step[fired] += 1
            self._enter(fired, state)

    def _enter(self, fired: NDArray[np.bool_], state: Table) -> None:
        for sequence, own in zip(self._sequences, self._mine, strict=True):
            mine = np.flatnonzero(fired & own)
            wanted = sequence.targets[self.step[mine]]
            for column, variable in sequence.outputs.items():
                begins = mine[np.isfinite(wanted[:, column]) & np.isnan(self._now[mine, column])]
                self._now[begins, column] = state[begins, self._model.shown[variable]]
            automatic = np.isinf(wanted)
            self._now[mine] = np.where(automatic, np.nan, self._now[mine])
            self._target[mine] = np.where(np.isnan(wanted), self._target[mine], np.where(automatic, np.nan, wanted))
            self._rate[mine] = np.where(np.isnan(wanted), self._rate[mine], sequence.rates[self.step[mine]])
