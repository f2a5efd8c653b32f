"""Runs: one scenario from start to score."""

import contextlib
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

from homeostat.agents.roles import AskingProtocol, Monitoring, Proposer
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.observation import Observation
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.conditions import Conditions, LabelGiven, MostProbable, without_ensemble
from homeostat.evaluate.local_control import LocalControl, Told
from homeostat.evaluate.operation import Operation
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.recorded.resumption import Past
from homeostat.evaluate.reference.left_alone import left_alone
from homeostat.evaluate.reference.unsupervised import fault_free, once, open_process, watch
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.costs import run_cost
from homeostat.evaluate.score.outcome import (
    completion_s,
    facts_of,
    intervened,
    limits_of,
    outcome,
    priced_from_s,
    written,
)
from homeostat.evaluate.score.scoring import exposures, production_loss
from homeostat.evaluate.thinking_time import ThinkingTime
from homeostat.evaluate.transcript import TranscribedModel
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.journal import MemoryTrace, RunStarted, Subscriber, Trace
from homeostat.journal.beside.archive import Archive, MemoryArchive
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from homeostat.links.truth.process import TrueProcess
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import (
    Arrangement,
    Assembly,
    Propose,
    Workbench,
    check_protocol,
    new_sequencer,
    wire,
)
from homeostat.record.run_record import RunRecord

Watcher: TypeAlias = Callable[[Snapshot], None]
"""Called with each snapshot before anybody thinks about it."""


class Shown:
    """Follows a run, tick by tick."""

    def __init__(self, state: str, watcher: Watcher | None = None) -> None:
        """``state``: the one that the plant begins in; ``watcher`` is shown every snapshot, nobody where None."""
        self._watcher = watcher
        self.state = state
        """State that the plant is in."""

    def __call__(self, seen: Observation) -> None:
        """Take one tick of a guard."""
        self.state = seen.state
        if seen.snapshot is not None:
            self.sampled(seen.snapshot)

    def sampled(self, snapshot: Snapshot) -> bool:
        """Take one snapshot of a plant that nobody guards; False, as nobody wants it to end."""
        if self._watcher is not None:
            self._watcher(snapshot)
        return False


def run_steered(
    plant: Plant, scenario: Scenario, sequencer: Sequencer, at_s: float = math.inf, commands: tuple[Command, ...] = ()
) -> Run:
    """Run ``scenario`` with nobody but ``sequencer``, ``commands`` being given at ``at_s`` [s], and score it."""
    begin, trace, record = time.monotonic(), MemoryTrace(), RunRecord()
    trace.subscribe(record)
    process = watch(open_process(plant, scenario), once(sequencer, at_s, lambda now_s: commands))
    _note_states(sequencer, trace)
    nobody_thinks = ThinkingTime(record, lambda: 0.0)
    return _score(plant, scenario, record, process, nobody_thinks, time.monotonic() - begin)


def _note_states(sequencer: Sequencer, trace: Trace) -> None:
    for state, at_s in sequencer.drain():
        with contextlib.suppress(OSError):  # a full disk is no reason not to score the run
            trace.record(StateEntered(state), at_s)


def run(
    plant: Plant,
    scenario: Scenario,
    trace: Trace | None = None,
    clock: ThinkingClock | DeclaredClock | None = None,
    proposing: Proposing | None = None,
    operation: Operation | None = None,
    watcher: Watcher | None = None,
    archive: Archive | None = None,
    started: RunStarted | None = None,
) -> Run:
    """Run ``scenario`` to its end and score it; everything that happens goes to ``trace``.

    ``proposing``: who proposes, the search alone where None; ``operation``: what may be done to the plant, and who
    orders anything; ``watcher`` is shown every snapshot; ``archive`` keeps what graph and models were asked and
    answered; ``started`` is recorded first. Raises PlantError where the plant cannot be asked for step by step.
    """
    begin = time.monotonic()
    proposing, operation, trace = proposing or Proposing(), operation or Operation(), trace or MemoryTrace()
    conditions, language, propose = proposing.conditions, proposing.language, proposing.propose
    check_protocol(plant, conditions.protocol)
    clock = clock or ThinkingClock()
    record = RunRecord(conditions.protocol is AskingProtocol.PER_STEP)
    thinking = ThinkingTime(record, lambda: clock.total_s)
    trace.subscribe(record)
    trace.subscribe(thinking)
    if started is not None:
        trace.record(started, 0.0)
    process, shown = open_process(plant, scenario), Shown(plant.description.machine.initial.name, watcher)
    transcribed = TranscribedModel(language.model, lambda: shown.state) if language else None
    if propose is None:
        _leave_alone(plant, process, shown, trace)
    else:
        arrangement = Arrangement(
            mode=operation.mode,
            guard=operation.guard,
            memory=operation.past.memory if operation.past else None,
            budget=proposing.budget,
            archive=archive or MemoryArchive(),
            language=replace(language, model=transcribed) if language and transcribed else None,
            protocol=conditions.protocol,
            given=_informed(plant, scenario, conditions),
            propose=_once(propose, conditions),
            playbook=proposing.playbook,
        )
        link, local = _attach(plant, process, operation)
        lease = link if operation.mode.writes else None
        known = proposing.known or plant
        understood = known if conditions.ensemble else without_ensemble(known)
        assembly = wire(understood, lease, clock, trace, scenario.seed, arrangement)
        if operation.past is not None:
            _go_on(plant, operation.past, (record, thinking), trace)
            assembly.exchange.remember(operation.past.retrace(link, local))
        assembly.run(link.source, _hook(shown, assembly, operation, local), operation.pace, operation.pacing)
    result = _score(plant, scenario, record, process, thinking, time.monotonic() - begin)
    return replace(result, transcript=tuple(transcribed.transcript)) if transcribed else result


