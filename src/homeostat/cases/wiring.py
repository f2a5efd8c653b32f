"""Wiring: from a case and a plant to a supervisor with its crew and its gate."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from homeostat.agents.action import SearchAction
from homeostat.agents.bounds import Budget
from homeostat.agents.candidates import design_commands
from homeostat.agents.crew import AskingProtocol, Crew, Proposer, Simulation
from homeostat.agents.crew import Monitoring as MonitoringRole
from homeostat.agents.documents import excerpts
from homeostat.agents.excerpts import GroundingKind
from homeostat.agents.grounding import Grounding
from homeostat.agents.language.proposer import language_proposer, step_proposer
from homeostat.agents.monitoring import Monitoring
from homeostat.agents.planning import EVENT, SearchPlanning
from homeostat.agents.reprompting import MarginReprompting
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.cases.case import Case
from homeostat.cases.error import CaseError
from homeostat.domain.plant_description import PlantDescription
from homeostat.domain.ports import Clock, Plant
from homeostat.domain.recovery import Command, FallbackStrategy
from homeostat.guard.gate import Gate
from homeostat.guard.sequencer import Sequencer, nominal_route, what_follows
from homeostat.llm.address import KEY_VARIABLES
from homeostat.llm.model import LanguageModel
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.secrets import Secrets
from homeostat.recovery.release_check import TwinReleaseCheck
from homeostat.recovery.supervisor import Supervisor
from homeostat.trace import Trace
from homeostat.trace.archive import Archive, NoArchive
from homeostat.twin.twin import Twin


@dataclass(frozen=True, slots=True)
class Language:
    """A language model that proposes before the search does."""

    model: LanguageModel
    """Who is asked; its calls go to the run's trace."""
    notes: tuple[str, ...] = ()
    """What operators wrote."""
    file: Path | None = None
    """File that every call is added to; None for none."""
    grounding: GroundingKind = GroundingKind.GRAPH
    """What its prompts show of the plant."""

    def proposer(
        self, case: Case, grounding: Grounding, simulation: Simulation, trace: Trace, archive: Archive,
        protocol: AskingProtocol = AskingProtocol.ROUTE,
    ) -> Proposer:  # fmt: skip
        """The proposer; whatever keys the environment holds are struck out of what it records."""
        secrets = tuple(value for name in KEY_VARIABLES if (value := os.environ.get(name)))
        recorded = RecordedModel(self.model, trace, archive, secrets, self.file)
        d = case.description
        notes = tuple(map(Secrets(secrets).strike, self.notes))  # before a prompt cuts them: half a key is not found
        propose = step_proposer if protocol is AskingProtocol.PER_STEP else language_proposer
        shown = excerpts(self.grounding, grounding, case.graph, case.namespace)
        return propose(recorded, d, grounding, simulation, case.production, notes, shown)


@dataclass(frozen=True, slots=True)
class Workbench:
    """What proposers of a case are made from."""

    case: Case
    """The plant."""
    twin: Twin
    """Its twin, which monitoring keeps up to date."""
    grounding: Grounding
    """Asks its graph."""
    simulation: Simulation
    """Tries on the twin."""
    trace: Trace
    """Takes the calls of models."""
    archive: Archive
    """Keeps what models were asked and answered."""
    protocol: AskingProtocol
    """When proposers are asked, and for how much."""
    language: Language | None
    """The language model of the run; None for none."""

    def searching(self) -> Proposer:
        """The deterministic proposer that is always there."""
        d = self.case.description
        action = SearchAction(self.twin, d.limits, d.tags_by_name, self.case.production, d.scales)
        return Proposer(
            "search", SearchPlanning(d, self.grounding), action, MarginReprompting(d.scales), improves=True
        )  # fmt: skip

    def speaking(self) -> Proposer:
        """The language model's proposer; AssertionError in a run without one."""
        assert self.language is not None, "the run has no language model"
        return self.language.proposer(
            self.case, self.grounding, self.simulation, self.trace, self.archive, self.protocol
        )  # fmt: skip


