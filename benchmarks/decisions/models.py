"""A scripted model in the language model's seat beside the search: what the run costs, and what it contributed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from benchmarks.decisions.measure import Decision, outside_s
from benchmarks.decisions.seats import Script, careless
from benchmarks.unknown.causes import Cause
from homeostat.agents.language.proposer import NAME
from homeostat.agents.language.scripts import careful
from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Compared, Probed, ReleasedActions, Waited
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate import runner
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.reference.unsupervised import fault_free
from homeostat.evaluate.scenario import Fault, Scenario, departing, scenario_of
from homeostat.evaluate.score.costs import run_cost
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.llm.scripted import ScriptedModel
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Language
from homeostat.record.run_record import RunRecord

ALONE = "search"
"""The arm without a model."""
SEATS: Mapping[str, Script | None] = {
    ALONE: None,
    "careful": careful,
    "careless": careless,
}
"""Arm -> who sits in the language model's seat; None for nobody."""


@dataclass(frozen=True, slots=True)
class Seated:
    """What one run came to with one arm."""

    fault: str
    severity: float
    onset_s: float
    seed: int
    outcome: str
    cost: float | None
    """Points of the design production from detection on; None where nothing was detected."""
    outside_s: float
    """Seconds outside a hard limit from detection on [s]."""
    asked: int
    """Questions to the model."""
    done: dict[str, int]
    """Kind of alternative -> how often it was done as the model's own."""
    bettered: int
    """Of these, releases whose numbers the search had bettered."""


class Seat:
    """Measures runs with one arm."""

    def __init__(self, arm: str, known: Callable[[], Iterable[Decision]] = tuple) -> None:
        """``arm``: one of :data:`SEATS`; ``known``: runs of the search alone that another part has carried out."""
        self._arm, self._script, self._known = arm, SEATS[arm], known

    def measure(self, plant: Plant, cause: Cause, seed: int, mismatch: str, end_s: float | None = None) -> Seated:
        """Run a fault of the tables until ``end_s`` [s]; thinking costs one second."""
        (state,) = cause.faults
        if self._script is None and end_s is None:
            for one in self._known():
                if (one.fault, one.seed) == (state.fault, seed):
                    return _taken_over(one)
        told = scenario_of(plant, [Fault(state.fault, state.severity, state.onset_s)], seed, end_s)
        model = None if self._script is None else ScriptedModel(self._arm, self._script)
        proposing = Proposing(language=None if model is None else Language(model))
        return seated(plant, departing(plant, told, (), mismatch), proposing, model)


def _taken_over(one: Decision) -> Seated:
    told = one.fault, one.severity, one.onset_s, one.seed, one.outcome, one.cost, one.outside_s
    return Seated(*told, asked=0, done={}, bettered=0)


def seated(plant: Plant, chosen: Scenario, proposing: Proposing, model: ScriptedModel | None) -> Seated:
    """What the run of ``chosen`` came to, in which ``model`` is the one that ``proposing`` asks."""
    run = runner.run(plant, chosen, MemoryTrace(), DeclaredClock(1.0), proposing)
    (fault,) = chosen.faults
    done, bettered = contributed(run.record)
    return Seated(
        fault.fault,
        fault.severity,
        fault.onset_s,
        chosen.seed,
        run.outcome.value,
        points(plant, chosen, run.truth, run.record, run.detected_s),
        0.0 if run.detected_s is None else outside_s(run.truth, run.force, run.detected_s),
        0 if model is None else len(model.asked),
        done,
        bettered,
    )


def points(
    plant: Plant, chosen: Scenario, truth: Trajectory, record: RunRecord, detected_s: float | None
) -> float | None:
    """What a run cost from a second after detection on, as everywhere in this study; None without detection."""
    if detected_s is None:
        return None
    from_s, healthy = math.ceil(detected_s) + 1.0, fault_free(plant, chosen).truth
    return 100.0 * run_cost(plant, truth, healthy, from_s, record.states, len(record.released)).share


def contributed(record: RunRecord) -> tuple[dict[str, int], int]:
    """Kind -> how often it was done as the model's own; of how many of these the search had bettered the numbers."""
    done: Counter[str] = Counter()
    bettered, listed = 0, Compared("", (), "")
    for event in (entry.event for entry in record.entries):
        match event:
            case Compared():
                listed = event
            case Waited(proposer=proposer) if proposer == NAME:
                done[AlternativeKind.WAIT.value] += 1
            case Probed(proposer=proposer) if proposer == NAME:
                done[AlternativeKind.TEST.value] += 1
            case ReleasedActions(proposer=proposer) if proposer == NAME:
                found = [a for a in listed.alternatives if a.digest == event.digest]
                if any(a.kind is AlternativeKind.TEST for a in found):
                    continue  # it is told as a test as well
                done[(AlternativeKind.HOLD if event.for_s else AlternativeKind.RELEASE).value] += 1
                bettered += any(a.polished for a in found)
    return dict(done), bettered


def compared(alone: Sequence[Seated], arm: Sequence[Seated]) -> list[tuple[Seated, float]]:
    """The runs of ``arm`` that are in for the search alone as well, each with how many points more it cost."""
    known = {(one.fault, one.seed): one.cost for one in alone}
    found = []
    for one in arm:
        before = known.get((one.fault, one.seed))
        if one.cost is not None and before is not None:
            found.append((one, one.cost - before))
    return found
