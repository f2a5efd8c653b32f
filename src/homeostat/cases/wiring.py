"""Wiring: from a case and a plant to a supervisor with its crew and its gate."""

from __future__ import annotations

from homeostat.agents.action import SearchAction
from homeostat.agents.crew import Crew, Proposer
from homeostat.agents.monitoring import Monitoring
from homeostat.agents.planning import SearchPlanning
from homeostat.agents.rehearsal import TwinRehearsal
from homeostat.agents.reprompting import MarginReprompting
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.assurance.gate import Gate
from homeostat.cases.case import Case
from homeostat.domain.ports import Clock, Plant
from homeostat.supervisor import Budget, Supervisor
from homeostat.trace import Trace
from homeostat.twin.twin import Twin


def search_proposer(case: Case, twin: Twin) -> Proposer:
    """The deterministic proposer that is always there."""
    d = case.description
    action = SearchAction(twin, d.limits, d.tags_by_name, case.production, d.scales)
    return Proposer("search", SearchPlanning(d.machine, d.faults), action)


def wire(case: Case, plant: Plant, clock: Clock, trace: Trace, seed: int, budget: Budget | None = None) -> Supervisor:
    """A supervisor for ``plant``; ``seed`` seeds the twin's draws and is the run's."""
    d = case.description
    twin = Twin(case.model, d, case.twin, seed)
    tags = d.tags_by_name
    rehearsal = TwinRehearsal(twin, d.limits, tags)
    crew = Crew(
        monitoring=Monitoring(twin, d, case.baselines, case.started),
        proposers=(search_proposer(case, twin),),
        simulation=TwinSimulation(twin, tags),
        validation=LimitValidation(d.limits, tags),
        reprompting=MarginReprompting(d.scales),
    )
    gate = Gate(plant, d.limits, d.fallback_strategies[0], rehearsal)
    return Supervisor(
        plant, clock, crew, gate, rehearsal, d.machine, d.limits, case.production, d.fallback_strategies,
        budget or Budget(), trace,
    )
