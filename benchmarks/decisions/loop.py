"""A run on the simulated plant with a stated first diagnosis: what a scenario alone cannot bring about at a moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.decisions.measure import outside_s
from benchmarks.decisions.models import contributed, points
from homeostat.agents.roles import Monitoring
from homeostat.domain.diagnosis import Diagnosis, Hypothesis, Symptom
from homeostat.domain.observation import Observation
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Resolution
from homeostat.evaluate.local_control import LocalControl, Told
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.outcome import limits_of
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Arrangement, Language, wire
from homeostat.record.run_record import RunRecord
from homeostat.recovery.bounds import Budget


class FromThenOn:
    """Implements :class:`homeostat.agents.roles.Monitoring` over another one: says a stated thing once, at a moment."""

    def __init__(self, monitoring: Monitoring, hypotheses: tuple[Hypothesis, ...], at_s: float) -> None:
        """``monitoring`` goes on watching, and alone from the first diagnosis on; nothing is told before ``at_s``."""
        self._monitoring, self._hypotheses, self._at_s = monitoring, hypotheses, at_s
        self._now_s, self._told = 0.0, False

    def notices(self, snapshot: Snapshot) -> bool:
        """Take one more snapshot; whether something needs to be explained now."""
        noticed, self._now_s = self._monitoring.notices(snapshot), snapshot.at_s
        return noticed if self._told else self._now_s >= self._at_s

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """Those of the monitoring behind it."""
        return self._monitoring.symptoms

    def diagnose(self, deviates: bool = False) -> Diagnosis:
        """What is stated, the first time; then what the monitoring behind it says."""
        if self._told:
            return self._monitoring.diagnose(deviates)
        self._told = True
        return Diagnosis(self._now_s, self.symptoms, self._hypotheses)

    def follow(self, outcome: Resolution) -> None:
        """As the monitoring behind it."""
        self._monitoring.follow(outcome)


@dataclass(frozen=True, slots=True)
class Operated:
    """What such a run came to."""

    points: float | None
    """Points of the design production from detection on; None where nothing was detected."""
    done: dict[str, int]
    """Kind of alternative -> how often it was done as the model's own."""
    outside_s: float
    """Seconds outside a hard limit from detection on [s]."""


def operated(
    plant: Plant,
    chosen: Scenario,
    given: Callable[[Monitoring], Monitoring],
    model: ScriptedModel | None,
    budget: Budget,
) -> Operated:
    """Run ``chosen`` as it is operated, with what is ``given`` in front of the plant's monitoring."""
    trace, record = MemoryTrace(), RunRecord()
    trace.subscribe(record)
    process = open_process(plant, chosen)
    local = LocalControl(plant, True, lambda: link.leased)
    link = SimulatedLink(process, LinkConfiguration(recipe_by=plant.recipe), local.sample)
    language = None if model is None else Language(model)
    arrangement = Arrangement(budget=budget, language=language, given=given)
    assembly = wire(plant, link, DeclaredClock(1.0), trace, chosen.seed, arrangement)

    def hook(seen: Observation) -> None:
        local.tell(Told(seen.state, seen.latched is not None, assembly.guard.carries))

    assembly.run(link.source, hook)
    truth, onset_s = process.truth(), chosen.onset_s or 0.0
    reports = [at_s for at_s, _ in record.diagnosed if at_s >= onset_s]
    detected_s = min((*reports, *record.tripped_s), default=None)
    outside = 0.0 if detected_s is None else outside_s(truth, limits_of(plant, record, truth), detected_s)
    return Operated(points(plant, chosen, truth, record, detected_s), contributed(record)[0], outside)