Propose = Callable[[Workbench], tuple[Proposer, ...]]
"""Makes the proposers of a run, in the order in which they are asked."""


def in_operation(bench: Workbench) -> tuple[Proposer, ...]:
    """As a plant is operated: the language model first where there is one, and the search after it."""
    return (bench.searching(),) if bench.language is None else (bench.speaking(), bench.searching())


def new_sequencer(case: Case, protocol: AskingProtocol = AskingProtocol.ROUTE) -> Sequencer:
    """The sequencer of ``case`` before its first sample, with the nominal route unless every step is asked for."""
    d = case.description
    nominal = nominal_route(d.machine, _by_design(d)) if protocol is AskingProtocol.ROUTE else ()
    return Sequencer(d.machine, d.limits, nominal)


def check_protocol(case: Case, protocol: AskingProtocol) -> None:
    """CaseError where every step is to be asked for, but nothing leads from the initial state to where one may end."""
    machine = case.description.machine
    start = machine.initial.name
    if protocol is AskingProtocol.PER_STEP and not machine.paths(start, {}, EVENT, blocked=()):
        raise CaseError(
            f"{case.name} cannot be asked for step by step: from {start!r} no path leads to where a recovery may end; "
            "leave --protocol per-step to batches"
        )


def fallbacks(case: Case) -> tuple[FallbackStrategy, ...]:
    """The fallback strategies of ``case``, each with the steps that follow from its state by themselves."""
    d = case.description
    commands = _by_design(d)
    return tuple(
        replace(s, actions=replace(s.actions, then=what_follows(d.machine, s.actions.target, commands)))
        for s in d.fallback_strategies
    )


def _by_design(plant: PlantDescription) -> dict[str, tuple[Command, ...]]:
    """State -> what it is commanded by design."""
    return {state.name: design_commands(state, plant.tags_by_name) for state in plant.machine.states}


def wire(
    case: Case, plant: Plant, sequencer: Sequencer, clock: Clock, trace: Trace, seed: int,
    budget: Budget | None = None, archive: Archive | None = None, language: Language | None = None,
    protocol: AskingProtocol = AskingProtocol.ROUTE, given: Callable[[MonitoringRole], MonitoringRole] | None = None,
    propose: Propose = in_operation,
) -> Supervisor:  # fmt: skip
    """A supervisor for ``plant``; ``seed`` seeds the twin's draws and is the run's.

    ``sequencer`` is the one that ``plant`` asks after each snapshot.

    ``archive`` keeps what graph and models were asked and answered; ``language`` proposes first where it is given.
    ``given`` puts another monitoring in front of the case's, for studies that take the diagnosis from elsewhere;
    ``propose`` makes other proposers than those of operation, for studies that compare them.
    """
    d = case.description
    twin = Twin(case.model, d, case.twin, seed)
    tags = d.tags_by_name
    archive = archive or NoArchive()
    grounding = Grounding(case.graph, case.namespace, archive)
    rehearsal = TwinReleaseCheck(twin, d.limits, tags)
    simulation = TwinSimulation(twin, tags, d.limits)
    bench = Workbench(case, twin, grounding, simulation, trace, archive, protocol, language)
    monitoring = Monitoring(twin, grounding, d, case.baselines, case.started, case.monitoring)
    crew = Crew(
        monitoring=given(monitoring) if given else monitoring,
        proposers=propose(bench),
        simulation=simulation,
        validation=LimitValidation(d.limits, tags),
        grounding=grounding,
    )
    strategies = fallbacks(case)
    gate = Gate(plant, d.limits, strategies[0], rehearsal, sequencer)
    return Supervisor(
        plant, clock, crew, gate, rehearsal, sequencer, d.machine, d.limits, case.production, strategies,
        d.scales, case.patience, budget or Budget(), trace, protocol is AskingProtocol.PER_STEP,
    )  # fmt: skip
