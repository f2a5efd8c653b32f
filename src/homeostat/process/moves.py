"""Moves: what members of a batch do beside their equations, second by second.

A move acts from its onset on: a parameter differs, a state gains or loses per second, a reading is off, or stuck, an
input is not what was commanded. It is written between two steps of the kernel, so that no process model has to know of
it, and controllers see readings as they were moved. Check: a state that gains 0.5 per second and has no equation stands
5 higher after 10 s.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from homeostat.process.batch import Batch, BatchResult, BatchRun, Kernel
from homeostat.process.types import Cube, Indices, Table, Vec


class MoveKind(IntEnum):
    """What is moved."""

    PARAMETER = 0
    STATE = 1
    """A state that the kernel goes on from."""
    READING = 2
    """A state that the kernel writes anew each second."""
    FROZEN = 3
    """The same; it stays what it was at the onset."""
    INPUT = 4
    """An input of the kernel; what is on automatic, and has none, is left alone."""


@dataclass(frozen=True, slots=True)
class Move:
    """What happens to one member."""

    kind: MoveKind
    """What is moved."""
    column: int
    """Column of the parameters, the states or the inputs."""
    onset_s: float
    """Process time from which it acts [s]."""
    size: float
    """Change in the column's unit; of a state per second, of what grows per second more."""
    grows: bool = False
    """Whether the change is ``size`` times the seconds since the onset."""
    least: float = -np.inf
    """What a parameter, a state or an input does not fall below, in its unit."""
    most: float = np.inf
    """What an input does not exceed, in its unit."""


class Movers:
    """The moves of every member, and what they have done so far."""

    def __init__(self, moves: Sequence[Sequence[Move]], start_s: float) -> None:
        """``moves``: those of each member; what parameters were moved by until ``start_s`` [s] is in them already."""
        rows = [(member, move) for member, own in enumerate(moves) for move in own]
        self._member: Indices = np.array([member for member, _ in rows], dtype=np.int64)
        self._column: Indices = np.array([move.column for _, move in rows], dtype=np.int64)
        self._onset = np.array([move.onset_s for _, move in rows])
        self._size = np.array([move.size for _, move in rows])
        self._least = np.array([move.least for _, move in rows])
        self._most = np.array([move.most for _, move in rows])
        self._grows = np.array([move.grows for _, move in rows], dtype=bool)
        kinds = np.array([move.kind for _, move in rows], dtype=np.int64)
        self._of = {kind: np.flatnonzero(kinds == kind) for kind in MoveKind}
        self._once = (kinds == MoveKind.PARAMETER) & ~self._grows
        every = self._onset[~self._once & (kinds != MoveKind.INPUT)]
        self._every_from = float(every.min(initial=np.inf)) - 1.0
        self._done = self._change(np.arange(len(rows)), start_s)
        self._frozen = np.full(len(rows), np.nan)

    def __bool__(self) -> bool:
        """Whether anything is moved."""
        return bool(len(self._member))

    def begin(self, state: Table, at_s: float) -> None:
        """Keep in mind what stuck readings show in ``state``, shape (members, states), at ``at_s`` [s]."""
        stuck = self._stuck(at_s)
        self._frozen[stuck] = state[self._member[stuck], self._column[stuck]]

    def before(self, parameters: Table, at_s: float) -> None:
        """Move ``parameters``, shape (members, parameters), to what they are in the second from ``at_s`` on [s]."""
        due = self._of[MoveKind.PARAMETER]
        where, change = (self._member[due], self._column[due]), self._change(due, at_s)
        np.add.at(parameters, where, change - self._done[due])
        parameters[where] = np.maximum(parameters[where], self._least[due])
        self._done[due] = change

    def commanded(self, inputs: Table, at_s: float) -> Table:
        """What arrives of ``inputs``, shape (members, inputs), in the second from ``at_s`` on [s]."""
        due = self._of[MoveKind.INPUT]
        if not len(due):
            return inputs
        where, change = (self._member[due], self._column[due]), self._change(due, at_s)
        moved = np.clip(inputs[where] + change, self._least[due], self._most[due])
        arrived = inputs.copy()
        arrived[where] = np.where(change == 0.0, inputs[where], moved)
        return arrived

    def after(self, run: BatchRun, at_s: float, row: int | None, picks: Sequence[int]) -> None:
        """Move states and readings at ``at_s`` [s], the end of a second; ``row`` of the record, if any, shows them."""
        for kind in (MoveKind.STATE, MoveKind.READING):
            due = self._of[kind]
            where = self._member[due], self._column[due]
            np.add.at(run.state, where, self._change(due, at_s))
            run.state[where] = np.maximum(run.state[where], self._least[due])
        due, stuck = self._of[MoveKind.READING], self._stuck(at_s)
        where = self._member[stuck], self._column[stuck]
        self._frozen[stuck] = np.where(np.isnan(self._frozen[stuck]), run.state[where], self._frozen[stuck])
        run.state[where] = self._frozen[stuck]
        shown = np.concatenate([due, stuck])
        for j, column in enumerate(picks if len(shown) and row is not None else ()):
            members = self._member[shown[self._column[shown] == column]]
            run.record[members, row, j] = run.state[members, column]

    def quiet_until(self, at_s: float) -> float:
        """Whole seconds from ``at_s`` up to which nothing is to be moved, as a process time [s]; infinite for ever.

        A parameter that differs, and does not go on to differ more, is moved once; everything else every second.
        """
        once = self._onset[self._once]
        first = min(self._every_from, once[once > at_s].min(initial=np.inf))
        return at_s + math.ceil(max(first - at_s, 0.0)) if first < np.inf else np.inf

    def _stuck(self, at_s: float) -> Indices:
        stuck = self._of[MoveKind.FROZEN]
        return stuck[self._onset[stuck] <= at_s]

    def _change(self, moves: Indices, at_s: float) -> Vec:
        since = at_s - self._onset[moves]
        factor = np.where(self._grows[moves], np.maximum(since, 0.0), 1.0)
        return np.where(since >= 0.0, self._size[moves] * factor, 0.0)


