"""Assembly: from a plant and a plant's lease to a guard, and recovery in a thread beside it."""

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from homeostat.agents.grounding.context import GroundingKind
from homeostat.agents.grounding.documents import context_finder
from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.language.proposer import language_proposer, step_proposer
from homeostat.agents.language.speaker import MOST_S, Briefing
from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.agents.playbook.book import Book
from homeostat.agents.playbook.proposer import remembering
from homeostat.agents.pricing import Pricing
from homeostat.agents.probing.twin_probing import TwinProbing
from homeostat.agents.roles import Agents, AskingProtocol, Monitoring, Proposer, Simulation
from homeostat.agents.search.action import SearchAction, SearchSettings
from homeostat.agents.search.planning import SearchPlanning
from homeostat.agents.search.reprompting import MarginReprompting
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Message, Settled, Trouble
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.plant.timing import TICK_S
from homeostat.domain.ports import Clock, Lease, Source
from homeostat.domain.recovery import FallbackStrategy, Step
from homeostat.guard.guard import Guard
from homeostat.guard.parts import Attachment
from homeostat.guard.requests.seal import Sealer, new_key
from homeostat.guard.restart.memory import Memory
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Trace
from homeostat.journal.beside.archive import Archive, MemoryArchive
from homeostat.links.clock import WALL_LIMIT_S
from homeostat.llm.address import KEY_VARIABLES
from homeostat.llm.model import LanguageModel
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.secrets import Secrets
from homeostat.plants.error import PlantError
from homeostat.plants.plant import Plant
from homeostat.plants.wired.guarding import ISSUER, Guarded, by_design, fallback_strategies, rules_of
from homeostat.recovery.bounds import Budget
from homeostat.recovery.exchange.exchange import Exchange, ExchangeSettings
from homeostat.recovery.exchange.loop import Hook, Loop
from homeostat.recovery.exchange.pacing import Pacing
from homeostat.recovery.exchange.worker import Worker
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.release_check import ReleaseCheck
from homeostat.recovery.supervisor import RecoveryLoop
from homeostat.twin.twin import Twin


@dataclass(frozen=True, slots=True)
class Language:
    """A language model that proposes beside the search."""

    model: LanguageModel
    """Who is asked; its calls go to the run's trace."""
    notes: tuple[str, ...] = ()
    """What operators wrote."""
    file: Path | None = None
    """File that every call is added to; None for none."""
    grounding: GroundingKind = GroundingKind.GRAPH
    """What its prompts show of the plant."""
    answer_s: float | None = None
    """Longest time for one answer, wall-clock [s]; None for 20 s, or 600 s where what thinking costs is declared."""
    attempts: int | None = None
    """Most proposals in one recovery; None for as many as usual."""


@dataclass(frozen=True, slots=True)
class Workbench:
    """What proposers of a plant are made from."""

    plant: Plant
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
    hurried: bool = True
    """Whether thinking costs as much process time as it takes."""
    playbook: Book | None = None
    """What was released before; None where nobody is to know."""

    def search(self) -> SearchAction:
        """A search of its own, which begins with what the playbook has, too."""
        d = self.plant.description
        pricing = Pricing(self.plant.prices, d.limits, d.scales)
        settings = None if self.playbook is None else SearchSettings(known=self.playbook.starts)
        return SearchAction(self.twin, d, pricing, settings)

    def remembering(self) -> tuple[Proposer, ...]:
        """The playbook's proposer; none in a run without one."""
        return () if self.playbook is None else (remembering(self.playbook),)

    def searching(self) -> Proposer:
        """The deterministic proposer that is always there."""
        d, action = self.plant.description, self.search()
        planning = SearchPlanning(d, self.grounding, action.bounds)
        reprompting = MarginReprompting(d.scales, action.margins)
        return Proposer("search", planning, action, reprompting, improves=True, thorough=True)

    def speaking(self) -> Proposer:
        """The language model's proposer, which records no key; AssertionError in a run without one."""
        plant, language = self.plant, self.language
        assert language is not None, "the run has no language model"
        secrets = tuple(value for name in KEY_VARIABLES if (value := os.environ.get(name)))
        briefing = Briefing(
            model=RecordedModel(language.model, self.trace, self.archive, secrets, language.file),
            plant=plant.description,
            prices=plant.prices,
            grounding=self.grounding,
            context=context_finder(language.grounding, self.grounding, plant.graph, plant.namespace),
            simulation=self.simulation,
            notes=tuple(map(Secrets(secrets).strike, language.notes)),  # before prompts cut them to half a key
            answer_s=language.answer_s or (MOST_S if self.hurried else WALL_LIMIT_S),
            hurried=self.hurried,
        )
        make = step_proposer if self.protocol is AskingProtocol.PER_STEP else language_proposer
        return make(briefing, language.attempts)


