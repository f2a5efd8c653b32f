"""Evidence: how far the readings of a window are from what a fault set predicts, and what may be said against it.

Residuals r are in standard deviations of noise. What is uncertain anyway, a constant error of each variable and the
parameters, is removed along directions D with z = (I + D'D)^-1 D' r, and paid for by |z|^2; only then what is left is
bounded, so that a wild reading does not decide, and a grossly wrong fault set is not excused for being so. With
normal errors and without the bound this is r' (I + D D')^-1 r.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from homeostat.process.batch import ProcessError, tick_of
from homeostat.process.equipment import lag_share
from homeostat.process.model import ProcessModel
from homeostat.process.types import Cube, Indices, Table, Vec
from homeostat.twin.calibration import Posterior
from homeostat.twin.carried import Carrier, FaultSet, scaled
from homeostat.twin.history import Window
from homeostat.twin.isolation.input_errors import LATE, distant_inputs, late_inputs, weaker_inputs
from homeostat.twin.isolation.unseen_beginning import unseen_beginning
from homeostat.twin.isolation.wandering import wandering
from homeostat.twin.replay import Replay, replay, replay_ends

TEMPER = 3.0
"""Evidence is divided by this: the model's errors are neither quite constant nor quite white."""
BOUND = 12.0
"""What is left of one reading counts as this many standard deviations at most."""
WILD = 9.0
"""Square of what is left of a single reading, which counts as no more than this or its neighbours [1]."""
NOISE_APART = 3
"""Readings so many apart have independent noise, and have hardly changed otherwise."""
NORMAL = 1.4826
"""Standard deviation of normal numbers in multiples of their median distance from the median [1]."""
LEAST_NORM = 0.3
"""Directions along which all readings together change by less are left out [standard deviations of noise]."""
SETTLED = 15
"""Readings that say where a variable started from."""
USUAL_BLOCK = 3.5
"""Mean square over a block of one variable that noise alone does not exceed, correlated as it may be [1]."""
MEAN_SQUARE = 1.5
"""What is left of an explanation that fits has a smaller mean square [1]."""
WORST_BLOCK = 20.0
"""The same for the worst block of one variable [1]."""
STRAINED_MEAN_SQUARE, STRAINED_BLOCK = 1.25, 5.0
"""Where more is left, further changes are looked for; a right explanation leaves 1.1 and 4, on any plant [1]."""
BLOCK = 30
"""Readings in a block, whose mean square says whether an explanation fits everywhere."""
AT_ONCE = 32
"""Sets of which is worked out at once what is left: what is made on the way fits into a cache."""
FILTERED = 64
"""Readings that are filtered at once."""
MOST_NUMBERS = 20_000_000
"""Readings that are compared at once, over all sets: of sixty instruments they would take all the memory there is."""


@dataclass(frozen=True, slots=True)
class Accuracy:
    """How well a model that is right predicts readings."""

    errors: Mapping[str, tuple[float, float]]
    """Variable -> standard deviations of noise per reading, or sample of an analyser, and of the model, in its unit."""
    gain: float
    """Share of what a reading has moved by to which that is predicted at best [1]."""
    lag_s: float = 0.0
    """By how much actuators and instruments may lag behind the model's [s]; 0 where none does."""
    damping: Mapping[str, float] = field(default_factory=dict)
    """Variable -> time constant of its transmitter's own filter [s], which the model does not have."""
    paths: tuple[int, ...] = ()
    """Noise seeds of the paths by which what nobody measures may wander; none where that is left out."""
    initial: Mapping[str, float] = field(default_factory=dict)
    """State -> standard deviation of what is wrong where a window begins, of those that no instrument shows."""


@dataclass(frozen=True, slots=True)
class Fit:
    """How well the best explanation fits; what is left would be white noise of variance 1 if everything were right."""

    mean_square: float
    """Mean square of what is left over the whole window [1]."""
    worst_block: float
    """The same over the worst block of one variable [1]."""
    unexplained: float
    """What blocks that are worse than noise make of it come to [nats]."""

    @property
    def good(self) -> bool:
        """Whether the explanation fits."""
        return self.mean_square <= MEAN_SQUARE and self.worst_block <= WORST_BLOCK

    @property
    def strained(self) -> bool:
        """Whether more is left than of a right one."""
        return self.mean_square > STRAINED_MEAN_SQUARE or self.worst_block > STRAINED_BLOCK


