"""The most probable explanation alone: what an agent believes that knows no doubt."""

from __future__ import annotations

from dataclasses import replace

from homeostat.agents.roles import Monitoring
from homeostat.domain.diagnosis import Diagnosis, Hypothesis, Symptom, by_fault_set
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Resolution
from homeostat.plants.plant import Plant


class MostProbable:
    """Implements :class:`homeostat.agents.roles.Monitoring` over another one, of whose hypotheses one is kept.

    Studies use it to see what it is worth that a proposal must hold for every plausible hypothesis.
    """

    def __init__(self, monitoring: Monitoring) -> None:
        """``monitoring`` watches and diagnoses."""
        self._monitoring = monitoring

    def notices(self, snapshot: Snapshot) -> bool:
        """As the monitoring behind it."""
        return self._monitoring.notices(snapshot)

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """Those of the monitoring behind it."""
        return self._monitoring.symptoms

    def diagnose(self, deviates: bool = False) -> Diagnosis:
        """The most probable set of faults, each of its most probable size, as if it were certain."""
        diagnosis = self._monitoring.diagnose(deviates)
        kept = tuple(Hypothesis(fault_set.faults, 1.0) for fault_set in by_fault_set(diagnosis.hypotheses)[:1])
        return replace(diagnosis, hypotheses=kept)

    def follow(self, outcome: Resolution) -> None:
        """As the monitoring behind it."""
        self._monitoring.follow(outcome)


def without_ensemble(plant: Plant) -> Plant:
    """``plant`` with a twin that knows the expected parameters only."""
    return replace(plant, twin=replace(plant.twin, judged_draws=1, draws=1, search_draws=1))
