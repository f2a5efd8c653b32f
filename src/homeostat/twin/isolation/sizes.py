"""Sizes: between what the true size of a fault lies, by the readings and by how far the model may be trusted.

From the best size outwards every one is replayed, with the onset that suits it, until it explains the readings worse
by what two standard deviations cost: a size that readings do not depend on may be any. What a size was before anything
was seen has no part in it. The error of the model is added: a true plant that is not its model is explained best by
another size than its own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.evidence import Evidence
from homeostat.twin.isolation.responses import FIRST_ROW

DEVIATIONS = 2.0
"""An interval reaches so many standard deviations to either side [1]."""
FIRST = 0.005
"""First step away from the best size, as a share of it or of the range that a size may have [1]."""
STEPS = 9
"""Steps to either side, each twice as far away as the one before."""
AGES = (-0.3, -0.12, -0.04, 0.0, 0.04, 0.12, 0.3)
"""Onsets that are tried with each size, as shares of how long ago it was [1]."""
MOST = 6
"""Names whose sizes are worked out, the most probable ones."""


@dataclass(frozen=True, slots=True)
class SizeError:
    """How far the true size may be from the one that explains the readings best, standard deviations."""

    relative: float
    """As a share of the size [1]."""
    least: float
    """As a share of what is typical of the fault [1]."""

    def of(self, size: float, typical: float) -> float:
        """Standard deviation of the true size from ``size``, in its unit; ``typical``: what is typical of the fault."""
        return float(np.hypot(self.relative * size, self.least * typical))

    def widened(self, low: float, size: float, high: float, typical: float) -> tuple[float, float]:
        """The interval from ``low`` to ``high`` about ``size``, with this error besides, all in one unit."""
        error = DEVIATIONS * self.of(size, typical)
        return size - float(np.hypot(size - low, error)), size + float(np.hypot(high - size, error))


@dataclass(slots=True)
class _Side:
    """The way from the best size of one fault to one side."""

    replayed: FaultSet
    """What explains the readings: the fault, or the changes that come to it."""
    size: float
    """Its best size, in its unit."""
    end: float
    """The size that it can have at most on this side."""
    first: float
    """The first step, with its sign."""
    age: float = 1.0
    """Multiple of its age with which the last size was best."""
    tried: list[tuple[float, float]] = field(default_factory=list)
    """Distance from the best size, and what is explained worse than by the best [nats]."""
    over: bool = False
    """Whether the edge was passed."""

    def next_size(self) -> float:
        """The size that is tried next."""
        step = self.first * 2.0 ** len(self.tried)
        size = self.size + step
        return min(size, self.end) if step > 0.0 else max(size, self.end)


def stated(
    hypotheses: Sequence[Hypothesis],
    replayed: Mapping[FaultSet, FaultSet],
    evidence: Evidence,
    error: SizeError,
    divisor: float,
) -> tuple[Hypothesis, ...]:
    """``hypotheses``, each of one fault with between what its true size lies.

    ``replayed``: what was replayed where that is more than the faults; ``divisor``: by how much smaller differences of
    explanations count than those of their log-likelihoods [1].
    """
    modes = evidence.carrier.modes
    leaders: dict[str, Hypothesis] = {}
    for each in sorted(hypotheses, key=lambda h: -h.probability):
        sized = len(each.faults) == 1 and each.faults[0].severity and not each.something_else
        if sized and not modes[each.name].sizeless:
            leaders.setdefault(each.name, each)
    chosen = list(leaders.values())[:MOST]
    nats = 0.5 * DEVIATIONS**2 * divisor
    found = dict[str, tuple[float, float]]()
    for one, edges in zip(chosen, _edges(evidence, chosen, replayed, nats), strict=True):
        mode, size = modes[one.name], one.faults[0].severity
        low, high = error.widened(edges[0], size, edges[1], mode.severity_nominal)
        allowed = mode.severity_range
        found[one.name] = min(max(low, allowed.low), size), max(min(high, allowed.high), size)
    return tuple(replace(h, between=found.get(h.name)) for h in hypotheses)


def _edges(
    evidence: Evidence, chosen: Sequence[Hypothesis], replayed: Mapping[FaultSet, FaultSet], nats: float
) -> Iterator[tuple[float, float]]:
    """Between what each of ``chosen`` explains the readings worse than at its best by no more than ``nats``."""
    sides = [side for one in chosen for side in _sides(evidence, one, replayed.get(one.faults, one.faults))]
    best = np.repeat(evidence.likelihoods([side.replayed for side in sides[::2]]), 2) if sides else np.empty(0)
    top = best.copy()
    for _ in range(STEPS):
        going = [k for k, side in enumerate(sides) if not side.over]
        if not going:
            break
        sets = [_sets(evidence, sides[k]) for k in going]
        every = evidence.likelihoods([faults for many in sets for _, faults in many])
        scores_of = np.split(every, np.cumsum([len(many) for many in sets])[:-1])
        for k, tried, scores in zip(going, sets, scores_of, strict=True):
            side, likeliest = sides[k], int(np.argmax(scores))
            size, side.age = side.next_size(), tried[likeliest][0]
            pair = slice(k - k % 2, k - k % 2 + 2)
            top[pair] = np.maximum(top[pair], scores[likeliest])
            side.tried.append((size - side.size, float(scores[likeliest])))
            side.over = bool(top[k] - scores[likeliest] > nats) or size == side.end
    for k in range(0, len(sides), 2):
        low, high = (_edge(sides[j], float(best[k]), float(top[k]), nats) for j in (k, k + 1))
        yield sides[k].size + low, sides[k].size + high


def _sides(evidence: Evidence, one: Hypothesis, replayed: FaultSet) -> tuple[_Side, _Side]:
    mode, size = evidence.carrier.modes[one.name], one.faults[0].severity
    allowed = mode.severity_range
    first = FIRST * max(abs(size), allowed.span if mode.effect is None else 0.0)
    return _Side(replayed, size, min(allowed.low, size), -first), _Side(replayed, size, max(allowed.high, size), first)


def _sets(evidence: Evidence, side: _Side) -> list[tuple[float, FaultSet]]:
    """What is replayed for the next size of ``side``: with what multiple of its age, and the faults."""
    factor, age = side.next_size() / side.size, side.age
    sized = tuple(replace(f, severity=f.severity * factor) for f in side.replayed)
    first_s, end_s = evidence.window.at_s(FIRST_ROW), evidence.window.end_s
    if len(sized) > 1 or sized[0].onset_s < first_s:
        return [(age, sized)]
    found: dict[FaultState, float] = {}
    for more in AGES:
        onset = end_s - (end_s - sized[0].onset_s) * age * (1.0 + more)
        latest_s = end_s - evidence.window.tick_s
        found.setdefault(replace(sized[0], onset_s=float(np.clip(onset, first_s, latest_s))), age * (1.0 + more))
    return [(multiple, (state,)) for state, multiple in found.items()]


def _edge(side: _Side, best: float, top: float, nats: float) -> float:
    """How far from the best size the edge is, where what is explained worse has come to ``nats``.

    What is explained worse grows with the square of the distance, so its root is taken to be straight between two sizes
    that were tried. The best size need not be the likeliest one: it had a prior.
    """
    worse = [(0.0, top - best), *((distance, top - score) for distance, score in side.tried)]
    inside = max((k for k, (_, loss) in enumerate(worse) if loss <= nats), default=0)
    (near, less), (far, more) = worse[inside], worse[min(inside + 1, len(worse) - 1)]
    if not less <= nats < more:
        return near
    lower, root, upper = np.sqrt(max(less, 0.0)), np.sqrt(nats), np.sqrt(more)
    return near + float((root - lower) / (upper - lower)) * (far - near) if np.isfinite(upper) else near
