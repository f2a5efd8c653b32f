"""Moves: what members of a batch do beside their equations, tick by tick.

A move acts from its onset on: a parameter differs, a state gains or loses per second, a reading is off, or stuck, an
input is not what was commanded. The engine carries it out between two ticks of the kernel, so that no process model
has to know of it, and controllers see readings as they were moved. Check: a state that gains 0.5 per second and has no
equation stands 5 higher after 10 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from homeostat.process.moving import FROZEN, INPUT, PARAMETER, READING, SAME_S, STATE, H, W, move_parameters
from homeostat.process.types import Cube, IndexTable, Indices, Table, Vec


class MoveKind(IntEnum):
    """What is moved."""

    PARAMETER = PARAMETER
    STATE = STATE
    """A state that the kernel goes on from."""
    READING = READING
    """A state that the kernel writes anew each tick."""
    FROZEN = FROZEN
    """The same; it stays what it was at the onset."""
    INPUT = INPUT
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
    grown_s: float = np.inf
    """Seconds after which what grows stays as it is [s]."""
    period_s: float = 0.0
    """Period of what swings about nothing, with ``size`` as its amplitude [s]; 0 for everything else."""
    done: float = 0.0
    """By how much the parameters that it goes on from were moved by it already, in the column's unit."""

    def change(self, since_s: ArrayLike) -> Vec:
        """By how much the column is moved so long after the onset, nothing before it, shape of ``since_s`` [s]."""
        since = np.asarray(since_s, dtype=np.float64)
        if self.period_s > 0.0:
            return np.where(since < -SAME_S, 0.0, self.size * _turn(np.maximum(since, 0.0), self.period_s))
        grown = np.clip(since, 0.0, self.grown_s) if self.grows else 1.0  # an onset may be never
        return np.where(since < -SAME_S, 0.0, self.size * grown)


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
    """The moves of every member of a batch, as the engine reads them."""

    begin: Indices
    """Rows of member m: ``begin[m]`` to ``begin[m + 1]`` - 1, shape (members + 1,)."""
    what: IndexTable
    """Kind and column of each row, shape (rows, :class:`~homeostat.process.moving.W`)."""
    how: Table
    """Onset, size and so on of each row, shape (rows, :class:`~homeostat.process.moving.H`); written as time goes."""

    @classmethod
    def of(cls, moves: Sequence[Sequence[Move]]) -> Moves:
        """``moves``: those of each member."""
        rows = [move for own in moves for move in own]
        begin = np.cumsum([0, *map(len, moves)], dtype=np.int64)
        what = np.array([(m.kind, m.column) for m in rows], dtype=np.int64).reshape(-1, len(W))
        how = np.array([_row(m) for m in rows], dtype=np.float64).reshape(-1, len(H))
        return cls(begin, what, how)

    @classmethod
    def none(cls, members: int) -> Moves:
        """Nothing is moved."""
        none = np.zeros((0, len(W)), dtype=np.int64)
        return cls(np.zeros(members + 1, dtype=np.int64), none, np.zeros((0, len(H))))

    def __bool__(self) -> bool:
        return bool(len(self.what))

    def misfit(self, states: int, parameters: int, inputs: int) -> str:
        """What does not fit a batch with so many columns, as one sentence; empty where all does."""
        begin, rows = self.begin, len(self.what)
        if begin[0] != 0 or begin[-1] != rows or (np.diff(begin) < 0).any() or len(self.how) != rows:
            return f"rows of moves {begin.tolist()} must rise from 0 to {rows}"
        columns = {PARAMETER: parameters, INPUT: inputs}
        for kind, column in self.what.tolist():
            if kind not in set(MoveKind):
                return f"there is no move of kind {kind}"
            most = columns.get(kind, states)
            if not 0 <= column < most:
                return f"a move of kind {MoveKind(kind).name} has column {column}; must be within 0 and {most - 1}"
        return ""

    def members(self, rows: Indices) -> Moves:
        """Those of these members alone."""
        spans = [np.arange(self.begin[m], self.begin[m + 1]) for m in rows]
        kept = np.concatenate([np.arange(0), *spans])
        begin = np.cumsum([0, *map(len, spans)], dtype=np.int64)
        return Moves(begin, self.what[kept], self.how[kept])

    def beginning_in(self, state: Table, at_s: float) -> Moves:
        """The same for one run from ``state``, shape (members, states), at ``at_s`` [s]: what is stuck shows that."""
        how, member = self.how.copy(), np.repeat(np.arange(len(state)), np.diff(self.begin))
        stuck = (self.what[:, W.kind] == FROZEN) & (how[:, H.onset_s] <= at_s + SAME_S)
        how[stuck, H.frozen] = state[member[stuck], self.what[stuck, W.column]]
        return replace(self, how=how)

    def arriving(self, inputs: Table, at_s: float) -> Table:
        """What arrives of ``inputs``, shape (members, inputs), in the tick from ``at_s`` on [s]."""
        due = self.what[:, W.kind] == INPUT
        if not due.any():
            return inputs
        member = np.repeat(np.arange(len(self.begin) - 1), np.diff(self.begin))[due]
        column, how, arrived = self.what[due, W.column], self.how[due], inputs.copy()
        since = at_s - how[:, H.onset_s]
        grown = np.clip(since, 0.0, how[:, H.grown_s])
        turn = _turn(np.maximum(since, 0.0), np.maximum(how[:, H.period_s], SAME_S))
        lasting = np.where(how[:, H.grows] > 0.0, grown, 1.0)
        change = how[:, H.size] * np.where(how[:, H.period_s] > 0.0, turn, lasting)
        moved = np.clip(inputs[member, column] + change, how[:, H.least], how[:, H.most])
        arrived[member, column] = np.where((since < -SAME_S) | (change == 0.0), inputs[member, column], moved)
        return arrived


