"""What the plant said lately, as arrays."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import TypeAlias

import numpy as np

from homeostat.domain.snapshot import WILD, Snapshot
from homeostat.process.types import Flags, Table, Vec

COURSE = 5.0
"""Standard errors by which readings must rise or fall for that to be a course and no noise [1]."""
MOSTLY = 0.5
"""Share of its readings that differ from the one before, of an instrument that is fine enough for its noise."""
MOST_ALIKE = 0.9
"""Largest correlation of one reading's noise with the next one's: twenty readings cannot show more [1]."""
NEAR = 5
"""First readings that their course may not lead away from: what steps among them has no straight line."""
FEWEST = 5
"""Fewer readings have no course that stands out of their noise."""

_Begun: TypeAlias = tuple[Callable[[Mapping[str, float]], Vec], Mapping[str, float], Vec]
"""How a state is estimated, the readings that it was estimated of, and what it is."""


@dataclass(frozen=True, slots=True)
class Window:
    """Readings of consecutive ticks."""

    start_s: float
    """Process time of the first reading [s]."""
    readings: Mapping[str, Vec]
    """Variable -> readings, shape (n,)."""
    inputs: Table
    """Inputs of the process model, shape (n, inputs)."""
    settle_rows: int = 20
    """First readings that say what state it starts in."""
    held: Mapping[str, Flags] = field(default_factory=dict)
    """Variable -> where its reading was unknown and the last one stands for it, shape (n,)."""
    frozen_s: Mapping[str, float] = field(default_factory=dict)
    """Variable -> process time from which its instrument repeats itself, at the end of the window [s]."""
    tick_s: float = 1.0
    """Process time between two readings [s]."""
    still_s: Mapping[str, float] = field(default_factory=dict)
    """Variable -> when a reading of it changed last, before the window, of those that had changed most times [s]."""
    unseen: Mapping[str, float] = field(default_factory=dict)
    """State that no instrument shows -> where it was at the first reading; what is not named nobody followed."""
    per_sample: Mapping[str, int] = field(default_factory=dict)
    """Variable -> readings that show one sample of an analyser; one each of what is not named."""
    _begun: list[_Begun] = field(default_factory=list, init=False, repr=False, compare=False)
    """What :meth:`begun` worked out; a window that is made of this one begins without it."""

    @property
    def length(self) -> int:
        """Number of readings."""
        return int(self.inputs.shape[0])

    @property
    def end_s(self) -> float:
        """Process time of the last reading [s]."""
        return self.at_s(self.length - 1)

    def at_s(self, row: float) -> float:
        """Process time of a row [s]."""
        return self.start_s + row * self.tick_s

    def row(self, at_s: float) -> int:
        """The row nearest to a process time [s]; it need not be in the window."""
        return round((at_s - self.start_s) / self.tick_s)

    @property
    def beginning(self) -> dict[str, float]:
        """What each variable was at the first reading, by the first :attr:`settle_rows`.

        Their mean, or where they have a course the beginning of its straight line: the mean of a level that falls is
        none that it had then.
        """
        return {v: _first(r[: self.settle_rows]) for v, r in self.readings.items()}

    def begun(self, estimate: Callable[[Mapping[str, float]], Vec]) -> tuple[Mapping[str, float], Vec]:
        """:attr:`beginning`, and the state that ``estimate`` takes from it and :attr:`unseen`; neither may be changed.

        Both are worked out once: one look replays a window hundreds of times, and a large plant's state takes as long
        as a replay.
        """
        for known, first, state in self._begun:
            if known == estimate:
                return first, state
        first = self.beginning
        # Not averaged: the first reading of those that are not finite throughout.
        manual = {v: float(r[0]) for v, r in self.readings.items() if not np.all(np.isfinite(r))}
        state = estimate({**first, **manual, **self.unseen})
        self._begun.append((estimate, first, state))
        return first, state

    def at(self, row: int) -> dict[str, float]:
        """Readings of one row."""
        return {v: float(r[row]) for v, r in self.readings.items()}

    def part(self, first: int, last: int) -> Window:
        """Readings ``first`` to ``last`` - 1, without what is known of the state of single instruments."""
        readings = {v: r[first:last] for v, r in self.readings.items()}
        rest, tick_s, per_sample = self.inputs[first:last], self.tick_s, self.per_sample
        return Window(self.at_s(first), readings, rest, self.settle_rows, tick_s=tick_s, per_sample=per_sample)


def _nobody_followed(at_s: float) -> dict[str, float]:
    return {}


def _first(readings: Vec) -> float:
    """Where ``readings`` began, shape (n,): no further from their first ones than these are apart."""
    mean, count = float(np.mean(readings)), len(readings)
    if count < FEWEST or not np.all(np.isfinite(readings)):
        return mean
    row = np.arange(count) - (count - 1) / 2.0
    spread = float(row @ row)
    slope = float(row @ readings) / spread
    left = readings - mean - slope * row
    noise = float(left @ left)
    alike = min(max(float(left[1:] @ left[:-1]) / noise, 0.0), MOST_ALIKE) if noise > 0.0 else 0.0
    if abs(slope) <= COURSE * np.sqrt(noise * (1.0 + alike) / ((1.0 - alike) * (count - 2) * spread)):
        return mean
    near = readings[:NEAR]
    return float(np.clip(mean + slope * row[0], near.min(), near.max()))


@dataclass(frozen=True, slots=True)
class _Row:
    """Readings of one tick."""

    at_s: float
    values: Vec
    """In the order of the tags, shape (tags,)."""
    unknown: Flags | None
    """Which of them are the last that were known, shape (tags,); None for none."""


class History:
    """The last ``capacity`` readings; where one is unknown, the last one that was known stands for it."""

    def __init__(
        self,
        variables: Mapping[str, str],
        inputs: tuple[str, ...],
        settle_rows: int = 20,
        capacity: int = 3600,
        tick_s: float = 1.0,
        sampled: Mapping[str, int] | None = None,
    ) -> None:
        """``variables``: tag -> variable; ``inputs``: names of the process model's input columns.

        ``tick_s``: process time between two readings [s]; ``sampled``: tag -> readings for each sample of an analyser.
        """
        self._sampled = {variables[tag]: count for tag, count in (sampled or {}).items() if tag in variables}
        self._per_sample = np.array([self._sampled.get(v, 1) for v in variables.values()], dtype=np.float64)
        self._tick_s = tick_s
        self._settle_rows = settle_rows
        self._variables = dict(variables)
        self._may_be_nan = np.array([v in inputs for v in variables.values()])  # an input on automatic
        names = list(variables.values())
        self._input_columns = [names.index(name) if name in names else None for name in inputs]
        self._rows: deque[_Row] = deque(maxlen=capacity)
        self._windows: dict[int, Window] = {}
        self._frozen_s: dict[str, float] = {}
        self._unseen: Callable[[float], dict[str, float]] = _nobody_followed
        none = np.zeros(len(self._variables))
        self._changed_s, self._changes, self._compared, self._until_change = none, none, none, none
        self._lowest = self._highest = np.full(len(self._variables), np.nan)

    def append(self, snapshot: Snapshot) -> None:
        """Take one more snapshot; one that is no newer is ignored, and ticks without one are filled."""
        if not self._rows:
            self._add(snapshot)
            return
        last = self._rows[-1]
        if snapshot.at_s <= last.at_s:
            return
        every = np.ones(len(self._variables), dtype=bool)
        for k in range(1, min(round((snapshot.at_s - last.at_s) / self._tick_s), self._rows.maxlen or 1)):
            self._rows.append(_Row(last.at_s + k * self._tick_s, last.values, every))
        self._add(snapshot)

    def _add(self, snapshot: Snapshot) -> None:
        given, bad = snapshot.values, snapshot.bad
        self._frozen_s = {self._variables[t]: s for t, s in snapshot.frozen_s.items() if t in self._variables}
        values = np.array([given.get(t, math.nan) for t in self._variables])
        lacking = ~(np.isfinite(values) | self._may_be_nan) | (np.abs(values) >= WILD)
        if bad or not self._variables.keys() <= given.keys():
            lacking |= [t in bad or t not in given for t in self._variables]
        unknown = lacking if lacking.any() else None
        if unknown is not None:
            values[unknown] = self._rows[-1].values[unknown] if self._rows else math.nan
        self._compare(snapshot.at_s, values, lacking)
        self._rows.append(_Row(snapshot.at_s, values, unknown))
        self._windows.clear()

    def _compare(self, at_s: float, values: Vec, lacking: Flags) -> None:
        """Take note of which readings are others than before; the arrays are new ones, since copies share the old."""
        changed = ~lacking & (values != self._rows[-1].values) if self._rows else ~lacking
        self._compared, self._changes = self._compared + ~lacking, self._changes + changed
        self._changed_s = np.where(changed, at_s, self._changed_s)
        self._until_change = np.where(changed, self._compared, self._until_change)
        self._lowest, self._highest = np.fmin(self._lowest, values), np.fmax(self._highest, values)

    def copy(self) -> History:
        """The same readings; what either takes from now on the other does not have."""
        other = copy(self)
        other._rows, other._windows = self._rows.copy(), self._windows.copy()
        return other

    def tell(self, states: tuple[str, ...], at_s: Vec, values: Table) -> None:
        """Where ``states`` were that no instrument shows: at times ``at_s``, shape (n,) [s]; shape (n, states)."""

        def unseen(at: float) -> dict[str, float]:
            return {name: float(np.interp(at, at_s, values[:, k])) for k, name in enumerate(states)}

        self._unseen = unseen
        self._windows = {}

    @property
    def length(self) -> int:
        """Number of snapshots held."""
        return len(self._rows)

    @property
    def begin_s(self) -> float:
        """Process time of the first snapshot that is held [s]; minus infinity where there is none."""
        return self._rows[0].at_s if self._rows else -math.inf

    @property
    def reached(self) -> dict[str, tuple[float, float]]:
        """Variable -> the lowest and the highest that was ever read of it, before what is held as well; NaN: none."""
        ends = zip(self._lowest.tolist(), self._highest.tolist(), strict=True)
        return dict(zip(self._variables.values(), ends, strict=True))

    @property
    def whole(self) -> Window:
        """Everything that is held."""
        return self.window(len(self._rows))

    def around(self, at_s: float, before_s: float, after_s: float) -> Window | None:
        """Readings from ``before_s`` before a time to ``after_s`` after it, as far as they are held [s].

        None where too few are held from before it to say what state they begin in.
        """
        whole = self.whole
        first, last = max(whole.row(at_s - before_s), 0), min(whole.row(at_s + after_s), whole.length - 1)
        if whole.row(at_s) - first < self._settle_rows or first >= last:
            return None
        held = {v: flags[first : last + 1] for v, flags in whole.held.items()}
        return replace(whole.part(first, last + 1), held=held, unseen=self._unseen(whole.at_s(first)))

    def window(self, rows: int) -> Window:
        """The last ``rows`` readings, shorter where history is; worked out once per snapshot."""
        found = self._windows.get(rows)
        if found is None:
            found = self._windows[rows] = self._read(rows)
        return found

    def _read(self, last: int) -> Window:
        rows = list(islice(reversed(self._rows), last))[::-1]
        if not rows:
            raise ValueError("the twin has no snapshot yet; observe the plant before asking")
        table = np.array([r.values for r in rows]).T.copy()
        inputs = np.full((len(rows), len(self._input_columns)), np.nan)
        for k, i in enumerate(self._input_columns):
            if i is not None:
                inputs[:, k] = table[i]
        held = {}
        if any(r.unknown is not None for r in rows):
            none = np.zeros(len(self._variables), dtype=bool)
            flags = np.array([none if r.unknown is None else r.unknown for r in rows]).T
            held = {v: f for v, f in zip(self._variables.values(), flags, strict=True) if f.any()}
        readings = dict(zip(self._variables.values(), table, strict=True))
        frozen_s = {v: max(since_s, rows[0].at_s) for v, since_s in self._frozen_s.items()}
        lively = self._changes > MOSTLY * np.maximum(self._until_change / self._per_sample, 1.0)
        still = lively & (self._changed_s <= rows[0].at_s)
        still_s = {v: float(self._changed_s[k]) for k, v in enumerate(self._variables.values()) if still[k]}
        begin_s = rows[0].at_s
        unseen = self._unseen(begin_s)
        known = held, frozen_s, self._tick_s, still_s, unseen, self._sampled
        return Window(begin_s, readings, inputs, self._settle_rows, *known)
