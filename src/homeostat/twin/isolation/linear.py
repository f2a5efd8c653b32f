"""Linear: of what size, and since when, a disturbance explains the readings best where a model were linear.

For a response u and residuals r the size is b = (u'Wr + t m/s^2) / (u'Wu + t/s^2) with W = I - D (I + D'D)^-1 D', the
temper t of the evidence, and b ~ N(m, s^2) before anything is seen. What grows or swings is a mixture A of steps U:
its curvature A (UWU') A' and pull A (UWr) follow from theirs, and only what is hopeful is worked out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from homeostat.domain.diagnosis import FaultMode
from homeostat.process.types import Cube, Indices, Table, Vec
from homeostat.twin.isolation.evidence import TEMPER, Evidence
from homeostat.twin.isolation.prior import Prior

SHORTLIST = 4
"""Onsets of one disturbance whose bounded loss is worked out."""
SHORTEST = 8
"""Shortest period, in steps between two onsets: what swings faster no step can follow [1]."""
FASTEST = 20
"""The same in ticks: what swings faster is noise [1]."""
FINER = 1.1
"""Ratio of two neighbouring periods that are tried [1]."""
HELD = 0.25
"""Share of the time to the next step at which a sine is taken for a step: that of a balance stands for what is around
it, any other one for what is until the next [1]."""
STARTS = 2
"""Every how many onsets one may begin to swing [1]."""
SEEN = 0.75
"""Turns that must have been seen of what is said to swing: half of one is like what lasts [1]."""


@dataclass(frozen=True, slots=True)
class Linear:
    """The best of a linear pass."""

    mode: FaultMode
    row: int
    size: float
    sd: float
    score: float
    period_s: float = 0.0
    """Period of what swings [s]; 0 for everything else."""


def direction(mode: FaultMode) -> float:
    """Direction of a mode that has one; 0 where its severity has a sign of its own."""
    if mode.effect is None or mode.severity_range.low < 0.0:
        return 0.0
    return float(np.sign(mode.effect.per_unit))


class Steps:
    """Responses to a unit step of one quantity from several onsets on, and what mixtures of them explain."""

    def __init__(self, responses: Table, curvature: Table, pull: Vec) -> None:
        """``responses``: shape (onsets, readings); ``curvature`` U W U' (onsets, onsets), ``pull`` U W r (onsets,)."""
        self.responses, self.curvature, self.pull = responses, curvature, pull

    def mixed(self, mixture: Table) -> Table:
        """Responses to a ``mixture`` of the steps, shape (n, onsets), shape (n, readings)."""
        return np.asarray(mixture @ self.responses)


