"""How fast the states of a flowsheet move by themselves, and what comes of the steps in which they are integrated."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, final

import numpy as np

from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.stabilised import Stage, fastest, stages_of
from homeostat.process.blocks.term import TICK, Leaf, Term, evaluate, together
from homeostat.process.types import Table, Vec

_NUDGE: Final = 1e-5
RUNGE_KUTTA: Final = 2.785
"""Rate times step up to which Runge-Kutta 4 is stable, for motions that do not swing."""


@final
class Motion:
    """The rates of a flowsheet around some of its states.

    Actuators, lags and controllers are advanced exactly or once a tick, and stand still here.
    """

    def __init__(self, layout: Layout, states: Table, inputs: Table, parameters: Vec) -> None:
        """``states`` (n, states), what is commanded in each (n, inputs), and the plant's ``parameters``."""
        (self._leaves, self._changes), self._tick_s = together(list(layout.rates.values())), layout.tick_s
        self.names = tuple(layout.rates)
        """Names of the states that are integrated."""
        self._own = [Term(Leaf.STATE, value=name) for name in self.names]
        self._least = np.array(
            [-np.inf if (s := layout.sheet.states[n]).least is None else s.least for n in self.names]
        )
        leaf = layout.leaf
        self._values: dict[Term, Any] = {**layout.healthy, TICK: layout.tick_s}
        self._values |= dict(zip(leaf[Leaf.PARAMETER].values(), parameters.tolist(), strict=True))
        self._values |= dict(zip(leaf[Leaf.HELD].values(), states.T, strict=True))
        self._values |= dict(zip(leaf[Leaf.INPUT].values(), inputs.T, strict=True))
        self.states: Table = states[:, [layout.column[name] for name in self.names]]
        """Those of the given states that are integrated, shape (n, names)."""
        self._values |= dict(zip(self._own, self.states.T, strict=True))
        parts = np.floor(evaluate(layout.sheet.parts, self._values))
        self.parts = np.broadcast_to(parts, len(states)).astype(np.int64)
        """In how many steps a tick is integrated that begins in each of them."""
        self._fastest_s = layout.sheet.fastest_s
        self.stable: Vec = np.asarray(RUNGE_KUTTA * self.parts / self._tick_s, dtype=np.float64)
        if self._fastest_s is not None:
            self.stable = np.full(len(states), fastest(self._tick_s, self._fastest_s))
        """Rate up to which the steps of a tick are stable that begins in each of them [1/s]."""

    def fastest(self) -> tuple[Vec, list[str]]:
        """The largest eigenvalue of the Jacobian in each state [1/s], and the state that moves so, if one does."""
        y = self.states
        jacobian = np.zeros((*y.shape, y.shape[1]))
        for k in range(y.shape[1]):
            nudge = np.zeros_like(y)
            nudge[:, k] = _NUDGE * np.maximum(np.abs(y[:, k]), 1e-3)
            jacobian[:, :, k] = (self._slopes(y + nudge) - self._slopes(y - nudge)) / (2.0 * nudge[:, k : k + 1])
        jacobian[~np.isfinite(jacobian).all(axis=(1, 2))] = 0.0
        sizes = np.abs(np.linalg.eigvals(jacobian)).max(axis=1)
        return sizes, [self.names[i] for i in np.abs(np.diagonal(jacobian, axis1=1, axis2=2)).argmax(axis=1)]

    def ahead(self, ticks: int, finer: int = 1) -> Table:
        """The states after some ticks in which nothing else moves, in the steps of the first, or ``finer`` ones."""
        y, count = self.states, finer * int(self.parts[0])
        with np.errstate(all="ignore"):
            for _ in range(ticks):
                if self._fastest_s is not None:
                    stages = stages_of(self._tick_s / finer, self._fastest_s)
                    for _ in range(finer):
                        y = self._stabilised(y, stages)
                else:
                    for _ in range(count):
                        y = self._runge_kutta(y, self._tick_s / count)
                y = np.maximum(y, self._least)
        return y

    def _runge_kutta(self, y: Table, h: float) -> Table:
        a = self._slopes(y)
        b = self._slopes(y + 0.5 * h * a)
        c = self._slopes(y + 0.5 * h * b)
        return np.asarray(y + h / 6.0 * (a + 2.0 * b + 2.0 * c + self._slopes(y + h * c)))

    def _stabilised(self, y: Table, stages: Iterable[Stage]) -> Table:
        begun = before = first = here = y
        for stage in stages:
            rate = self._slopes(here)
            if stage.fresh:
                begun, before, first = here, np.zeros_like(here), rate
            now = (1.0 - stage.here - stage.before) * begun + stage.here * here + stage.before * before
            before, here = here, now + stage.rate * rate + stage.first * first
        return here

    def _slopes(self, y: Table) -> Table:
        values = self._values | dict(zip(self._own, y.T, strict=True))
        with np.errstate(all="ignore"):
            changes = self._changes(*(values[each] for each in self._leaves))
        return np.stack([np.broadcast_to(change, y.shape[:1]) for change in changes], axis=1)
