"""Estimate: of what size, and since when, each disturbance would explain the readings best.

For a response u and residuals r the size is b = (u'Wr + t m/s^2) / (u'Wu + t/s^2) with W = I - D (I + D'D)^-1 D', the
temper t of the evidence, and b ~ N(m, s^2) before anything is seen. What is found by that linear pass is replayed at
sizes around it, because a model is not linear.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from homeostat.domain.diagnosis import Effect, EffectKind, FaultMode, FaultState
from homeostat.process.types import Indices, Table
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.evidence import TEMPER, Evidence
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.responses import Responses

SHORTLIST = 4
"""Onsets of one disturbance whose bounded loss is worked out."""
CHANGED_NATS = 3.0
"""By how much a change must explain more than that it has always been so [nats]."""
POLISHED = 10
"""Disturbances that are replayed."""
SIZES = (0.6, 0.75, 0.87, 0.94, 1.0, 1.06, 1.15, 1.35, 1.7)
"""Sizes that are replayed, as multiples of the linear estimate [1]."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """One disturbance at its best."""

    state: FaultState
    """Which, of what size, since when."""
    sd: float
    """Standard deviation of its size, in its unit."""
    score: float
    """Log posterior up to a constant [nats]."""


@dataclass(frozen=True, slots=True)
class _Linear:
    """The best of a linear pass."""

    mode: FaultMode
    row: int
    size: float
    sd: float
    score: float


class Estimation:
    """Estimates every generated fault mode beside a fault set."""

    def __init__(self, evidence: Evidence, modes: Sequence[FaultMode], prior: Prior, beside: FaultSet) -> None:
        """``modes`` are those with an effect on what is compared."""
        self._evidence, self._prior, self._beside = evidence, prior, beside
        self._responses = Responses(evidence, beside)
        self._groups: dict[tuple[EffectKind, str], list[FaultMode]] = {}
        for mode in modes:
            if mode.effect is not None and mode.effect.kind not in (EffectKind.UNSEEN, EffectKind.FROZEN):
                self._groups.setdefault((mode.effect.kind, mode.effect.quantity), []).append(mode)
        self._residual = evidence.residuals([beside])[0]
        d, inner = evidence.directions, evidence.inner
        self._freed = self._residual - d @ (inner @ (d.T @ self._residual))

    def estimates(self) -> list[Estimate]:
        """The likeliest disturbances, each at its best, the best first."""
        found: list[_Linear] = []
        for group in self._groups.values():
            effect = group[0].effect
            assert effect is not None
            found += self._of_group(effect, group)
        found.sort(key=lambda each: -each.score)
        return sorted(
            self._polished([self._refined(each) for each in found[:POLISHED] if each.size != 0.0]),
            key=lambda e: -e.score,
        )

    def _of_group(self, effect: Effect, group: Sequence[FaultMode]) -> Iterator[_Linear]:
        """The best step and the best ramp of modes that act on the same quantity.

        None where the quantity may as well have differed from the beginning of the window on: that is how the plant is.
        """
        unit = Effect(effect.kind, effect.quantity, 1.0, capacity=effect.capacity)
        steps, rows, newest = self._responses.steps(unit), self._responses.rows, self._responses.newest
        lasting, growing = (
            {_sign(mode): mode for mode in group if mode.effect is not None and mode.effect.grows is grows}
            for grows in (False, True)
        )
        found: list[_Linear] = []
        always = -np.inf
        if lasting:
            always = self._best(lasting, rows[:1], steps[:1]).score
            found.append(self._best(lasting, rows, steps))
            if len(newest):
                found.append(self._best(lasting, newest, self._responses.steps(unit, newest)))
        if growing:
            found.append(self._best(growing, rows, self._responses.ramps(steps)))
        yield from (each for each in found if each.score > always + CHANGED_NATS)

    def _best(self, modes: Mapping[float, FaultMode], rows: Indices, change: Table) -> _Linear:
        any_mode = next(iter(modes.values()))
        mean, spread = self._prior.of_size(any_mode, rows)
        along = change @ self._evidence.directions
        gain = np.einsum("ij,ij->i", change, change) - np.einsum("ij,ij->i", along @ self._evidence.inner, along)
        precision = np.maximum(gain, 0.0) / TEMPER + 1.0 / spread**2
        size = (change @ self._freed / TEMPER + mean / spread**2) / precision
        if 0.0 not in modes:
            size = np.where(np.isin(np.sign(size), list(modes)), size, 0.0)
        hopeful = np.argsort(-(size**2 * precision))[:SHORTLIST]
        loss, _ = self._evidence.losses(self._residual - size[hopeful, None] * change[hopeful])
        score = -0.5 * loss / TEMPER - 0.5 * ((size - mean) / spread)[hopeful] ** 2
        k = int(np.argmax(score))
        best = int(hopeful[k])
        mode = modes.get(0.0) or modes[float(np.sign(size[best])) or next(iter(modes))]
        total = float(score[k]) + self._prior.of_mode(mode)
        return _Linear(mode, int(rows[best]), float(size[best]), float(precision[best] ** -0.5), total)

    def _refined(self, linear: _Linear) -> _Linear:
        """The same with its onset between those that are tried over the whole window; what grows has no sharp one."""
        effect = linear.mode.effect
        every = self._responses.every_s
        if effect is None or effect.grows or every == 1:
            return linear
        last = int(self._responses.rows[-1])
        rows = np.arange(max(linear.row - every + 1, 3), min(linear.row + every, last + every), max(every // 5, 1))
        unit = Effect(effect.kind, effect.quantity, 1.0, capacity=effect.capacity)
        rows = np.minimum(rows, self._evidence.shape[0] - 1)
        finer = self._best({_sign(linear.mode): linear.mode}, rows, self._responses.steps(unit, rows))
        return finer if finer.score > linear.score else linear

    def _polished(self, found: Sequence[_Linear]) -> Iterator[Estimate]:
        """Replayed at sizes around the linear one; the best of each."""
        if not found:
            return
        sets = [(*self._beside, self._state(each, factor)) for each in found for factor in SIZES]
        scores = self._evidence.likelihoods(sets).reshape(len(found), -1)
        for each, own in zip(found, scores, strict=True):
            rows = np.array([each.row])
            mean, spread = (float(v[0]) for v in self._prior.of_size(each.mode, rows))
            sizes = each.size * np.array(SIZES)
            own = own - 0.5 * ((sizes - mean) / spread) ** 2 + self._prior.of_mode(each.mode)
            k = int(np.argmax(own))
            yield Estimate(self._state(each, SIZES[k]), each.sd, float(own[k]))

    def _state(self, linear: _Linear, factor: float) -> FaultState:
        sign = _sign(linear.mode) or 1.0
        onset_s = self._evidence.window.start_s + linear.row
        return FaultState(linear.mode.name, sign * linear.size * factor, onset_s)


def _sign(mode: FaultMode) -> float:
    """Direction of a mode that has one; 0 where its severity has a sign of its own."""
    return 0.0 if mode.unknown or mode.effect is None else float(np.sign(mode.effect.per_unit))
