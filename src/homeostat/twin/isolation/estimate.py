"""Estimate: of what size, and since when, each disturbance would explain the readings best.

What a linear pass finds is replayed at sizes around it, because a model is not linear.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from homeostat.domain.diagnosis import SIZELESS, Effect, EffectKind, FaultMode, FaultState
from homeostat.process.types import Vec
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.evidence import Evidence
from homeostat.twin.isolation.linear import Linear, LinearPass, Turns, direction
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.responses import FIRST_ROW, Responses

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
SWINGING = 4
"""Of what swings so many are replayed, where"""
REPLAYED_NATS = 6.0
"""they explain no less than this below the best that does not [nats]."""
AMPLITUDES, SHIFT = (0.8, 1.0, 1.25), 1.0 / 24.0
"""Multiples of its size, and the share of a turn by which it is moved to either side,"""
PERIODS = (0.94, 0.97, 1.0, 1.03, 1.06)
"""and multiples of its period with which what swings is replayed at first [1]."""
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


class Estimation:
    """Estimates every generated fault mode beside a fault set."""

    def __init__(self, evidence: Evidence, modes: Sequence[FaultMode], prior: Prior, beside: FaultSet) -> None:
        """``modes`` are those with an effect on what is compared."""
        self._evidence, self._prior, self._beside = evidence, prior, beside
        self._responses = Responses(evidence, beside)
        self._groups: dict[tuple[EffectKind, str], list[FaultMode]] = {}
        for mode in modes:
            if mode.effect is not None and mode.effect.kind not in SIZELESS:
                self._groups.setdefault((mode.effect.kind, mode.effect.quantity), []).append(mode)
        self._pass = LinearPass(evidence, prior, evidence.residuals([beside])[0])
        self._turns = Turns.of(self._responses.rows, self._responses.every, evidence.shape[0])

    def estimates(self, since_s: float = np.inf) -> list[Estimate]:
        """The likeliest disturbances, each at its best, the best first; ``since_s``: when the first symptom was [s]."""
        found: list[Linear] = []
        for group in self._groups.values():
            effect = group[0].effect
            assert effect is not None
            found += self._of_group(effect, group)
        found.sort(key=lambda each: -each.score)
        swinging = [each for each in found if each.period_s]
        found = [each for each in found if not each.period_s]
        least = found[0].score - REPLAYED_NATS if found else -np.inf
        found = [self._refined(each) for each in found[:POLISHED] if each.size != 0.0]
        polished = sorted(self._polished([*found, *self._gross(since_s)]), key=lambda e: -e.score)
        swings = self._swinging(_of_each_item([each for each in swinging if each.score > least]))
        polished = sorted([*polished, *swings], key=_worse)
        settled = self._narrowed(self._settled(self._climbed(polished[:LEADERS])))
        return sorted([*settled, *polished], key=_worse)

    def _of_group(self, effect: Effect, group: Sequence[FaultMode]) -> Iterator[Linear]:
        """The best step, the best ramp and the best swing of modes that act on the same quantity.

        None where the quantity may as well have differed from the beginning of the window on: that is how the plant is.
        """
        unit = Effect(effect.kind, effect.quantity, 1.0, capacity=effect.capacity)
        responses, rows, newest = self._responses.steps(unit), self._responses.rows, self._responses.newest
        steps = self._pass.steps(responses)
        acting = [(direction(mode), mode, mode.effect) for mode in group if mode.effect is not None]
        lasting = {sign: mode for sign, mode, effect in acting if effect.lasts}
        growing = {sign: mode for sign, mode, effect in acting if effect.grows}
        swinging = [mode for _, mode, effect in acting if effect.swings]
        found: list[Linear] = []
        always = -np.inf
        if lasting:
            always = self._pass.best(lasting, rows[:1], steps, self._responses.once(0)).score
            found.append(self._pass.best(lasting, rows, steps))
            if len(newest):
                late = self._pass.steps(self._responses.of_newest(unit, responses))
                found.append(self._pass.best(lasting, newest, late))
        if growing:
            found.append(self._pass.best(growing, rows, steps, self._responses.ramps))
        for mode in swinging:
            swing = self._pass.swing(mode, self._turns, steps)
            found += [] if swing is None else [swing]
        yield from (each for each in found if each.score > always + CHANGED_NATS)

    def _refined(self, linear: Linear) -> Linear:
        """The same with its onset between those that are tried over the whole window; what grows has no sharp one."""
        effect, every = linear.mode.effect, self._responses.every
        if effect is None or effect.grows or every == 1:
            return linear
        last = int(self._responses.rows[-1])
        rows = np.arange(max(linear.row - every + 1, 3), min(linear.row + every, last + every), max(every // 5, 1))
        unit = Effect(effect.kind, effect.quantity, 1.0, capacity=effect.capacity)
        rows = np.minimum(rows, self._evidence.shape[0] - 1)
        steps = self._pass.steps(self._responses.steps(unit, rows))
        finer = self._pass.best({direction(linear.mode): linear.mode}, rows, steps)
        return finer if finer.score > linear.score else linear

    def _polished(self, found: Sequence[Linear]) -> Iterator[Estimate]:
        """Replayed at sizes around the linear one; the best of each."""
        tried = [[self._as_state(each, size=each.size * share) for share in SIZES] for each in found]
        for each, states, scores in zip(found, tried, self._scores(tried), strict=True):
            k = int(np.argmax(scores))
            yield Estimate(states[k], each.sd, float(scores[k]))

    def _swinging(self, found: Sequence[Linear]) -> list[Estimate]:
        """The best of what swings, replayed with other periods, at other moments of a turn, and since a turn before.

        A linear pass leaves the state in which a window begins as it is, and what swung by then made that another one.
        """
        begun = [Estimate(self._as_state(each), each.sd, -np.inf) for each in found[:SWINGING]]
        tried = []
        for each in begun:
            turn = round(each.state.period_s / self._evidence.window.tick_s)
            near = [k * round(turn * SHIFT) for k in (-1, 0, 1)]
            tried.append(self._around(each, [*near, *(k - turn for k in near)], AMPLITUDES, PERIODS))
        return self._better(begun, tried)

    def _gross(self, since_s: float) -> list[Linear]:
        """The best of each parameter that is far from what it was, replayed: no linear pass finds when that began."""
        window = self._evidence.window
        onsets = [(since_s - window.start_s) / window.tick_s - lag for lag in GROSS_BEFORE]
        rows = sorted({round(row) for row in onsets if FIRST_ROW <= row < self._evidence.shape[0] - 1})
        groups = [group for (kind, _), group in self._groups.items() if kind is EffectKind.PARAMETER]
        modes = [mode for group in groups for mode in group if mode.unknown and mode.effect and mode.effect.lasts]
        sizes = [(m, row, size * m.severity_nominal) for m in modes for row in rows for size in GROSS]
        tried = [Linear(m, row, size, 0.25 * abs(size), 0.0) for m, row, size in sizes]
        best: dict[str, Linear] = {}
        for each, score in zip(tried, self._scores([[self._as_state(each)] for each in tried]), strict=True):
            if each.mode.name not in best or score[0] > best[each.mode.name].score:
                best[each.mode.name] = replace(each, score=float(score[0]))
        return list(best.values())

    def _scores(self, tried: Sequence[Sequence[FaultState]]) -> list[Vec]:
        """Log posteriors of the states of each mode, replayed, all in one call."""
        if not tried:
            return []
        sets = [(*self._beside, state) for states in tried for state in states]
        nats = np.split(self._evidence.likelihoods(sets), np.cumsum([len(states) for states in tried])[:-1])
        return [own + self._prior_of(states) for own, states in zip(nats, tried, strict=True)]

    def _prior_of(self, states: Sequence[FaultState]) -> Vec:
        """Log prior of ``states`` of one mode [nats], shape (states,)."""
        mode, window = self._mode(states[0]), self._evidence.window
        sizes = (direction(mode) or 1.0) * np.array([state.severity for state in states])
        rows = np.clip([window.row(state.onset_s) for state in states], 0, window.length - 2)
        return self._prior.of_mode(mode) - self._prior.cost_of_size(mode, sizes, rows)

    def _climbed(self, leaders: Sequence[Estimate]) -> list[Estimate]:
        """``leaders`` with parameters that differ by more, or by less, as long as that explains more."""
        found, climbing = list(leaders), [k for k, each in enumerate(leaders) if self._is_of_parameter(each)]
        for _ in range(CLIMBS):
            now = [found[k] for k in climbing]
            higher = self._better(now, [self._around(each, (-3, 0, 3), (1.0 / CLIMB, CLIMB)) for each in now])
            moved = [(k, each) for k, each in zip(climbing, higher, strict=True) if each is not found[k]]
            for k, each in moved:
                found[k] = replace(each, sd=max(each.sd, 0.25 * abs(each.state.severity)))
            climbing = [k for k, _ in moved]
        return found

    def _is_of_parameter(self, each: Estimate) -> bool:
        effect = self._mode(each.state).effect
        return effect is not None and effect.kind is EffectKind.PARAMETER and not effect.swings

    def _settled(self, leaders: Sequence[Estimate]) -> list[Estimate]:
        """``leaders`` at sizes and onsets that lie closer and closer together."""
        found = list(leaders)
        for ticks, share in FINER:
            near = 1.0 - share, 1.0, 1.0 + share
            found = self._better(found, [self._around(each, ticks, near, _finer(share)) for each in found])
        return found

    def _better(self, found: Sequence[Estimate], tried: Sequence[Sequence[FaultState]]) -> list[Estimate]:
        """``found``, each as the best of the states that are ``tried`` for it where that is better."""
        best = list(found)
        for k, (states, scores) in enumerate(zip(tried, self._scores(tried), strict=True)):
            likeliest = int(np.argmax(scores))
            if scores[likeliest] > found[k].score:
                best[k] = Estimate(states[likeliest], found[k].sd, float(scores[likeliest]))
        return best

    def _narrowed(self, leaders: Sequence[Estimate]) -> list[Estimate]:
        """``leaders``, each no less certain of its size than replays at two standard deviations to either side say.

        A linear pass far from where it was made says little of that, and none was made of what is gross.
        """
        tried = []
        for each in leaders:
            near = [replace(each.state, onset_s=at_s) for at_s in self._onsets(each.state, NEARBY, once=False)]
            sizes = [each.state.severity + k * each.sd for k in (-2.0, 2.0)]
            tried.append([replace(state, severity=size) for size in sizes for state in near])
        found = []
        for each, scores in zip(leaders, self._scores(tried), strict=True):
            if not np.isfinite(each.score):  # it breaks the twin itself, and nothing beside it says how certain it is
                found.append(each)
                continue
            lost = np.maximum(each.score - scores.reshape(2, -1).max(axis=1), 1e-9)
            found.append(replace(each, sd=each.sd * min(1.0, float(np.sqrt(TWO_SD_NATS / lost.min())))))
        return found

    def _around(
        self, each: Estimate, ticks: Sequence[int], factors: Sequence[float], periods: Sequence[float] = (1.0,)
    ) -> list[FaultState]:
        """States with onsets so many ``ticks`` away, sizes by ``factors``, and periods too of what swings."""
        state = each.state
        turns = [state.period_s * share for share in periods] if state.period_s else [0.0]
        return [
            replace(state, severity=state.severity * factor, onset_s=at_s, period_s=period_s)
            for at_s in self._onsets(state, ticks)
            for factor in factors
            for period_s in turns
        ]

    def _onsets(self, state: FaultState, ticks: Sequence[int], once: bool = True) -> list[float]:
        """So many ``ticks`` from the onset of ``state``, in the window; what swings may have begun before it [s]."""
        window = self._evidence.window
        first = FIRST_ROW - math.ceil(state.period_s / window.tick_s)
        rows = np.clip([window.row(state.onset_s) + k for k in ticks], first, self._evidence.shape[0] - 1)
        return [window.at_s(row) for row in (np.unique(rows) if once else rows).tolist()]

    def _mode(self, state: FaultState) -> FaultMode:
        return self._evidence.carrier.modes[state.fault]

    def _as_state(self, each: Linear, size: float | None = None) -> FaultState:
        """``each``, or one of another signed ``size``, as a state."""
        severity = (direction(each.mode) or 1.0) * (each.size if size is None else size)
        return FaultState(each.mode.name, severity, self._evidence.window.at_s(each.row), each.period_s)


def _of_each_item(found: Sequence[Linear]) -> list[Linear]:
    """``found``, the best first, with the best of each item before the others: linear scores of swings are rough."""
    first: dict[str, Linear] = {}
    for each in found:
        first.setdefault(each.mode.component, each)
    return [*first.values(), *(each for each in found if first[each.mode.component] is not each)]


def _finer(share: float) -> tuple[float, ...]:
    """Multiples of a period beside what is moved by a ``share`` of its size [1]."""
    return 1.0 - 0.3 * share, 1.0, 1.0 + 0.3 * share


def _worse(each: Estimate) -> float:
    return -each.score