Propose = Callable[[Workbench], tuple[Proposer, ...]]
"""Makes the proposers of a run, in the order in which they are asked."""


def in_operation(bench: Workbench) -> tuple[Proposer, ...]:
    """As a plant is operated: the playbook answers first, then the search; a language model may do better than both.

    Where every step is asked for, as in published studies, the language model is asked first.
    """
    first = bench.remembering()
    if bench.language is None:
        return (*first, bench.searching())
    both = bench.searching(), bench.speaking()
    return (*first, *(both[::-1] if bench.protocol is AskingProtocol.PER_STEP else both))


def model_alone(bench: Workbench) -> tuple[Proposer, ...]:
    """The language model alone, for studies of it: beside a search it wins only where that finds less."""
    return (bench.speaking(),)


def new_sequencer(plant: Plant) -> Sequencer:
    """The sequencer of ``plant`` before its first sample, with the nominal route: its recipe by design."""
    return Sequencer(plant.description.machine, plant.description.limits, nominal(plant))


def nominal(plant: Plant, protocol: AskingProtocol = AskingProtocol.ROUTE) -> tuple[Step, ...]:
    """What follows from the initial state by itself; nothing where every step is asked for."""
    return by_design(plant.description) if protocol is AskingProtocol.ROUTE else ()


def check_protocol(plant: Guarded, protocol: AskingProtocol) -> None:
    """PlantError where every step is to be asked for, but nothing leads from the initial state to an end."""
    machine = plant.description.machine
    start, event = machine.initial.name, machine.recovery_event
    ways = machine.paths(start, {}, event, blocked=()) if protocol is AskingProtocol.PER_STEP else ()
    if protocol is AskingProtocol.PER_STEP and not any(machine.is_end(way[-1].target, event) for way in ways):
        raise PlantError(
            f"{plant.name} cannot be asked for step by step: from {start!r} no path leads to an end; "
            "leave --protocol per-step to batches"
        )


def fallbacks(plant: Plant) -> tuple[FallbackStrategy, ...]:
    """The fallback strategies of ``plant``, each with the steps that follow from its state by themselves."""
    return fallback_strategies(plant.description)


ANSWERS = 4.0
"""Where an answer is cut off only because it hangs, recovery is given up after the time of so many of them [1]: one
more than there are between two looks at the plant."""
BUSY_S = 600.0
"""Longest that recovery may hold a plant that stands while it thinks, beyond what it may take, wall-clock [s]."""
END_S = 5.0
"""Longest wait for recovery to end when a run is over, wall-clock [s]."""


@dataclass(frozen=True, slots=True)
class Arrangement:
    """How a run is arranged; by default as a plant is operated."""

    mode: Mode = Mode.CLOSED_LOOP
    """Mode in which the guard begins; in one in which nobody writes, the plant runs its own recipe."""
    guard: GuardSettings = field(default_factory=GuardSettings)
    """How long the guard waits, and how many people must agree to a reset."""
    memory: Memory | None = None
    """What a journal says of the guard before; None for a run that begins."""
    budget: Budget = field(default_factory=Budget)
    """What one recovery may take."""
    archive: Archive = field(default_factory=MemoryArchive)
    """Keeps what graph and models were asked and answered."""
    language: Language | None = None
    """Proposes after the search where it is given, and where more than a little may be won."""
    protocol: AskingProtocol = AskingProtocol.ROUTE
    """When proposers are asked."""
    given: Callable[[Monitoring], Monitoring] | None = None
    """Puts another monitoring in front of the plant's, for studies that take the diagnosis from elsewhere."""
    propose: Propose = in_operation
    """Makes the proposers, for studies that compare them."""
    hurried: bool = True
    """Whether thinking costs as much process time as it takes."""
    playbook: Book | None = None
    """What was released before, read already; None for a run that depends on nothing but its inputs."""


@dataclass(frozen=True, slots=True)
class Assembly:
    """A guard with recovery beside it."""

    guard: Guard
    """Decides."""
    exchange: Exchange
    """Where the two meet."""
    worker: Worker
    """Runs recovery."""
    tick_s: float = TICK_S
    """Process time between two samples [s]."""

    def run(
        self,
        source: Source,
        hook: Hook = lambda seen: None,
        scale: float | None = None,
        pacing: Pacing | None = None,
    ) -> None:
        """Go on until ``source`` ends, in virtual time, or at ``scale`` process seconds per wall-clock second.

        ``hook`` is shown every observation; virtual time waits for ``pacing``. Raises ProcessError where a simulated
        plant leaves the physical world.
        """
        loop = Loop(self.guard, source, self.exchange, hook)
        reason = "the run was interrupted"
        self.worker.start()
        try:
            loop.run_virtual(self.tick_s, pacing) if scale is None else loop.run_paced(scale, self.tick_s)
            reason = "the run is over"
        finally:
            self.worker.join(END_S)
            self.guard.stop(reason)


