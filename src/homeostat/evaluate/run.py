"""Runs: one scenario from start to score."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from homeostat.agents.bounds import Budget
from homeostat.agents.roles import AskingProtocol, Monitoring, Proposer
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.guard import FellBack, StartUpBegan, StartUpEnded, StateEntered, Tripped
from homeostat.domain.events.recovery import Attempted, Diagnosed, Noticed
from homeostat.domain.observation import Observation
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.conditions.conditions import Conditions
from homeostat.evaluate.conditions.label_given import LabelGiven
from homeostat.evaluate.conditions.most_probable import MostProbable, without_ensemble
from homeostat.evaluate.conditions.transcript import ListeningModel, Said
from homeostat.evaluate.local_control import LocalControl, Told
from homeostat.evaluate.operation import Operation
from homeostat.evaluate.reference.unsupervised import Steered, fault_free, open_process, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.facts import completion_s, facts_of, limits_of
from homeostat.evaluate.score.limits_in_force import LimitsInForce, Span
from homeostat.evaluate.score.outcome import OutcomeKind, outcome
from homeostat.evaluate.score.scoring import Exposure, exposures, production_loss
from homeostat.evaluate.shown import Shown, Watcher
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.journal import MemoryTrace, Trace
from homeostat.journal.archive import Archive, NoArchive
from homeostat.journal.events import Event
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from homeostat.links.true_process import TrueProcess
from homeostat.plants.assembly import (
    Arrangement,
    Assembly,
    Language,
    Propose,
    Workbench,
    check_protocol,
    in_operation,
    new_sequencer,
    wire,
)
from homeostat.plants.plant import Case
from homeostat.record.releases import Release, Releases


@dataclass(frozen=True, slots=True)
class RunResult:
    """What a run came to."""

    scenario: Scenario
    """Its ground truth."""
    outcome: OutcomeKind
    """How it ended."""
    actor: str
    """Who acted: ``search``, ``language``, ``fallback`` or ``none``."""
    detected_s: float | None
    """Process time of the first report, a diagnosis or a trip [s]."""
    false_alarm: bool
    """Whether something was reported before there was a fault."""
    released_s: float | None
    """Process time of the first release [s]."""
    attempts: int
    """Proposals that were judged."""
    hypotheses: tuple[Hypothesis, ...]
    """The last diagnosis before the first release, or the last one."""
    actions: tuple[Command, ...]
    """The last commands that were written."""
    min_margin: float | None
    """Least margin of the first approval, each criterion in its own unit."""
    exposures: tuple[Exposure, ...]
    """Seconds outside each limit."""
    force: LimitsInForce
    """Which limits held when."""
    production_loss: float
    """Fraction of the fault-free production lost from the onset on [1]."""
    state: str
    """State of the machine at the end."""
    complete_s: float | None
    """Process time at which a state was entered that nothing but the fallback leaves, without the fallback [s]."""
    nominal_s: float | None
    """The same in the fault-free run [s]."""
    totals: Mapping[str, float]
    """What the case adds up over a run -> its true value at the end."""
    thinking_s: float
    """Wall-clock seconds of thinking, from the notice that led to the first action until that action; all of it where
    nothing was done [s]."""
    started_s: float
    """Process time at which the plant left start-up [s]."""
    thought_s: float
    """Wall-clock seconds of all thinking [s]."""
    wall_s: float
    """Wall-clock seconds of the whole run [s]."""
    truth: Trajectory
    """True values."""
    measured: Trajectory
    """What the instruments said, at the same times."""
    reason: str
    """Why the fallback acted; empty where it did not."""
    said: tuple[Said, ...] = ()
    """What a language model answered, in order."""

    @property
    def good(self) -> bool:
        """Recovered, or rightly left alone."""
        return self.outcome.good


class Recorder:
    """Follows a trace and keeps what the score needs."""

    def __init__(self, clock: ThinkingClock | DeclaredClock, stepwise: bool = False) -> None:
        """``clock`` tells how much thinking went before each event; ``stepwise``: every step is released.

        Then what is released before anything was diagnosed is the batch as usual, and counts for nothing.
        """
        self._clock, self.stepwise = clock, stepwise
        self.started_s: float | None = None
        self.start_ups: list[Span] = []
        self.states: list[tuple[str, float]] = []
        self.diagnosed: list[tuple[float, Diagnosed]] = []
        self.attempts: list[Attempted] = []
        self._releases = Releases()
        self._usual = 0
        self.fallbacks: list[tuple[float, FellBack]] = []
        self.tripped_s: list[float] = []
        self._before_notice_s = 0.0
        self.thinking_s: float | None = None
        """Thinking from the notice that led to the first action until that action [s]; None while nothing was done."""

    @property
    def released(self) -> tuple[Release, ...]:
        """What was released, in order."""
        if not self.stepwise:
            return self._releases.made
        return self._releases.made[self._usual :] if self.diagnosed else ()

    def __call__(self, event: Event, at_s: float) -> None:
        """Take one event."""
        if self._releases.take(event, at_s) and (self.diagnosed or not self.stepwise):
            self._acted()
        match event:
            case StateEntered():
                self.states.append((event.state, at_s))
                self.started_s = at_s if self.started_s is None else self.started_s
            case StartUpBegan():
                self.start_ups.append((event.since_s, math.inf))
            case StartUpEnded() if self.start_ups:
                self.start_ups[-1] = (self.start_ups[-1][0], min(at_s, self.start_ups[-1][1]))
            case Noticed():
                self._before_notice_s = self._clock.total_s
            case Diagnosed():
                self._usual = self._usual if self.diagnosed else len(self._releases.made)
                self.diagnosed.append((at_s, event))
            case Attempted():
                self.attempts.append(event)
            case Tripped():
                self.tripped_s.append(at_s)
            case FellBack():
                self.fallbacks.append((at_s, event))
                self._acted()

    def _acted(self) -> None:
        if self.thinking_s is None:
            self.thinking_s = self._clock.total_s - self._before_notice_s


def run_steered(
    case: Case, scenario: Scenario, sequencer: Sequencer, at_s: float = math.inf, commands: tuple[Command, ...] = ()
) -> RunResult:
    """Run ``scenario`` with nobody but ``sequencer``, ``commands`` being given at ``at_s`` [s], and score it."""
    begin, clock, trace = time.monotonic(), DeclaredClock(0.0), MemoryTrace()
    recorder = Recorder(clock)
    trace.subscribe(recorder)
    process = watch(open_process(case, scenario), Steered(sequencer, at_s, commands))
    _note_states(sequencer, trace)
    return _score(case, scenario, recorder, process, clock.total_s, time.monotonic() - begin)


def _note_states(sequencer: Sequencer, trace: Trace) -> None:
    for state, at_s in sequencer.drain():
        with contextlib.suppress(OSError):  # a full disk is no reason not to score the run
            trace.record(StateEntered(state), at_s)


def run(
    case: Case,
    scenario: Scenario,
    trace: Trace | None = None,
    clock: ThinkingClock | DeclaredClock | None = None,
    budget: Budget | None = None,
    watcher: Watcher | None = None,
    archive: Archive | None = None,
    language: Language | None = None,
    conditions: Conditions | None = None,
    propose: Propose | None = in_operation,
    known: Case | None = None,
    operation: Operation | None = None,
) -> RunResult:
    """Run ``scenario`` to its end and score it; everything that happens goes to ``trace``.

    ``watcher`` is shown every snapshot; ``archive`` keeps what graph and models were asked and answered;
    ``language`` proposes before the search does, unless ``propose`` makes other proposers; where that is None, nobody
    acts, not even the fallback. ``conditions`` are those of a study; ``known`` is what the agents know of ``case``
    where that is less; ``operation``: what may be done to the plant, and who orders anything. Raises CaseError where
    the case cannot be asked for step by step.
    """
    begin = time.monotonic()
    conditions = conditions or Conditions()
    check_protocol(case, conditions.protocol)
    clock = clock or ThinkingClock()
    trace = trace or MemoryTrace()
    recorder = Recorder(clock, conditions.protocol is AskingProtocol.PER_STEP)
    trace.subscribe(recorder)
    process, shown = open_process(case, scenario), Shown(case.description.machine.initial.name, watcher)
    listening = ListeningModel(language.model, lambda: shown.state) if language else None
    if propose is None:
        sequencer = new_sequencer(case)
        watch(process, sequencer, shown.sampled)
        _note_states(sequencer, trace)
    else:
        operation = operation or Operation()
        arrangement = Arrangement(
            mode=operation.mode, guard=operation.guard,
            memory=operation.past.memory if operation.past else None,
            budget=budget or Budget(), archive=archive or NoArchive(),
            language=replace(language, model=listening) if language and listening else None,
            protocol=conditions.protocol, given=_informed(case, scenario, conditions),
            propose=_once(propose, conditions),
        )  # fmt: skip
        link, local = _attach(case, process, operation)
        lease = link if operation.mode.writes else None
        assembly = wire(_known(known or case, conditions), lease, clock, trace, scenario.seed, arrangement)
        if operation.past is not None:
            for event, at_s in operation.past.events:
                recorder(event, at_s)
            if (unsaid := operation.past.unsaid(case)) is not None:
                trace.record(unsaid, operation.past.at_s)
            assembly.exchange.remember(operation.past.retrace(link, local))
        assembly.run(link.source, _hook(shown, assembly, operation, local), operation.pace)
    result = _score(case, scenario, recorder, process, clock.total_s, time.monotonic() - begin)
    return replace(result, said=tuple(listening.said)) if listening else result


def _attach(case: Case, process: TrueProcess, operation: Operation) -> tuple[SimulatedLink, LocalControl]:
    """The simulated plant, and its own control, which runs the recipe where the guard does not."""
    local = LocalControl(case, operation.mode.writes)
    link = SimulatedLink(process, LinkConfiguration(recipe_by=case.recipe), local.sample)
    local.leased = lambda: link.leased
    return link, local


def _hook(shown: Shown, assembly: Assembly, operation: Operation, local: LocalControl) -> Callable[[Observation], None]:
    """Shows every tick, tells the plant's own control of it, and takes to the guard what people have ordered."""

    def hook(seen: Observation) -> None:
        local.told = Told(seen.state, seen.latched is not None, assembly.guard.carries)
        shown(seen)
        for order in operation.orders():
            assembly.guard.mailbox.put(order)

    return hook


