"""Memory: what was said before is not forgotten without a reason, and none of it sooner than the rest.

Faults do not mend themselves: an explanation that keeps what was known needs no coincidence, and one without it needs
one. Otherwise a fault would be forgotten as soon as it cannot be seen, as fouling without feed. Where several
hypotheses were left, each is remembered, as much less likely as it was.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultMode, FaultState, Hypothesis, by_fault_set
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.claims import MOST_NATS, Claims
from homeostat.twin.isolation.course import continues
from homeostat.twin.isolation.prior import Prior, Size
from homeostat.twin.isolation.search import Scored
from homeostat.twin.isolation.sizes import SizeError

REPAIRED_NATS = 5.0
"""What an explanation loses for each fault that was known and that it has no place for."""

LEAST_SHARE = 0.01
"""Standard deviation of a size of before at least, as a share of the range that it may have [1]."""


@dataclass(frozen=True, slots=True)
class Remembered:
    """One hypothesis of before."""

    faults: FaultSet
    """What it assumed."""
    old: FaultSet
    """What of it began before the readings that are looked at."""
    nats: float
    """How much less likely it was than what was most likely [nats], not positive."""


def remembered(known: FaultSet, before: Sequence[Hypothesis], first_s: float, divisor: float) -> tuple[Remembered, ...]:
    """What is remembered: what was ``known``, and what else was said ``before``, the likeliest first.

    Differences were made smaller by the ``divisor`` when they were said, and will be again: as they were, they would
    come nearer to each other with every look, although nothing was seen.

    What began from ``first_s`` on [s] is seen again, with all that speaks for it, and competes as everything else does.
    """
    said = {h.name: h for h in by_fault_set(before) if h.faults and h.faults[0].fault != SOMETHING_ELSE}
    most = max((h.probability for h in said.values()), default=1.0)
    nats = {name: divisor * math.log(h.probability / most) for name, h in said.items()}
    found = [Remembered(h.faults, _old(h.faults, first_s), nats[name]) for name, h in said.items()]
    if known and Hypothesis(known, 1.0).name not in said:
        found.insert(0, Remembered(known, _old(known, first_s), 0.0))
    nothing = sum(h.probability for h in before if not h.faults)
    if found and nothing > 0.0:  # that nothing was wrong was likely, too, and costs no repair
        found.append(Remembered((), (), divisor * math.log(nothing / most)))
    return tuple(found) or (Remembered((), (), 0.0),)


def sizes(
    known: FaultSet, before: Sequence[Hypothesis], first_s: float, modes: Mapping[str, FaultMode], error: SizeError
) -> Mapping[str, Size]:
    """Fault -> what is known of its size, of what was ``known`` or said ``before`` to be older than ``first_s``.

    Hypotheses of one name span what the readings left open; the ``error`` of the model is added. Of an unknown one that
    may be of any size now, the typical size is as far as it may be from what it was.
    """
    said: dict[str, list[tuple[float, float]]] = {f.fault: [(f.severity, 0.0)] for f in _old(known, first_s)}
    for each in sorted(before, key=lambda h: -h.probability):
        for fault in () if each.something_else else _old(each.faults, first_s):
            said.setdefault(fault.fault, []).append((fault.severity, each.probability))
    return {name: _size(modes[name], of, error) for name, of in said.items()}


def _size(mode: FaultMode, said: Sequence[tuple[float, float]], error: SizeError) -> Size:
    likeliest, typical = said[0][0], mode.severity_nominal
    if mode.effect is not None:
        return Size(likeliest, abs(typical))
    every, weights = np.array(said).T
    left_open = float(np.average((every - likeliest) ** 2, weights=weights)) if weights.sum() else 0.0
    sd = float(np.hypot(error.of(likeliest, typical), left_open**0.5))
    return Size(likeliest, max(sd, LEAST_SHARE * mode.severity_range.span))


class Memory:
    """What explanations gain by agreeing with what is remembered."""

    def __init__(
        self,
        hypotheses: Sequence[Remembered],
        modes: Mapping[str, FaultMode],
        prior: Prior,
        end_s: float,
        claims: Claims,
    ) -> None:
        """``end_s``: process time of the last reading [s]; ``claims`` are about the time before the first one."""
        self._hypotheses, self._modes, self._prior, self._end_s = hypotheses, modes, prior, end_s
        self._claims = claims
        self._unearned = [self._of_rivals(each) for each in hypotheses]

    def told(self, scored: Sequence[Scored]) -> list[Scored]:
        """``scored``, of which each gains by what it keeps, and loses by what it drops, of the nearest hypothesis.

        What is near the best is charged for what it claims of the time before.
        """
        found = [replace(s, score=s.score + self._most_gain(s.faults)) for s in scored]
        near = max((s.score for s in found), default=0.0) - MOST_NATS
        for s in sorted((s for s in found if s.score > near), key=lambda s: -s.score):
            self._claims.of(s.faults)  # what it costs is asked at the best size of each
        return [replace(s, score=s.score - self._claims.of(s.faults)) if s.score > near else s for s in found]

    def _most_gain(self, faults: FaultSet) -> float:
        each = zip(self._hypotheses, self._unearned, strict=True)
        return max(h.nats - unearned + sum(self._of(known, faults) for known in h.old) for h, unearned in each)

    def _of_rivals(self, hypothesis: Remembered) -> float:
        """What ``hypothesis`` must pay because a rival that was about as likely pays it [nats].

        A rival that began in the readings pays for its fault again. Both explained what was read before them, so that
        little of it spoke for what began earlier, and which side of the first reading each began on says nothing.
        """
        paid = self._paid(hypothesis)
        rivals = [self._paid(other) - max(hypothesis.nats - other.nats, 0.0) for other in self._hypotheses]
        return max(0.0, *(rival - paid for rival in rivals))

    def _paid(self, hypothesis: Remembered) -> float:
        """What the faults of ``hypothesis`` cost that began in the readings [nats]."""
        young = [fault for fault in hypothesis.faults if fault not in hypothesis.old]
        return -sum(self._prior.of_mode(self._modes[fault.fault]) for fault in young)

    def _of(self, known: FaultState, faults: FaultSet) -> float:
        """What an explanation gains by keeping a ``known`` fault, or loses by dropping it [nats].

        It is kept where it began nearer to when it was thought to than to now, and where what grew has stopped.
        """
        began = min((f.onset_s for f in faults if continues(f, known, self._modes)), default=np.inf)
        if began <= 0.5 * (known.onset_s + self._end_s):
            return -self._prior.of_mode(self._modes[known.fault])
        return -REPAIRED_NATS


def _old(faults: FaultSet, first_s: float) -> FaultSet:
    return tuple(f for f in faults if f.onset_s < first_s)
