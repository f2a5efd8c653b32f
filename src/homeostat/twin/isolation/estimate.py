"""Estimate: of what size, and since when, each disturbance would explain the readings best.

For a response u and residuals r the size is b = (u'Wr + t m/s^2) / (u'Wu + t/s^2) with W = I - D (I + D'D)^-1 D', the
temper t of the evidence, and b ~ N(m, s^2) before anything is seen. What is found by that linear pass is replayed at
sizes around it, because a model is not linear.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from homeostat.domain.diagnosis import Effect, EffectKind, FaultMode, FaultState
from homeostat.process.types import Indices, Table, Vec
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.evidence import TEMPER, Evidence
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.responses import FIRST_ROW, Responses

SHORTLIST = 4
"""Onsets of one disturbance whose bounded loss is worked out."""
CHANGED_NATS = 3.0
"""By how much a change must explain more than that it has always been so [nats]."""
POLISHED = 10
"""Disturbances that are replayed."""
SIZES = (0.6, 0.75, 0.87, 0.94, 1.0, 1.06, 1.15, 1.35, 1.7)
"""Sizes that are replayed, as multiples of the linear estimate [1]."""
LEADERS = 5
"""Disturbances that are replayed at sizes and onsets between those, because a coarse size costs many nats."""
CLIMB, CLIMBS = 1.5, 8
"""Factor by which a change of a parameter is larger or smaller while that explains more, and how often at most: an
actuator that takes ten times as long is far from what a linear pass says of it [1]."""
FINER = (((-8, -4, -2, -1, 0, 1, 2, 4, 8), 0.06), ((-1, 0, 1), 0.02), ((0,), 0.007))
"""Ticks and share of its size by which each of them is moved, again and again."""
NEARBY = (-16, -8, -3, 0, 3, 8, 16)
"""Ticks by which an onset may be another one where a size is."""
TWO_SD_NATS = 2.0
"""What a size costs that is two standard deviations away from the best [nats]."""
GROSS_BEFORE = (1, 4, 9, 16, 30, 60)
"""Ticks before the first symptom at which parameters are tried as other than a linear pass can tell."""
GROSS = (-1.5, -0.7, 0.5, 1.2, 3.0, 7.0)
"""Their sizes, as multiples of a large one [1]."""


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

    def estimates(self, since_s: float = np.inf) -> list[Estimate]:
        """The likeliest disturbances, each at its best, the best first; ``since_s``: when the first symptom was [s]."""
        found: list[_Linear] = []
        for group in self._groups.values():
            effect = group[0].effect
            assert effect is not None
            found += self._of_group(effect, group)
        found.sort(key=lambda each: -each.score)
        found = [self._refined(each) for each in found[:POLISHED] if each.size != 0.0]
        polished = sorted(self._polished([*found, *self._gross(since_s)]), key=lambda e: -e.score)
        settled = self._narrowed(self._settled(self._climbed(polished[:LEADERS])))
        return sorted([*settled, *polished], key=lambda e: -e.score)

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
                found.append(self._best(lasting, newest, self._responses.of_newest(unit, steps)))
        if growing:
            found.append(self._best(growing, rows, self._responses.ramps(steps)))
        yield from (each for each in found if each.score > always + CHANGED_NATS)

    def _best(self, modes: Mapping[float, FaultMode], rows: Indices, change: Table) -> _Linear:
        any_mode = next(iter(modes.values()))
        effect = any_mode.effect
        assert effect is not None
        mean, spread = self._prior.of_size(any_mode, rows)
        along = change @ self._evidence.directions
        gain = np.einsum("ij,ij->i", change, change) - np.einsum("ij,ij->i", along @ self._evidence.inner, along)
        precision = np.maximum(gain, 0.0) / TEMPER + 1.0 / spread**2
        size = (change @ self._freed / TEMPER + mean / spread**2) / precision
        if 0.0 not in modes:
            size = np.where(np.isin(np.sign(size), list(modes)), size, 0.0)
        size = np.clip(size, -effect.most, effect.most)
        hopeful = np.argsort(-(size**2 * precision))[:SHORTLIST]
        loss, _ = self._evidence.losses(self._residual - size[hopeful, None] * change[hopeful])
        score = -0.5 * loss / TEMPER - self._prior.cost_of_size(any_mode, size[hopeful], rows[hopeful])
        k = int(np.argmax(score))
        best = int(hopeful[k])
        mode = modes.get(0.0) or modes[float(np.sign(size[best])) or next(iter(modes))]
        total = float(score[k]) + self._prior.of_mode(mode)
        return _Linear(mode, int(rows[best]), float(size[best]), float(precision[best] ** -0.5), total)

    def _refined(self, linear: _Linear) -> _Linear:
        """The same with its onset between those that are tried over the whole window; what grows has no sharp one."""
        effect = linear.mode.effect
        every = self._responses.every
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
        tried = [(each.mode, each.size * np.array(SIZES), np.full(len(SIZES), each.row)) for each in found]
        for each, (_, sizes, _), scores in zip(found, tried, self._scores(tried), strict=True):
            k = int(np.argmax(scores))
            yield Estimate(self._as_state(each.mode, float(sizes[k]), each.row), each.sd, float(scores[k]))

    def _gross(self, since_s: float) -> list[_Linear]:
        """The best of each parameter that is far from what it was, replayed: no linear pass finds when that began."""
        window = self._evidence.window
        onsets = [(since_s - window.start_s) / window.tick_s - lag for lag in GROSS_BEFORE]
        rows = sorted({round(row) for row in onsets if FIRST_ROW <= row < self._evidence.shape[0] - 1})
        groups = [group for (kind, _), group in self._groups.items() if kind is EffectKind.PARAMETER]
        modes = [mode for group in groups for mode in group if mode.unknown and mode.effect and not mode.effect.grows]
        tried = [(m, row, size * m.severity_nominal) for m in modes for row in rows for size in GROSS]
        best: dict[str, _Linear] = {}
        scores = self._scores([(m, np.array([size]), np.array([row])) for m, row, size in tried])
        for (mode, row, size), score in zip(tried, scores, strict=True):
            if mode.name not in best or score[0] > best[mode.name].score:
                best[mode.name] = _Linear(mode, row, size, 0.25 * abs(size), float(score[0]))
        return list(best.values())

    def _scores(self, tried: Sequence[tuple[FaultMode, Vec, Indices]]) -> list[Vec]:
        """Log posteriors of each mode at each of its sizes and rows, replayed, all in one call."""
        if not tried:
            return []
        sets = [
            (*self._beside, self._as_state(mode, size, row))
            for mode, sizes, rows in tried
            for size, row in zip(sizes.tolist(), rows.tolist(), strict=True)
        ]
        nats = iter(np.split(self._evidence.likelihoods(sets), np.cumsum([len(v) for _, v, _ in tried])[:-1]))
        return [
            next(nats) - self._prior.cost_of_size(mode, sizes, rows) + self._prior.of_mode(mode)
            for mode, sizes, rows in tried
        ]

    def _climbed(self, leaders: Sequence[Estimate]) -> list[Estimate]:
        """``leaders`` with parameters that differ by more, or by less, as long as that explains more."""
        found, climbing = list(leaders), [k for k, each in enumerate(leaders) if self._is_of_parameter(each)]
        for _ in range(CLIMBS):
            tried = [self._around(found[k], (-3, 0, 3), (1.0 / CLIMB, CLIMB)) for k in climbing]
            higher = []
            for k, (mode, sizes, rows), scores in zip(climbing, tried, self._scores(tried), strict=True):
                best = int(np.argmax(scores))
                if scores[best] > found[k].score:
                    size = float(sizes[best])
                    state = self._as_state(mode, size, int(rows[best]))
                    found[k] = Estimate(state, max(found[k].sd, 0.25 * abs(size)), float(scores[best]))
                    higher.append(k)
            climbing = higher
        return found

    def _is_of_parameter(self, each: Estimate) -> bool:
        effect = self._evidence.carrier.modes[each.state.fault].effect
        return effect is not None and effect.kind is EffectKind.PARAMETER

    def _settled(self, leaders: Sequence[Estimate]) -> list[Estimate]:
        """``leaders`` at sizes and onsets that lie closer and closer together."""
        found = list(leaders)
        for ticks, share in FINER if found else ():
            tried = [self._around(each, ticks, (1.0 - share, 1.0, 1.0 + share)) for each in found]
            for k, ((_, sizes, rows), scores) in enumerate(zip(tried, self._scores(tried), strict=True)):
                best = int(np.argmax(scores))
                if scores[best] > found[k].score:
                    state = self._as_state(tried[k][0], float(sizes[best]), int(rows[best]))
                    found[k] = Estimate(state, found[k].sd, float(scores[best]))
        return found

    def _narrowed(self, leaders: Sequence[Estimate]) -> list[Estimate]:
        """``leaders``, each no less certain of its size than replays at two standard deviations to either side say.

        A linear pass far from where it was made says little of that, and none was made of what is gross.
        """
        tried = []
        for each in leaders:
            mode, row = self._mode_and_row(each)
            rows = np.clip([row + s for s in NEARBY], FIRST_ROW, self._evidence.shape[0] - 1)
            sizes = (_sign(mode) or 1.0) * np.array([each.state.severity + k * each.sd for k in (-2.0, 2.0)])
            tried.append((mode, np.repeat(sizes, len(rows)), np.tile(rows, 2)))
        found = []
        for each, scores in zip(leaders, self._scores(tried), strict=True):
            if not np.isfinite(each.score):  # it breaks the twin itself, and nothing beside it says how certain it is
                found.append(each)
                continue
            lost = np.maximum(each.score - scores.reshape(2, -1).max(axis=1), 1e-9)
            found.append(replace(each, sd=each.sd * min(1.0, float(np.sqrt(TWO_SD_NATS / lost.min())))))
        return found

    def _mode_and_row(self, each: Estimate) -> tuple[FaultMode, int]:
        mode = self._evidence.carrier.modes[each.state.fault]
        return mode, self._evidence.window.row(each.state.onset_s)

    def _around(self, each: Estimate, ticks: Sequence[int], factors: Sequence[float]) -> tuple[FaultMode, Vec, Indices]:
        mode, row = self._mode_and_row(each)
        rows = np.unique(np.clip([row + s for s in ticks], FIRST_ROW, self._evidence.shape[0] - 1))
        signed = each.state.severity * (_sign(mode) or 1.0)
        sizes = signed * np.array(factors)
        return mode, np.tile(sizes, len(rows)), np.repeat(rows, len(sizes))

    def _as_state(self, mode: FaultMode, size: float, row: int) -> FaultState:
        return FaultState(mode.name, (_sign(mode) or 1.0) * size, self._evidence.window.at_s(row))


def _sign(mode: FaultMode) -> float:
    """Direction of a mode that has one; 0 where its severity has a sign of its own."""
    if mode.effect is None or mode.severity_range.low < 0.0:
        return 0.0
    return float(np.sign(mode.effect.per_unit))