def guard_rules(plant: Plant, protocol: AskingProtocol = AskingProtocol.ROUTE) -> GuardRules:
    """What the guard knows of ``plant``: all of it from tables and settings."""
    return replace(rules_of(plant), nominal=nominal(plant, protocol))


def wire(
    plant: Plant, lease: Lease | None, clock: Clock, trace: Trace, seed: int, arrangement: Arrangement = Arrangement()
) -> Assembly:
    """A guard for the plant behind ``lease``, and recovery beside it; ``seed`` seeds the twin's draws, as the run's."""
    mode, key = arrangement.mode, new_key()
    tick_s = plant.description.timing.tick_s
    settings = replace(arrangement.guard, lease_within_s=plant.lease_within_s).for_ticks(tick_s)
    rules = guard_rules(plant, arrangement.protocol)
    guard = Guard(rules, Attachment(trace, lease, mode, {ISSUER: key}, arrangement.memory), settings)
    sealer = Sealer(ISSUER, key, lambda: settings.person_s if guard.mode is Mode.APPROVE else settings.check_age_s)
    outside = Outside(guard.mailbox.put, clock, trace, sealer)
    return Assembly(guard, *recovery_beside(plant, outside, seed, arrangement), tick_s)


@dataclass(frozen=True, slots=True)
class Outside:
    """What recovery has of the world around it."""

    send: Callable[[Message], object]
    """Takes a message to the guard."""
    clock: Clock
    """What thinking costs in process time."""
    trace: Trace
    """Takes everything that happens in recovery."""
    sealer: Sealer
    """Seals what the release check stands behind."""


def recovery_beside(plant: Plant, outside: Outside, seed: int, arrangement: Arrangement) -> tuple[Exchange, Worker]:
    """Recovery for a guard that may be anywhere: where observations are put, and the thread that has not begun yet.

    ``seed`` seeds the twin's draws.
    """
    send, clock = outside.send, outside.clock

    def lost(cause: str) -> None:
        send(Trouble("recovery:lost", cause))

    def failed(cause: str) -> None:
        send(Trouble("recovery:failed", cause))
        send(Settled("recovery:failed"))  # it begins again: people are to have seen it, and are called the next time

    tick_s = plant.description.timing.tick_s
    thinking_s = BUSY_S + arrangement.budget.for_ticks(tick_s).longest_s
    busy_s = thinking_s if clock.measured else ANSWERS * clock.hang_s
    exchange = Exchange(clock, send, lost, ExchangeSettings(tick_s=tick_s, busy_s=busy_s))
    recovery = _recovery(plant, exchange, outside, seed, replace(arrangement, hurried=clock.measured))
    return exchange, Worker(exchange, recovery.supervise, failed)


def _recovery(plant: Plant, exchange: Exchange, outside: Outside, seed: int, arrangement: Arrangement) -> RecoveryLoop:
    trace, rules = outside.trace, guard_rules(plant, arrangement.protocol)
    d, tags, archive = plant.description, plant.description.tags_by_name, arrangement.archive
    stepwise = arrangement.protocol is AskingProtocol.PER_STEP
    twin = Twin(plant.model, d, plant.twin, seed)
    grounding = Grounding(plant.graph, plant.namespace, archive)
    pricing = Pricing(plant.prices, d.limits, d.scales)
    simulation = TwinSimulation(twin, tags, d.limits, pricing)
    bench = Workbench(
        plant,
        twin,
        grounding,
        simulation,
        trace,
        archive,
        arrangement.protocol,
        arrangement.language,
        arrangement.hurried,
        arrangement.playbook,
    )
    monitoring: Monitoring = TwinMonitoring(twin, grounding, d, plant.baselines, plant.started, plant.monitoring)
    agents = Agents(
        monitoring=arrangement.given(monitoring) if arrangement.given else monitoring,
        proposers=arrangement.propose(bench),
        simulation=simulation,
        validation=LimitValidation(d.limits, tags),
        grounding=grounding,
        probing=None if stepwise else TwinProbing(twin, d, grounding, pricing),
        polishing=bench.search() if arrangement.language or arrangement.playbook is not None else None,
    )
    passing = frozenset(mode.name for mode in d.fault_modes if mode.effect is not None)  # nobody knows that it lasts
    known = PlantRules(d.machine, d.limits, plant.prices, rules.fallbacks, d.scales, tags, passing, d.timing)
    check = ReleaseCheck(twin, d.limits, tags, outside.sealer.seal, rules.configuration, plant.risk)
    bounds = Bounds(arrangement.budget.for_ticks(d.timing.tick_s), plant.intervention, plant.risk, stepwise)
    return RecoveryLoop(exchange, agents, known, check, bounds, trace)