class Evidence:
    """Scores fault sets by replaying the readings of one window, all in one call of the engine."""

    def __init__(
        self,
        model: ProcessModel,
        carrier: Carrier,
        window: Window,
        posterior: Posterior,
        accuracy: Accuracy,
        known: FaultSet = (),
    ) -> None:
        """``known`` is what was probably wrong before; the model's response to its parameters depends on it.

        A gain has an error because flows add up to levels, and so do their errors. Readings that show one sample of an
        analyser count as one together.
        """
        self.model, self.carrier, self.window, self.posterior = model, carrier, window, posterior
        self._accuracy = accuracy
        self.variables = tuple(accuracy.errors)
        noise, bias = np.array(list(accuracy.errors.values())).T
        tick_s = tick_of(model.kernel)
        self._damped = {
            j: lag_share(accuracy.damping[v], tick_s)
            for j, v in enumerate(self.variables)
            if accuracy.damping.get(v, 0.0) > 0.0
        }
        self._seen = np.stack([window.readings[v][1:] for v in self.variables], axis=1)
        noise = np.maximum(noise, observed_noise(self._seen))
        moved = self._seen - np.mean(self._seen[:SETTLED], axis=0)
        counts = np.ones(self._seen.shape)
        for j, v in enumerate(self.variables):
            if v in window.held:
                counts[:, j] = ~window.held[v][1:]
        self._per_sample = np.array([window.per_sample.get(v, 1) for v in self.variables], dtype=np.float64)
        self._weight = counts / np.hypot(noise, accuracy.gain * moved) / np.sqrt(self._per_sample)
        self._bound: float | Vec = BOUND
        if np.any(self._per_sample > 1.0):
            self._bound = np.tile(BOUND / np.sqrt(self._per_sample), len(self._seen))
        self.directions = self._nuisance_directions(known, bias / noise / np.sqrt(self._per_sample), accuracy)
        self.inner = np.linalg.inv(np.eye(self.directions.shape[1]) + self.directions.T @ self.directions)
        self._along, self._back = self.directions @ self.inner, self.directions.T.copy()

    def on(self, window: Window) -> Evidence:
        """The same of the readings of another ``window``, of which nothing is known."""
        return Evidence(self.model, self.carrier, window, self.posterior, self._accuracy)

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of readings and of variables."""
        return self._seen.shape[0], self._seen.shape[1]

    def whiten(self, change: Cube) -> Table:
        """Changes of readings, shape (n, ticks, variables), in standard deviations, shape (n, readings)."""
        found = change * self._weight
        for j, share in self._damped.items():
            found[:, :, j] = _filtered(change[:, :, j], share) * self._weight[:, j]
        return np.asarray(found).reshape(len(change), self._weight.size)

    def residuals(self, sets: Sequence[FaultSet]) -> Table:
        """Readings minus what each of ``sets`` predicts, in standard deviations, shape (sets, readings)."""
        return self._misfit(self._replayed(sets))

    def _replayed(self, sets: Sequence[FaultSet], refuse: bool = True) -> Replay:
        members = np.tile(self.posterior.mean, (len(sets), 1))
        carried = self.carrier.carry(sets, self.window)
        return replay(self.model, self.window, members, carried, self.variables, refuse=refuse)

    def _misfit(self, run: Replay) -> Table:
        """Readings minus what was predicted, in standard deviations, shape (members, readings)."""
        # In place: what was predicted may be tens of megabytes.
        predicted = run.predicted
        for j, share in self._damped.items():
            predicted[:, :, j] = _filtered(predicted[:, :, j], share)
        misfit = np.subtract(self._seen, predicted, out=predicted)
        misfit *= self._weight  # a reading that was not there says nothing
        return misfit.reshape(len(misfit), -1)

    def repeats(self, variable: str, faults: FaultSet) -> bool:
        """Whether with ``faults`` the instrument of ``variable`` shows one value only at the end of the window."""
        carried = self.carrier.carry([faults], self.window)
        every = tuple(dict.fromkeys((*self.variables, variable)))
        try:
            shown = replay(self.model, self.window, self.posterior.mean[None], carried, every).predicted[0]
        except ProcessError:
            return False
        return bool(np.ptp(shown[-BLOCK:, every.index(variable)]) == 0.0)

    def losses(self, residuals: Table) -> Vec:
        """Loss of each row of ``residuals``, shape (n, readings), shape (n,)."""
        z = residuals @ self._along
        found: Vec = np.einsum("ij,ij->i", z, z)
        room = np.empty((min(len(z), AT_ONCE), residuals.shape[1]))  # stays in the cache, and is there already
        for k in range(0, len(z), AT_ONCE):
            rows = slice(k, k + AT_ONCE)
            left = np.matmul(z[rows], self._back, out=room[: len(z[rows])])
            np.subtract(residuals[rows], left, out=left)
            np.clip(left, -self._bound, self._bound, out=left)
            found[rows] += np.einsum("ij,ij->i", left, left)
        return found

    def left(self, residuals: Table) -> Table:
        """What is left of ``residuals`` without what is uncertain anyway, shape (n, readings)."""
        return np.asarray(residuals - (residuals @ self._along) @ self._back)

    def likelihoods(self, sets: Sequence[FaultSet]) -> Vec:
        """Log-likelihood of each of ``sets`` up to a constant [nats], shape (sets,).

        Of one with which the model leaves the physical world it is minus infinity.
        """
        most = max(MOST_NUMBERS // math.prod(self.shape), 1)
        if len(sets) > most:
            return np.concatenate([self.likelihoods(sets[k : k + most]) for k in range(0, len(sets), most)])
        try:
            run = self._replayed(sets, refuse=False)
        except ProcessError:  # one of them does not even begin as a plant
            if len(sets) == 1:
                return np.array([-np.inf])
            half = len(sets) // 2
            return np.concatenate([self.likelihoods(sets[:half]), self.likelihoods(sets[half:])])
        lost = np.isnan(run.state).any(axis=1)
        run.predicted[lost] = 0.0
        return np.where(lost, -np.inf, -0.5 * self.losses(self._misfit(run)) / TEMPER)

    def residuals_of_ends(self, faults: FaultSet, ends: Indices, left: float = 0.0) -> Table:
        """As :meth:`residuals`, where of ``faults`` the share ``left`` is there after so many readings, shape (ends,).

        ProcessError where the model leaves the physical world.
        """
        before, after = (self.carrier.carry([scaled(faults, share)], self.window) for share in (1.0, left))
        what = self.model, self.window, self.posterior.mean, before, after
        return self._misfit(replay_ends(*what, self.variables, ends))

    def likelihoods_of_ends(self, faults: FaultSet, ends: Indices, left: float = 0.0) -> Vec:
        """As :meth:`likelihoods`, of the same."""
        return np.asarray(-0.5 * self.losses(self.residuals_of_ends(faults, ends, left)) / TEMPER)

    def fit_of(self, faults: FaultSet) -> Fit:
        """How well ``faults`` explain the readings."""
        return self.fit(self.left(self.residuals([faults]))[0])

    def fit(self, left: Vec, block: int = BLOCK) -> Fit:
        """How well an explanation fits of which ``left`` is left, shape (readings,), in blocks of so many readings.

        A single wild reading is no reason to doubt it. Blocks are counted from the last reading back, so
        that what has just begun is in one of them.
        """
        return _fit(self._squares(left), self._per_sample, block)

    def fits(self, left: Vec) -> dict[str, Fit]:
        """The same of each variable by itself."""
        squares, samples = self._squares(left), self._per_sample
        return {v: _fit(squares[:, j : j + 1], samples[j : j + 1]) for j, v in enumerate(self.variables)}

    def _squares(self, left: Vec) -> Table:
        """Squares of what is left of each sample that a reading shows, shape (ticks, variables)."""
        return _without_wild(np.square(left.reshape(self.shape)) * self._per_sample)

    def _nuisance_directions(self, known: FaultSet, constant: Vec, accuracy: Accuracy) -> Table:
        """Directions in which readings may differ although nothing new is wrong, shape (readings, k), in spreads.

        A constant model error of each variable, one standard deviation of each parameter that is still uncertain, and
        of what each input does less, or later, or far from where it was learned: what was not learned in healthy
        operation, as the loss to the ambient of a plant that was never idle, is no sign of a fault. Nor is what wanders
        in the model and nobody measures, or where that began.
        """
        root, mean = self.posterior.root, self.posterior.mean
        members = np.vstack([mean, mean + root.T])
        carried = self.carrier.carry([known], self.window).repeated(len(members))
        predicted = replay(self.model, self.window, members, carried, self.variables).predicted
        parameters = self.whiten(predicted[1:] - predicted[0])
        ticks, variables = self.shape
        constants = np.zeros((variables, ticks, variables))
        for j in range(variables):
            constants[j, :, j] = constant[j] * (self._weight[:, j] > 0.0)
        present = self.carrier.carry([known], self.window)
        what = self.model, self.window, mean[None], present, self.variables
        every = [constants.reshape(variables, -1), parameters, self.whiten(weaker_inputs(*what, accuracy.gain))]
        every.append(_clear(self.whiten(wandering(*what, accuracy.paths))))
        every.append(_clear(self.whiten(unseen_beginning(*what, accuracy.initial))))
        if self.posterior.usual is not None:
            far = distant_inputs(*what, accuracy.gain, self.posterior.usual.inputs)
            every.append(_clear(self.whiten(_each_by_itself(far))))
            every.append(self._distant_readings(accuracy.gain, self.posterior.usual.readings))
        lag = accuracy.lag_s / tick_of(self.model.kernel)
        if lag > 0.0 and ticks > max(LATE):
            every.append(self.whiten(late_inputs(*what, lag)))
        return np.vstack(every).T.copy()

    def _distant_readings(self, gain: float, usual: Mapping[str, float]) -> Table:
        """What each reading is wrong by that is elsewhere than ``usual``: its characteristic is another.

        Of the distance that is predicted where nothing is wrong counts what the readings confirm: what a fault shows is
        no distance. ``gain``: share of it [1]. Shape (variables, readings); none where that prediction breaks down.
        """
        try:
            predicted = self._seen - self.residuals([()])[0].reshape(self.shape) / np.maximum(self._weight, 1e-300)
        except ProcessError:
            return np.zeros((0, self._weight.size))
        change = np.zeros((len(self.variables), *self.shape))
        for j, variable in enumerate(self.variables):
            if variable in usual:
                away, seen = predicted[:, j] - usual[variable], self._seen[:, j] - usual[variable]
                confirmed = float(np.clip(away @ seen / max(float(away @ away), 1e-300), 0.0, 1.0))
                change[j, :, j] = gain * confirmed * away
        return self.whiten(change)


def _filtered(shown: Table, share: float) -> Table:
    """``shown``, shape (n, ticks), as it comes through a filter that follows by this ``share`` within a tick.

    y_t = y_(t-1) + share (x_t - y_(t-1)) from y_0 = x_0 on: y_(t+k) is (1 - share)^k y_t and share (1 - share)^(k-i) of
    each x_(t+i) since.
    """
    found = np.array(shown)  # readings of a member lie next to each other now
    age = np.arange(FILTERED)[:, None] - np.arange(FILTERED)[None, :]
    weights = np.where(age >= 0, share * (1.0 - share) ** np.maximum(age, 0), 0.0)
    kept = (1.0 - share) ** np.arange(1, FILTERED + 1)
    for first in range(1, found.shape[1], FILTERED):
        new = found[:, first : first + FILTERED]
        count = new.shape[1]
        new[:] = new @ weights[:count, :count].T + found[:, first - 1, None] * kept[:count]
    return found


def _fit(squares: Table, per_sample: Vec, block: int = BLOCK) -> Fit:
    """How well what leaves these ``squares`` fits, shape (ticks, variables), with readings for each sample of those."""
    ticks, variables = squares.shape
    length = min(block, ticks)
    count = ticks // length
    blocks = squares[ticks - count * length :].reshape(count, length, variables).mean(axis=1)
    excess = (np.maximum(blocks - USUAL_BLOCK, 0.0) / per_sample).sum() * length
    return Fit(float(squares.mean()), float(blocks.max()), float(0.5 * excess / TEMPER))


def _each_by_itself(change: Cube) -> Cube:
    """``change``, shape (n, ticks, variables), of one variable at a time, shape (n * variables, ticks, variables).

    That a valve cools less far from where it was learned says nothing of its position, nor of what flows through it.
    """
    count, ticks, variables = change.shape
    alone = np.zeros((count, variables, ticks, variables))
    for j in range(variables):
        alone[:, j, :, j] = change[:, :, j]
    return alone.reshape(count * variables, ticks, variables)


def _clear(directions: Table) -> Table:
    """Those of ``directions`` that stand out of the noise, shape (k, readings)."""
    return np.asarray(directions[np.linalg.norm(directions, axis=1) > LEAST_NORM])


def observed_noise(readings: Table) -> Vec:
    """Standard deviation of the noise of each column of ``readings``, shape (ticks, variables), in its unit.

    By the median of what they change by within `NOISE_APART`, which neither a few steps nor a steady course decide: an
    instrument whose noise grows with its reading is not as good as it is by design wherever it reads more.
    """
    if len(readings) <= 2 * NOISE_APART:
        return np.zeros(readings.shape[1])
    change = readings[NOISE_APART:] - readings[:-NOISE_APART]
    spread = np.median(np.abs(change - np.median(change, axis=0)), axis=0)
    return np.asarray(NORMAL * spread / np.sqrt(2.0))


def _without_wild(squares: Table) -> Table:
    """``squares``, shape (ticks, variables), of which none is much larger than both its neighbours."""
    around = np.pad(squares, ((1, 1), (0, 0)))
    return np.minimum(squares, np.maximum(np.maximum(around[:-2], around[2:]), WILD))
