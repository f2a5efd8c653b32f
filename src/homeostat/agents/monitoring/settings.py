"""How long monitoring waits before it speaks."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MonitoringSettings:
    """How long monitoring waits before it speaks; all times in process seconds."""

    settle_s: float = 500.0
    """After the plant has reached normal operation, before features are judged [s]."""
    centre_s: float = 600.0
    """Healthy stretch from which this plant's own means and parameters are learned [s]."""
    adapt_s: float = math.inf
    """Time in which what is learned of a plant follows what it shows while nothing is known to be wrong; infinite for
    never [s]."""
    sure: float = 0.75
    """Probability from which an explanation needs no more evidence [1]."""
    evidence_s: float = 6.0
    """How long to gather evidence while the explanation is unsure [s]."""
    again_s: float = math.inf
    """While evidence is gathered, how soon it is looked at again; infinite for not before the end [s]."""
    transient_s: float = 120.0
    """After a release, the time in which new symptoms are expected [s]."""
    review_s: float = 600.0
    """After a release or a decision to leave the plant alone, when the situation is judged again [s]."""
    repeat_s: float = 30.0
    """After symptoms that nothing explains, when they are looked at again; each time twice as late [s]."""
