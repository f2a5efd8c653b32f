"""Conditions: how the agents of a run are asked, and what they are told."""

import math
from dataclasses import dataclass, replace

from homeostat.agents.roles import AskingProtocol, Monitoring
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis, Symptom, by_fault_set, with_a_twin
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import FallbackNeeded, Resolution
from homeostat.journal import Setting
from homeostat.plants.plant import Plant


@dataclass(frozen=True, slots=True)
class Conditions:
    """What a study varies besides the scenario."""

    protocol: AskingProtocol = AskingProtocol.ROUTE
    """When proposers are asked, and for how much."""
    label_given: bool = False
    """Whether agents are told faults from their onset on, as in studies without detection."""
    reprompting: bool = True
    """Whether a proposer may try again after a refusal."""
    ensemble: bool = True
    """Whether a proposal must hold for every plausible fault and parameter set, or for the most probable one only.

    What is released carries no certificate then: it was rolled out once."""
    label: tuple[FaultState, ...] | None = None
    """Faults that agents are told where a label is given, true or not; the true ones where None."""

    @property
    def settings(self) -> tuple[Setting, ...]:
        """As the journal has them."""
        return (
            Setting("protocol", self.protocol.value),
            Setting("label_given", int(self.label_given)),
            Setting("reprompting", int(self.reprompting)),
            Setting("ensemble", int(self.ensemble)),
        )


class LabelGiven:
    """Implements :class:`homeostat.agents.roles.Monitoring` over another one, with a label for a diagnosis.

    Only studies use it: those that compare with published ones, which tell the truth, and those that tell a falsehood.
    """

    def __init__(self, monitoring: Monitoring, faults: tuple[FaultState, ...], review_s: float) -> None:
        """``monitoring`` goes on watching; ``faults`` are those that are told, each from its onset on.

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
        """What the label says is there now."""
        self._told = self._present
        self._review_at_s = math.inf
        hypotheses = (Hypothesis(self._told, 1.0),) if self._told else ()
        return Diagnosis(self._at_s, self.symptoms, hypotheses)

    def follow(self, outcome: Resolution) -> None:
        """Schedule the next review; after the fallback there is none."""
        fell_back = isinstance(outcome, FallbackNeeded)
        self._review_at_s = math.inf if fell_back or not self._told else self._at_s + self._review_s

    @property
    def _present(self) -> tuple[FaultState, ...]:
        return tuple(f for f in self._faults if f.onset_s <= self._at_s)


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
        kept = tuple(
            Hypothesis(fault_set.faults, 1.0) for fault_set in by_fault_set(with_a_twin(diagnosis.hypotheses))[:1]
        )
        return replace(diagnosis, hypotheses=kept)

    def follow(self, outcome: Resolution) -> None:
        """As the monitoring behind it."""
        self._monitoring.follow(outcome)


def without_ensemble(plant: Plant) -> Plant:
    """``plant`` with a twin that knows the expected parameters only, and nothing that draws others before a release."""
    return replace(
        plant,
        twin=replace(plant.twin, judged_draws=1, draws=1, search_draws=1),
        risk=replace(plant.risk, most=0),
    )