def _leave_alone(plant: Plant, process: TrueProcess, shown: Shown, trace: Trace) -> None:
    sequencer = new_sequencer(plant)
    watch(process, sequencer.sample, shown.sampled)
    _note_states(sequencer, trace)


def _go_on(plant: Plant, past: Past, followers: tuple[Subscriber, ...], trace: Trace) -> None:
    """Take note of what happened before the run was killed."""
    for entry in past.record.entries:
        for follower in followers:
            follower(entry.event, entry.at_s)
    if (unsaid := past.unsaid(plant)) is not None:
        trace.record(unsaid, past.at_s)


def _attach(plant: Plant, process: TrueProcess, operation: Operation) -> tuple[SimulatedLink, LocalControl]:
    """The simulated plant, and its own control, which runs the recipe where the guard does not."""
    local = LocalControl(plant, operation.mode.writes, lambda: link.leased)
    link = SimulatedLink(process, LinkConfiguration.of(plant.recipe, plant.description.timing.tick_s), local.sample)
    return link, local


def _hook(shown: Shown, assembly: Assembly, operation: Operation, local: LocalControl) -> Callable[[Observation], None]:
    """Shows every tick, tells the plant's own control of it, and takes to the guard what people have ordered."""

    def hook(seen: Observation) -> None:
        local.tell(Told(seen.state, seen.latched is not None, assembly.guard.carries))
        shown(seen)
        for order in operation.orders():
            assembly.guard.mailbox.put(order)
        operation.onlooker(seen)  # last: what fails in there keeps nobody from anything

    return hook


def _informed(plant: Plant, scenario: Scenario, conditions: Conditions) -> Callable[[Monitoring], Monitoring]:
    """What stands before the plant's own monitoring."""

    def informed(monitoring: Monitoring) -> Monitoring:
        if conditions.label_given:
            every_step = conditions.protocol is AskingProtocol.PER_STEP  # that is review enough
            told = scenario.faults if conditions.label is None else conditions.label
            monitoring = LabelGiven(monitoring, told, math.inf if every_step else plant.monitoring.review_s)
        return monitoring if conditions.ensemble else MostProbable(monitoring)

    return informed


def _once(propose: Propose, conditions: Conditions) -> Propose:
    """``propose``, with one attempt each where there is no reprompting."""

    def once(bench: Workbench) -> tuple[Proposer, ...]:
        proposers = propose(bench)
        return proposers if conditions.reprompting else tuple(replace(p, attempts=1) for p in proposers)

    return once


def _score(
    plant: Plant, scenario: Scenario, record: RunRecord, process: TrueProcess, thinking: ThinkingTime, wall_s: float
) -> Run:
    truth, onset_s = process.truth(), scenario.onset_s
    healthy, force = fault_free(plant, scenario), limits_of(plant, record, truth)
    # A report before the onset is a false alarm, not a detection.
    times = [*(at_s for at_s, _ in record.diagnosed), *record.tripped_s]
    reports = [at_s for at_s in times if onset_s is None or at_s >= onset_s]
    detected_s = min(reports, default=None)
    from_s = priced_from_s(scenario, record, truth)
    cost = run_cost(plant, truth, healthy.truth, from_s, record.states, len(record.released), force)
    alone = left_alone(plant, scenario, healthy.truth, from_s) if written(plant, record) else None
    needless = alone is not None and intervened(plant, record) and alone.makes_needless(cost)
    return Run(
        plant=plant,
        scenario=scenario,
        record=record,
        truth=truth,
        measured=process.measured(),
        outcome=outcome(facts_of(plant, scenario, record, truth, detected_s, needless)),
        detected_s=detected_s,
        false_alarm=bool(record.diagnosed) if onset_s is None else len(reports) < len(record.diagnosed),
        exposures=exposures(truth, force, detected_s),
        force=force,
        production_loss=production_loss(truth, healthy.truth, plant.delivered, from_s),
        cost=cost,
        cost_alone=None if alone is None else alone.cost,
        complete_s=completion_s(plant, record.states),
        nominal_s=completion_s(plant, healthy.states),
        totals={name: float(truth.signals[v][0, -1]) for name, v in plant.totals.items()},
        thought_s=thinking.total_s,
        thinking_s=thinking.decision_s,
        wall_s=wall_s,
    )