def _known(case: Case, conditions: Conditions) -> Case:
    return case if conditions.ensemble else without_ensemble(case)


def _informed(case: Case, scenario: Scenario, conditions: Conditions) -> Callable[[Monitoring], Monitoring]:
    """What stands before the case's own monitoring."""

    def informed(monitoring: Monitoring) -> Monitoring:
        if conditions.label_given:
            every_step = conditions.protocol is AskingProtocol.PER_STEP  # that is review enough
            monitoring = LabelGiven(monitoring, scenario.faults, math.inf if every_step else case.monitoring.review_s)
        return monitoring if conditions.ensemble else MostProbable(monitoring)

    return informed


def _once(propose: Propose, conditions: Conditions) -> Propose:
    """``propose``, with one attempt each where there is no reprompting."""

    def once(bench: Workbench) -> tuple[Proposer, ...]:
        proposers = propose(bench)
        return proposers if conditions.reprompting else tuple(replace(p, attempts=1) for p in proposers)

    return once


def _score(
    case: Case, scenario: Scenario, seen: Recorder, process: TrueProcess, thinking_s: float, wall_s: float
) -> RunResult:
    truth, readings = process.truth(), process.measured()
    healthy, force = fault_free(case, scenario.seed, scenario.end_s), limits_of(case, seen, truth)
    # A report before the onset is a false alarm, not a detection.
    onset = scenario.onset_s
    reports = [t for t in (*(at_s for at_s, _ in seen.diagnosed), *seen.tripped_s) if onset is None or t >= onset]
    detected = min(reports, default=None)
    first = seen.released[0] if seen.released else None
    believed = [e for t, e in seen.diagnosed if first is None or t <= first.at_s]
    actor = "fallback" if seen.fallbacks else (seen.released[-1].proposer if seen.released else "none")
    commands = seen.fallbacks[-1][1].commands if seen.fallbacks else (seen.released[-1].commands if first else ())
    started = seen.started_s if seen.started_s is not None else truth.start_s
    return RunResult(
        scenario=scenario, outcome=outcome(facts_of(case, scenario, seen, truth, healthy, detected)),
        actor=actor, detected_s=detected,
        false_alarm=bool(seen.diagnosed) if onset is None else len(reports) < len(seen.diagnosed),
        released_s=first.at_s if first else None,
        attempts=len(seen.attempts), hypotheses=believed[-1].hypotheses if believed else (), actions=commands,
        min_margin=first.min_margin if first else None,
        exposures=exposures(truth, force, detected), force=force,
        production_loss=production_loss(truth, healthy.truth, case.delivered, onset if onset is not None else started),
        state=seen.states[-1][0] if seen.states else case.description.machine.initial.name,
        complete_s=completion_s(case, seen.states), nominal_s=completion_s(case, healthy.states),
        totals={name: float(truth.signals[v][0, -1]) for name, v in case.totals.items()},
        thinking_s=thinking_s if seen.thinking_s is None else seen.thinking_s,
        started_s=started, thought_s=thinking_s, wall_s=wall_s, truth=truth, measured=readings,
        reason=seen.fallbacks[0][1].reason if seen.fallbacks else "",
    )  # fmt: skip
