"""The label given: agents are told which faults are there, as in studies that have no detection."""

from __future__ import annotations

import math

from homeostat.agents.roles import Monitoring
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis, Symptom
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import FallbackNeeded, Resolution


class LabelGiven:
    """Implements :class:`homeostat.agents.roles.Monitoring` over another one, with the truth for a diagnosis.

    Only studies that compare with published ones use it: a plant has nobody to tell the truth.
    """

    def __init__(self, monitoring: Monitoring, faults: tuple[FaultState, ...], review_s: float) -> None:
        """``monitoring`` goes on watching; ``faults`` are those that are truly there, each from its onset on.

        ``review_s``: after anything was done or left alone, when the situation is judged again [s]. A label does not
        say when a fault that grows begins to matter.
        """
        self._monitoring = monitoring
        self._faults = faults
        self._review_s = review_s
        self._told: tuple[FaultState, ...] = ()
        self._at_s = 0.0
        self._review_at_s = math.inf

    def notices(self, snapshot: Snapshot) -> bool:
        """Take one more snapshot; whether a fault began since the last diagnosis, or a review is due."""
        self._monitoring.notices(snapshot)
        self._at_s = snapshot.at_s
        return self._present != self._told or self._at_s >= self._review_at_s

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """Those of the monitoring behind it."""
        return self._monitoring.symptoms

    def diagnose(self, deviates: bool = False) -> Diagnosis:
        """What is truly there now."""
        self._told = self._present
        self._review_at_s = math.inf
        hypotheses = (Hypothesis(self._told, 1.0),) if self._told else ()
        return Diagnosis(self._at_s, self.symptoms, hypotheses)

    def follow(self, outcome: Resolution) -> None:
        """Schedule the next review; after the fallback there is none."""
        handed_over = isinstance(outcome, FallbackNeeded)
        self._review_at_s = math.inf if handed_over or not self._told else self._at_s + self._review_s

    @property
    def _present(self) -> tuple[FaultState, ...]:
        return tuple(f for f in self._faults if f.onset_s <= self._at_s)
