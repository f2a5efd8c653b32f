"""Wiring: from a case and a plant to a supervisor with its crew and its gate."""

from __future__ import annotations

from homeostat.agents.action import SearchAction
from homeostat.agents.crew import Crew, Proposer
from homeostat.agents.grounding import Grounding
from homeostat.agents.monitoring import Monitoring
from homeostat.agents.planning import SearchPlanning
from homeostat.agents.rehearsal import TwinRehearsal
from homeostat.agents.reprompting import MarginReprompting
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.assurance.gate import Gate
from homeostat.cases.case import Case
from homeostat.domain.plant_description import ComponentKind, PlantDescription
from homeostat.domain.ports import Clock, Plant
from homeostat.supervisor import Budget, Supervisor
from homeostat.trace import Trace
from homeostat.trace.archive import Archive
from homeostat.twin.twin import Twin


def modules_of_faults(description: PlantDescription) -> dict[str, str]:
    """Fault -> module that its component is in."""
    parent = {c.name: c.part_of for c in description.components}
    kind = {c.name: c.kind for c in description.components}
    found: dict[str, str] = {}
    for fault in description.faults:
        part: str | None = fault.component
        while part is not None and kind[part] is not ComponentKind.MODULE:
            part = parent[part]
        found[fault.name] = part or description.name
    return found


def search_proposer(case: Case, twin: Twin, grounding: Grounding) -> Proposer:
    """The deterministic proposer that is always there."""
    d = case.description
    action = SearchAction(twin, d.limits, d.tags_by_name, case.production, d.scales)
    return Proposer("search", SearchPlanning(d.machine, grounding), action)


def wire(
    case: Case, plant: Plant, clock: Clock, trace: Trace, seed: int, budget: Budget | None = None,
    archive: Archive | None = None,
) -> Supervisor:  # fmt: skip
    """A supervisor for ``plant``; ``seed`` seeds the twin's draws and is the run's.

    ``archive`` keeps what the graph was asked and answered.
    """
    d = case.description
    twin = Twin(case.model, d, case.twin, seed)
    tags = d.tags_by_name
    grounding = Grounding(case.graph, case.namespace, modules_of_faults(d), archive)
    rehearsal = TwinRehearsal(twin, d.limits, tags)
    crew = Crew(
        monitoring=Monitoring(twin, grounding, d, case.baselines, case.started),
        proposers=(search_proposer(case, twin, grounding),),
        simulation=TwinSimulation(twin, tags),
        validation=LimitValidation(d.limits, tags),
        reprompting=MarginReprompting(d.scales),
        grounding=grounding,
    )
    gate = Gate(plant, d.limits, d.fallback_strategies[0], rehearsal)
    return Supervisor(
        plant,
        clock,
        crew,
        gate,
        rehearsal,
        d.machine,
        d.limits,
        case.production,
        d.fallback_strategies,
        budget or Budget(),
        trace,
    )