class LinearPass:
    """What is left beside a fault set, explained by one disturbance."""

    def __init__(self, evidence: Evidence, prior: Prior, residual: Vec) -> None:
        """``residual``: what is left, in standard deviations, shape (readings,)."""
        self._evidence, self._prior, self._residual = evidence, prior, residual
        d, inner = evidence.directions, evidence.inner
        self._freed = residual - d @ (inner @ (d.T @ residual))

    def steps(self, responses: Table) -> Steps:
        """Of these ``responses``, shape (onsets, readings)."""
        along = responses @ self._evidence.directions
        curvature = responses @ responses.T - along @ self._evidence.inner @ along.T
        return Steps(responses, curvature, responses @ self._freed)

    def best(
        self, modes: Mapping[float, FaultMode], rows: Indices, steps: Steps, mixture: Table | None = None
    ) -> Linear:
        """The best onset of ``modes``, direction -> mode of one quantity; ``mixture`` of steps, or each of them.

        ``rows``: the onset of each.
        """
        any_mode = next(iter(modes.values()))
        effect = any_mode.effect
        assert effect is not None
        mean, spread = self._prior.of_size(any_mode, rows)
        gain, pull = np.diag(steps.curvature), steps.pull
        if mixture is not None:
            gain, pull = np.einsum("ij,ij->i", mixture @ steps.curvature, mixture), mixture @ steps.pull
        precision = np.maximum(gain, 0.0) / TEMPER + 1.0 / spread**2
        size = (pull / TEMPER + mean / spread**2) / precision
        if 0.0 not in modes:
            size = np.where(np.isin(np.sign(size), list(modes)), size, 0.0)
        size = np.clip(size, -effect.most, effect.most)
        hopeful = np.argsort(-(size**2 * precision))[:SHORTLIST]
        change = steps.responses[hopeful] if mixture is None else steps.mixed(mixture[hopeful])
        score = self.likelihoods(size[hopeful, None] * change)
        score -= self._prior.cost_of_size(any_mode, size[hopeful], rows[hopeful])
        k = int(np.argmax(score))
        best = int(hopeful[k])
        mode = modes.get(0.0) or modes[float(np.sign(size[best])) or next(iter(modes))]
        total = float(score[k]) + self._prior.of_mode(mode)
        return Linear(mode, int(rows[best]), float(size[best]), float(precision[best] ** -0.5), total)

    def swing(self, mode: FaultMode, turns: Turns, steps: Steps) -> Linear | None:
        """The best of what swings, by all ``turns``; None where no turn was long enough ago."""
        if not len(turns.rows):
            return None
        _, spread = self._prior.of_size(mode, turns.rows[:1])
        curved = np.einsum("nio,op,njp->nij", turns.mixture, steps.curvature, turns.mixture, optimize=True) / TEMPER
        pull = turns.mixture @ steps.pull / TEMPER
        curved += np.eye(2) / spread[0] ** 2
        parts = np.linalg.solve(curved, pull[:, :, None])[:, :, 0]
        hopeful = np.argsort(-np.einsum("ni,ni->n", parts, pull))[:SHORTLIST]
        most = np.inf if mode.effect is None else mode.effect.most
        parts *= np.minimum(1.0, most / np.maximum(np.hypot(*parts.T), 1e-300))[:, None]
        changes = np.stack([parts[n] @ steps.mixed(turns.mixture[n]) for n in hopeful])
        size = np.hypot(*parts[hopeful].T)
        score = self.likelihoods(changes) - self._prior.cost_of_size(mode, size, turns.rows[hopeful])
        k = int(np.argmax(score))
        n = int(hopeful[k])
        at, first = float(turns.rows[n]), bool(turns.rows[n] == turns.rows.min())
        row, signed = _begun(parts[n], at, float(turns.ticks[n]), before=first)
        sd = float(np.sqrt(np.linalg.inv(curved[n]).diagonal().max()))
        total = float(score[k]) + self._prior.of_mode(mode)
        return Linear(mode, row, signed, sd, total, float(turns.ticks[n]) * self._evidence.window.tick_s)

    def likelihoods(self, changes: Table) -> Vec:
        """Log-likelihoods where readings change so, shape (n, readings) [nats], shape (n,)."""
        return np.asarray(-0.5 * self._evidence.losses(self._residual - changes) / TEMPER)


@dataclass(frozen=True, slots=True)
class Turns:
    """Everything that may swing within one window, whatever it is: as mixtures of steps."""

    rows: Indices
    """Since when, shape (n,)."""
    ticks: Vec
    """Period of each, in ticks, shape (n,)."""
    mixture: Cube
    """A sine and a cosine of each, shape (n, 2, onsets)."""

    @classmethod
    def of(cls, onsets: Indices, every: int, length: int) -> Turns:
        """Those that turn nearly once within ``length`` readings; steps are at ``onsets``, ``every`` readings apart."""
        shortest, longest = float(max(SHORTEST * every, FASTEST)), length / SEEN
        count = max(int(np.log(max(longest / shortest, 1e-9)) / np.log(FINER)) + 1, 0)
        pairs = [
            (float(row), ticks)
            for ticks in (shortest * FINER**k for k in range(count))
            for row in onsets[::STARTS].tolist()
            if length - row >= SEEN * ticks
        ]
        rows, ticks = np.array(pairs, dtype=np.float64).reshape(-1, 2).T
        since = onsets[None, :] - rows[:, None]
        angle = 2.0 * np.pi * (since + HELD * every) / ticks[:, None]
        course = np.stack([np.sin(angle), np.cos(angle)], axis=1) * (since >= 0)[:, None, :]
        return cls(rows.astype(np.int64), ticks, np.diff(course, axis=2, prepend=0.0))


def _begun(parts: Vec, row: float, ticks: float, before: bool) -> tuple[int, float]:
    """Row at which a sine passes nothing near ``row``, and its amplitude, from those of sine and cosine there.

    ``before``: it is none after it, because it has swung for as long as is looked at.
    """
    angle, size = float(np.arctan2(parts[1], parts[0])), float(np.hypot(*parts))
    if angle < 0.0 if before else abs(angle) > 0.5 * np.pi:
        angle, size = angle - float(np.copysign(np.pi, angle)), -size
    return round(row - angle / (2.0 * np.pi) * ticks), size