def _row(move: Move) -> tuple[float, ...]:
    ends = move.least, move.most, move.done, np.nan, move.grown_s, move.period_s
    return move.onset_s, move.size, float(move.grows), *ends


def _turn(since_s: Vec, period_s: float | Vec) -> Vec:
    """Where a sine of this period is so long after it began [1]."""
    return np.asarray(np.sin(2.0 * np.pi * (since_s % period_s) / period_s))


def move_all_parameters(
    parameters: Table, moves: Sequence[Sequence[Move]], at_s: float
) -> tuple[tuple[Move, ...], ...]:
    """Move ``parameters``, shape (members, parameters), to what they are in the tick from ``at_s`` on [s].

    The ``moves`` of each member, as they go on from there: what meets its least was not moved by all that it would be.
    """
    made = Moves.of(moves)
    for m, own in enumerate(parameters):
        move_parameters(own, made.what, made.how, int(made.begin[m]), int(made.begin[m + 1]), at_s)
    done = iter(made.how[:, H.done].tolist())
    return tuple(tuple(replace(move, done=next(done)) for move in own) for own in moves)


def moved_inputs(inputs: Table, moves: Sequence[Sequence[Move]], start_s: float, tick_s: float) -> tuple[Cube, Indices]:
    """Schedules of inputs, shape (schedules, ticks, inputs), and which each member follows, shape (members,).

    ``inputs``: what was commanded, shape (ticks, inputs), in the ticks of ``tick_s`` from ``start_s`` on [s];
    ``moves``: those of each member.
    """
    at_s, schedules, follows = start_s + tick_s * np.arange(len(inputs)), [inputs], np.zeros(len(moves), dtype=np.int64)
    for member, own in enumerate(moves):
        mine = [move for move in own if move.kind is MoveKind.INPUT]
        if mine:
            schedules.append(inputs.copy())
            follows[member] = len(schedules) - 1
        for move in mine:
            since = at_s - move.onset_s
            moved = np.clip(inputs[:, move.column] + move.change(since), move.least, move.most)
            schedules[-1][:, move.column] = np.where(since >= -SAME_S, moved, inputs[:, move.column])
    return np.stack(schedules), follows