def moved_inputs(inputs: Table, moves: Sequence[Sequence[Move]], start_s: float) -> tuple[Cube, Indices]:
    """Schedules of inputs, shape (schedules, seconds, inputs), and which each member follows, shape (members,).

    ``inputs``: what was commanded, shape (seconds, inputs), in the seconds from ``start_s`` on [s]; ``moves``: those of
    each member.
    """
    at_s, schedules, follows = start_s + np.arange(len(inputs)), [inputs], np.zeros(len(moves), dtype=np.int64)
    for member, own in enumerate(moves):
        mine = [move for move in own if move.kind is MoveKind.INPUT]
        if mine:
            schedules.append(inputs.copy())
            follows[member] = len(schedules) - 1
        for move in mine:
            since = at_s - move.onset_s
            change = np.where(since >= 0.0, move.size * (since if move.grows else 1.0), 0.0)
            moved = np.clip(inputs[:, move.column] + change, move.least, move.most)
            schedules[-1][:, move.column] = np.where(since >= 0.0, moved, inputs[:, move.column])
    return np.stack(schedules), follows


def simulate_moved(
    kernel: Kernel, batch: Batch, movers: Movers, describe: Callable[[int], str] = "state {}".format
) -> BatchResult:
    """As :func:`~homeostat.process.batch.simulate`, with what ``movers`` do to the members; raises as it does.

    ``batch`` may record every few seconds; a second in which something is moved is a step. Its members begin together.
    """
    run = BatchRun(kernel, replace(batch, parameters=batch.parameters.copy()), describe)
    movers.begin(run.state, batch.start_s)
    second = 0 if movers else batch.steps
    while second < batch.steps:
        movers.before(run.parameters, batch.start_s + second)
        quiet = movers.quiet_until(batch.start_s + second)
        if quiet > batch.start_s + second + 1.0:
            second = int(min(quiet - batch.start_s, batch.steps))
            run.advance(second)
            continue
        second += 1
        run.advance(second)
        row, left = divmod(second, batch.stride)
        movers.after(run, batch.start_s + second, None if left else row - 1, batch.record)
    run.advance(batch.steps)
    return BatchResult(record=run.record, state=run.state)
