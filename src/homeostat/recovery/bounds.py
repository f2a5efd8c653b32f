"""Bounds of a recovery: how long it may take, and how eagerly a plant is improved that may also be left alone."""

import math
from dataclasses import dataclass, replace
from typing import Final, Self

PATIENCE: Final = 5.0
"""Ticks that may pass while somebody thinks, where these are more than the usual seconds [1]."""
LONGEST_S: Final = 600.0
"""No thinking is longer than this because a plant is looked at rarely [s]."""


@dataclass(frozen=True, slots=True)
class Budget:
    """What a recovery may take."""

    latency_s: float = 30.0
    """Longest thinking [s]; the time that physics leaves may be shorter."""
    reserve_s: float = 5.0
    """Process time that is kept for the fallback to act [s]."""
    last_s: float = 4.0
    """Wall-clock time that is kept for a thorough proposer which is asked after others, and for the waits that are
    tried after all of them: both answer in less [s]."""
    diagnosis_s: float = 30.0
    """Longest diagnosis; after it nothing counts as known [s]."""
    arming_s: float = 30.0
    """Longest look at what happens without action, and at each fallback [s]."""
    check_s: float = 30.0
    """Longest release check [s]."""
    answer_s: float = 60.0
    """Longest wait for the guard to write a request and to read it back [s]."""
    person_s: float = 600.0
    """Longest wait for a person's yes, where one is needed [s]."""

    @property
    def longest_s(self) -> float:
        """Longest thinking between two looks at the guard [s]."""
        return self.diagnosis_s + self.arming_s + self.latency_s + self.check_s

    def for_ticks(self, tick_s: float) -> Self:
        """The same for a plant that is sampled every ``tick_s`` [s].

        What the guard does takes ticks. Where nothing new is seen for a minute, what is known now is worth some
        minutes of thinking; where readings come each second, it is not. Times that somebody chose are kept.
        """
        factor, patience_s = max(tick_s, 1.0), min(PATIENCE * tick_s, LONGEST_S)

        def longer(name: str) -> float:
            chosen: float = getattr(self, name)
            return max(chosen, patience_s) if chosen == getattr(Budget(), name) else chosen

        return replace(
            self,
            latency_s=longer("latency_s"),
            diagnosis_s=longer("diagnosis_s"),
            arming_s=longer("arming_s"),
            check_s=longer("check_s"),
            reserve_s=self.reserve_s * tick_s,
            answer_s=self.answer_s * factor,
            person_s=self.person_s * factor,
        )


@dataclass(frozen=True, slots=True)
class InterventionBounds:
    """How eagerly a plant is improved that may also be left alone, and how far it may deviate from its prediction."""

    calm_s: float = 300.0
    """Nothing is improved while the last release is younger than this: its transient is still under way [s]."""
    improvements: int = 6
    """Most proposals of an improvement."""
    slack_s: float = math.inf
    """A step this far outside the times that were predicted for it calls for attention; infinite for none [s]."""
    stray: float = math.inf
    """A hard limit's margin this much less than any predicted calls for attention, in scales; infinite for none [1]."""
    stray_s: float = 30.0
    """The time over which both are averaged; between two such calls twice as long, and longer each time [s]."""
    repeat_s: float = 20.0
    """Between two calls because of a step [s]."""
    back_s: float = 60.0
    """After the way back to ordinary operation was asked for in vain, when it is asked for again [s]."""
    probes: int = 2
    """Most test moves and waits before nothing is wrong any more; 0 for none."""
    probe_s: float = 300.0
    """How long one lasts before the plant is looked at again [s]."""
    waits: int = 6
    """Most waits instead of a release before nothing is wrong any more, each by how much of it lasted; 0 for none."""
    answer_s: float = 30.0
    """After one that must not go on, the time that thinking is given before a fallback ends it [s]."""


@dataclass(frozen=True, slots=True)
class RiskBounds:
    """How sure the last check before a release must be that no hard limit is violated."""

    required: float = 0.01
    """Largest probability of a violation that is released, as far as twin and hypotheses are true [1]."""
    level: float = 0.95
    """Confidence with which it is to be bounded, shared by all checks within :attr:`shared_s` [1]."""
    most: int = 1024
    """Most rollouts of one check; what they do not decide is refused. 0: nothing is drawn, and nothing certified."""
    batch: int = 128
    """Rollouts after which is looked whether they suffice."""
    listed: int = 64
    """Rollouts by which everything that could be done instead is compared; 0 for none."""
    shared_s: float = 900.0
    """Process time within which checks that are in vain share the error [s]."""
