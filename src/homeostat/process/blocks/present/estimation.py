"""From readings back to states: what a model must have been in to show them."""

from __future__ import annotations

from collections.abc import Callable, Container, Mapping
from typing import Any, Final, final

import numpy as np

from homeostat.process.blocks.flowsheet import SETPOINTS
from homeostat.process.blocks.hydraulics.solver import room, solve_network
from homeostat.process.blocks.layout import Layout
from homeostat.process.blocks.parts import Delay, Lag, Network, Sensor, held
from homeostat.process.blocks.term import TICK, ZERO, Leaf, Term, evaluate, leaves, replaced, together
from homeostat.process.types import Table, Vec

_ROUNDS: Final = 8
_PRIOR: Final = 1e-6
"""Weight of where a run begins beside a reading: it decides only what no instrument shows."""
_FOLLOWED: Final = 1e6
"""The same where somebody followed a state that no instrument shows: that others rest does not move it."""
_NUDGE: Final = 1e-5
_SHARES: Final = 0.5 ** np.arange(8.0)
"""Shares of a Gauss-Newton step of which the best is gone."""
_REST: Final = 1.0
"""Ticks in which a state that rests may move by 1 as easily as a reading is off by its noise."""


@final
class Estimation:
    """Estimates states of one layout by Gauss-Newton steps from where a run begins.

    Minimises the squares of (reading - model) / noise, for the instruments that depend on a state, and the rates of
    states that rest, which count little where an instrument shows them. An instrument behind a lag or a dead time shows
    what stands before that, as after a long time.
    """

    def __init__(self, layout: Layout, stated: Mapping[str, float]) -> None:
        """``stated``: best estimate of every parameter; without one of them nothing can be estimated."""
        self._layout, sheet = layout, layout.sheet
        self._stated = {of: stated.get(n, np.nan) for n, of in layout.leaf[Leaf.PARAMETER].items()}
        self.parameters: Vec = np.array([stated.get(n, np.nan) for n in layout.parameters])
        """Best estimate of every parameter, shape (parameters,)."""
        self._states = [s.term for s in sheet.states.values()]
        self._least = np.array([-np.inf if s.least is None else s.least for s in sheet.states.values()])
        self._settled = _settled(layout)
        self._telling = [s for s in sheet.sensors.values() if leaves(self._settled[s.name]) & set(self._states)]
        self._direct = {s.name: s for s in self._telling if _about_states(s)}
        self._functions: dict[tuple[str, ...], tuple[tuple[Term, ...], Callable[..., Any]]] = {}
        self._resting = [layout.rates[str(state.value)] for state in sheet.resting]
        positions = {a.position: a.name for a in sheet.actuators.values()}
        self._position_of = {s.name: positions[s.of] for s in sheet.sensors.values() if s.of in positions}
        self.shown_actuators = frozenset(self._position_of.values())
        """Actuators whose position an instrument shows."""

    def estimate(self, readings: Mapping[str, float]) -> Vec:
        """A state that agrees with ``readings``, shape (states,)."""
        sheet, at = self._layout.sheet, self._layout.column
        x = np.zeros(len(at))
        for name, value in readings.items():
            if name in at:
                x[at[name]] = value
        for a in sheet.actuators.values():
            command = readings.get(a.command, a.start)
            shown = next((n for n, actuator in self._position_of.items() if actuator == a.name), None)
            stands = command if shown is None else readings.get(shown, command)
            x[[at[column] for column in a.positions]] = min(max(stands, 0.0), 1.0)
            x[at[a.command]] = command
        for d in sheet.disturbances.values():
            mean = self._stated[self._layout.leaf[Leaf.PARAMETER][d.name]]
            x[at[str(d.now.value)]] = mean if d.measured is None else readings.get(d.measured, mean)
        for kept in sheet.memories.values():
            shown = next((s.name for s in sheet.sensors.values() if s.of == held(kept.name)), kept.name)
            x[at[kept.name]] = readings.get(shown, kept.usual)
        for c in sheet.controllers.values():
            given = readings.get(c.given, np.nan)
            x[at[str(c.used.value)]] = readings[c.measured] if np.isnan(given) else given
        values = self._values(x, readings)
        for a in sheet.actuators.values():
            if a.withheld != ZERO and a.name not in self.shown_actuators:
                passes = min(max(x[at[a.command]] - float(evaluate(a.withheld, values)), 0.0), 1.0)
                for column in a.positions:
                    x[at[column]] = values[held(column)] = passes
        usual = np.array([readings.get(s.name, evaluate(s.usual, values)) for s in sheet.states.values()])
        found = self._solved(usual, values, readings)
        x[: len(found)] = found
        self._follow(x, values | dict(zip(self._states, found.tolist(), strict=True)), readings)
        return x

    def fill(self, x: Vec, parameters: Vec) -> None:
        """Let lags, dead times and instruments agree with the states and positions in ``x``, in place."""
        named = dict(zip(self._layout.leaf[Leaf.PARAMETER].values(), parameters.tolist(), strict=True))
        self._follow(x, self._values(x, {}) | named, ())

    def correct(self, states: Table, residuals: Mapping[str, Vec]) -> None:
        """Move ``states``, shape (members, states), by readings beyond the model: variable -> shape (members,)."""
        used = [self._direct[name] for name in residuals if name in self._direct]
        if not used:
            return
        values = self._values(states.mean(axis=0), {})
        jacobian = np.array([self._slope(s.of, values) / self._noise(s) for s in used])
        beyond = np.stack([residuals[s.name] / self._noise(s) for s in used], axis=1)
        n = len(self._states)
        states[:, :n] = np.maximum(states[:, :n] + beyond @ np.linalg.pinv(jacobian).T, self._least)
        values |= {state: states[:, i] for i, state in enumerate(self._states)}
        for s in self._direct.values():
            states[:, self._layout.column[s.true]] = evaluate(s.of, values)

    def _solved(self, first: Vec, values: dict[Term, Any], readings: Mapping[str, float]) -> Vec:
        """States that agree best with ``readings``, from ``first`` on; no step makes them agree less."""
        used = [s for s in self._telling if s.name in readings and np.isfinite(readings[s.name])]
        if not used:
            return np.asarray(np.maximum(first, self._least))
        said = np.array([readings[s.name] for s in used])
        weights = np.concatenate(
            [[1.0 / self._noise(s) for s in used], np.full(len(self._resting), _REST * self._layout.tick_s)]
        )
        scale, x = np.maximum(np.abs(first), 1.0), np.maximum(first, self._least)
        own, function = self._off(tuple(s.name for s in used))
        nudge = _NUDGE * np.maximum(np.abs(x), 1.0)
        followed = [str(state.value) in readings for state in self._states]
        prior = np.diag(np.where(followed, _FOLLOWED, _PRIOR) / scale)

        def off(at: Table) -> Table:
            """Of states, shape (n, states), how far each reading and rate is off, shape (n, readings and rates)."""
            there = values | dict(zip(self._states, at.T, strict=True))
            with np.errstate(all="ignore"):
                found = function(*(there[leaf] for leaf in own))
            shown = np.stack([np.broadcast_to(each, len(at)) for each in found], axis=1)
            shown[:, : len(said)] -= said
            return np.asarray(-shown * weights)

        for _ in range(_ROUNDS):
            shifts = np.concatenate([np.diag(nudge), -np.diag(nudge), np.zeros((1, len(x)))])
            rows = off(x + shifts)
            slopes = (rows[len(x) : -1] - rows[: len(x)]) / (2.0 * nudge[:, None])
            now = np.concatenate([rows[-1], prior @ (first - x)])
            step = np.linalg.lstsq(np.vstack([slopes.T, prior]), now, rcond=None)[0]
            tried = np.maximum(x + _SHARES[:, None] * step, self._least)
            left = np.concatenate([off(tried), (first - tried) @ prior], axis=1)
            missed = np.where(np.isfinite(left).all(axis=1), np.square(left).sum(axis=1), np.inf)
            best = int(np.argmin(missed))
            if not missed[best] < np.square(now).sum():
                break
            moved, x = np.abs(tried[best] - x), tried[best]
            if np.all(moved <= 1e-9 * scale):
                break
        return np.asarray(x)

    def _off(self, names: tuple[str, ...]) -> tuple[tuple[Term, ...], Callable[..., Any]]:
        """What instruments show and how fast states that rest change, as a function of their leaves."""
        if names not in self._functions:
            self._functions[names] = together([*(self._settled[name] for name in names), *self._resting])
        return self._functions[names]

    def _slope(self, of: Term, values: dict[Term, Any]) -> Vec:
        """By how much ``of`` changes with each state, shape (states,)."""
        own, slopes = leaves(of), np.zeros(len(self._states))
        for i, state in enumerate(self._states):
            if state in own:
                nudge = _NUDGE * max(abs(values[state]), 1.0)
                up, down = (evaluate(of, values | {state: values[state] + d}) for d in (nudge, -nudge))
                slopes[i] = (up - down) / (2.0 * nudge)
        return slopes

    def _noise(self, s: Sensor) -> float:
        sd = float(self._stated[s.noise])
        return max(sd, 1e-6)

    def _values(self, x: Vec, readings: Mapping[str, float]) -> dict[Term, Any]:
        """What every leaf is in the state ``x``."""
        values: dict[Term, Any] = self._stated | {TICK: self._layout.tick_s}
        values.update(zip(self._layout.leaf[Leaf.HELD].values(), x.tolist(), strict=True))
        values.update(zip(self._states, x.tolist(), strict=False))
        values |= {of: readings.get(n, np.nan) for n, of in self._layout.leaf[Leaf.INPUT].items()}
        return {**values, **self._layout.healthy}

    def _follow(self, x: Vec, values: dict[Term, Any], read: Container[str]) -> None:
        """Lags and dead times as after a long time, then what instruments that were not ``read`` show, in place."""
        sheet, at, held = self._layout.sheet, self._layout.column, self._layout.leaf[Leaf.HELD]
        for each in sheet.lags.values():
            if isinstance(each, Network):
                x[[at[name] for name in each.columns]] = found = _flowing(each, values)
                values.update((held[n], float(v)) for n, v in zip(each.columns, found, strict=True))
                continue
            stands = float(evaluate(each.of, values))
            for column in each.columns(self._layout.tick_s) if isinstance(each, Delay) else (each.name,):
                x[at[column]] = values[held[column]] = stands
        for s in sheet.sensors.values():
            x[[at[s.true], at[s.ideal]]] = evaluate(s.of, values)
            if s.name not in read:
                x[at[s.name]] = x[at[s.true]]
        for q in sheet.quantities.values():
            x[at[q.name]] = evaluate(q.of, values)


