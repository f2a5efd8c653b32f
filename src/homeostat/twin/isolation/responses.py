"""Responses: how the readings of a window change with a unit of each disturbance, from every onset on.

They are linear: a disturbance of size b changes the readings by b times its response. Members start in the states of
one replay at each onset, so that a response costs one short simulation per onset and disturbance. What a balance gains
steadily is the sum of kicks, and what grows the sum of steps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from homeostat.domain.diagnosis import Effect, EffectKind
from homeostat.process.batch import Batch, simulate
from homeostat.process.model import column
from homeostat.process.moves import Move, MoveKind, Moves
from homeostat.process.types import Cube, Indices, Table, Vec
from homeostat.twin.carried import Carried, FaultSet
from homeostat.twin.isolation.evidence import Evidence
from homeostat.twin.replay import open_loop, starting_states

FIRST_ROW = 3
"""Row of a window before which no onset is: the state at its beginning would absorb it."""
ONSETS = 64
"""Onsets that are tried over a whole window."""
NEWEST = 24
"""Ticks at the end of a window, each of which is tried as an onset."""
PUSH = 0.01
"""By how much an actuator is off its command, in the command's unit; a response is linear."""
KICK = 0.01
"""Kick of a state, as a share of what it is; a response is linear."""


class Responses:
    """Responses to disturbances of what a window shows beside a fault set."""

    def __init__(self, evidence: Evidence, beside: FaultSet) -> None:
        """Replays the window once with ``beside``."""
        self._evidence, self._model, window = evidence, evidence.model, evidence.window
        self._ticks = evidence.shape[0]
        self._carried = evidence.carrier.carry([beside], window)
        mean = evidence.posterior.mean[None]
        start = starting_states(self._model, window, mean, self._carried, evidence.variables)
        every = tuple(range(len(self._model.states)))
        batch = replace(self._batch(start, mean, self._carried, every), moves=Moves.of(self._carried.moves))
        self._path = simulate(self._model.kernel, batch).record[0]
        self._picks = tuple(self._model.shown[v] for v in evidence.variables)
        self.every = max(self._ticks // ONSETS, 1)
        """Ticks between two of the onsets that are tried over the whole window."""
        self.rows: Indices = np.arange(FIRST_ROW, max(self._ticks - 2, FIRST_ROW + 1), self.every)
        """Onsets that are tried over the whole window, as rows, shape (onsets,)."""
        last = self._ticks - 1
        self.newest: Indices = np.arange(max(last - NEWEST, FIRST_ROW), last)
        """Onsets that are tried besides, because few readings came after them."""
        self._unmoved: dict[bytes, Cube] = {}

    def steps(self, effect: Effect, rows: Indices | None = None) -> Table:
        """Response to a lasting unit of severity from each of ``rows`` on, in standard deviations, (rows, readings).

        A balance, which adds up kicks, has one for every row of the whole window only; ``rows`` interpolates it.
        """
        chosen = self.rows if rows is None else rows
        size = self._evidence.carrier.rate_per_unit(effect, self._evidence.window)
        match effect.kind:
            case EffectKind.PARAMETER:
                change = self._of_parameter(effect.quantity, chosen)
            case EffectKind.BALANCE:
                change = self._of_balance(effect.quantity, chosen)
            case EffectKind.POSITION:
                change = self._of_position(effect, chosen)
            case _:
                change = self._of_reading(effect.quantity, chosen)
        return self._evidence.whiten(change * size)

    def of_newest(self, effect: Effect, steps: Table) -> Table:
        """:meth:`steps` from each of :attr:`newest` on; ``steps``, from all :attr:`rows`, are not worked out again."""
        there = np.isin(self.newest, self.rows)
        found = np.empty((len(self.newest), steps.shape[1]))
        found[there] = steps[np.searchsorted(self.rows, self.newest[there])]
        if not there.all():
            found[~there] = self.steps(effect, self.newest[~there])
        return found

    @property
    def ramps(self) -> Table:
        """What grows by a unit per second from each of :attr:`rows` on, as a mixture of steps, (rows, rows)."""
        later = np.triu(np.ones((len(self.rows), len(self.rows))))
        return later * (self.every * self._evidence.window.tick_s)

    def once(self, k: int) -> Table:
        """The step from the ``k``-th of :attr:`rows` on alone, as a mixture of them, (1, rows)."""
        return np.eye(len(self.rows))[k : k + 1]

    def _of_parameter(self, symbol: str, rows: Indices) -> Cube:
        parameters = self._parameters(rows)
        i = column(self._model.parameters, symbol)
        delta = max(0.01 * abs(float(self._evidence.posterior.mean[i])), 1e-4)
        moved = parameters.copy()
        moved[:, i] += delta
        states = self._path[rows - 1]
        return (self._members(states, moved, rows) - self._reference(rows)) / delta

    def _of_balance(self, state: str, rows: Indices) -> Cube:
        """Sum of kicks at all later onsets; between two of them it is interpolated."""
        every, i = self.rows, column(self._model.states, state)
        states = self._path[every - 1].copy()
        kick = KICK * max(float(np.abs(states[:, i]).max()), 1e-6)
        states[:, i] += kick
        kicks = (self._members(states, self._parameters(every), every) - self._reference(every)) / kick
        steps = np.cumsum(kicks[::-1], axis=0)[::-1] * (self.every * self._evidence.window.tick_s)
        if rows is every:
            return np.asarray(steps)
        at = np.clip((rows - every[0]) / self.every, 0.0, len(every) - 1.0)
        before = np.minimum(at.astype(np.int64), max(len(every) - 2, 0))
        share = (at - before)[:, None, None]
        return np.asarray((1.0 - share) * steps[before] + share * steps[np.minimum(before + 1, len(every) - 1)])

    def _of_position(self, effect: Effect, rows: Indices) -> Cube:
        """What follows if an actuator stands a little off its command: on the side on which there is room."""
        found = np.zeros((len(rows), *self._evidence.shape))
        window, carrier = self._evidence.window, self._evidence.carrier
        for size in (PUSH, -PUSH):
            push = [carrier.move(effect, size, window.at_s(row), window) for row in rows.tolist()]
            change = self._members(self._path[rows - 1], self._parameters(rows), rows, push) - self._reference(rows)
            found = np.where(np.abs(change) > np.abs(found), change / size, found)
        return found

    def _of_reading(self, variable: str, rows: Indices) -> Cube:
        change = np.zeros((len(rows), *self._evidence.shape))
        if variable in self._evidence.variables:
            j = self._evidence.variables.index(variable)
            for k, row in enumerate(rows.tolist()):
                change[k, row:, j] = 1.0
        return change

    def _parameters(self, rows: Indices) -> Table:
        """Parameters that hold from each of ``rows`` on, moved by what is beside, shape (rows, parameters)."""
        found = np.tile(self._evidence.posterior.mean, (len(rows), 1))
        for move in self._carried.moves[0]:
            if move.kind is MoveKind.PARAMETER:
                found[:, move.column] = np.maximum(found[:, move.column] + self._moved(move, rows), move.least)
        return found

    def _moved(self, move: Move, rows: Indices) -> Vec:
        window = self._evidence.window
        return move.change(window.start_s + window.tick_s * rows - move.onset_s)

    def _reference(self, rows: Indices) -> Cube:
        """The same members, not disturbed."""
        key = rows.tobytes()
        if key not in self._unmoved:
            self._unmoved[key] = self._members(self._path[rows - 1], self._parameters(rows), rows)
        return self._unmoved[key]

    def _members(self, states: Table, parameters: Table, rows: Indices, push: Sequence[Move] = ()) -> Cube:
        """Readings of members that begin in ``states`` at ``rows``, zero before, shape (rows, ticks, variables).

        ``push``: one move of an input for each member.
        """
        carried = self._carried.repeated(len(rows))
        if push:
            pairs = zip(carried.moves, push, strict=True)
            carried = replace(carried, moves=tuple((*own, move) for own, move in pairs))
        batch = self._batch(states, parameters, carried, self._picks, rows)
        record = simulate(self._model.kernel, batch, self._model.states.__getitem__).record
        for k, row in enumerate(rows.tolist()):
            record[k, :row] = 0.0
        return record

    def _batch(
        self, states: Table, parameters: Table, carried: Carried, record: Sequence[int], begin: Indices | None = None
    ) -> Batch:
        members = open_loop(self._model, self._evidence.window, states, parameters, carried)
        return replace(members, record=tuple(record), begin=begin)