def unseen_states(layout: Layout) -> tuple[str, ...]:
    """States that no instrument shows and that others depend on, but for those that rest: these follow the others.

    Where a model's own controllers act in a replay, their integral terms are among them: no command shows one while it
    is at its end.
    """
    told = leaves(*_settled(layout).values()) | set(layout.sheet.resting)
    lags = [each.terms if isinstance(each, Network) else (each.of,) for each in layout.sheet.lags.values()]
    inside = leaves(*(of for terms in lags for of in terms))

    def acts(state: Term) -> bool:
        return state in inside | leaves(*(rate for name, rate in layout.rates.items() if name != state.value))

    own = [name for name, s in layout.sheet.states.items() if s.term not in told and acts(s.term)]
    acting = layout.sheet.controllers.values() if layout.sheet.replayed == SETPOINTS else ()
    return (*own, *(c.integral for c in acting))


def _settled(layout: Layout) -> dict[str, Term]:
    """Instrument -> what it shows after a long time: what stands before a lag or a dead time."""
    lags = layout.sheet.lags.values()
    behind = {held(_column(each)): each.of for each in lags if isinstance(each, (Lag, Delay))}
    return {s.name: replaced(s.of, behind) for s in layout.sheet.sensors.values()}


def _flowing(network: Network, values: dict[Term, Any]) -> Vec:
    """Heads and flows of a network, shape (columns,)."""
    numbers = [each if isinstance(each, float) else evaluate(each, values) for row in network.numbers() for each in row]
    n, m = len(network.junctions), len(network.branches)
    work = np.concatenate([numbers, np.zeros(room(n, m) - len(numbers))])
    solve_network(work, 0, n, m)
    return np.asarray(work[len(numbers) : len(numbers) + n + m])


def _column(each: Lag | Delay) -> str:
    """Column of what comes out of a lag or a dead time."""
    return each.oldest if isinstance(each, Delay) else each.name


def _about_states(s: Sensor) -> bool:
    """Whether an instrument shows states and nothing else that changes."""
    return all(leaf.op in (Leaf.STATE, Leaf.PARAMETER) for leaf in leaves(s.of))
