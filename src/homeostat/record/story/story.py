"""A run told line by line: live from its trace, or again from its journal; both give the same lines."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.diagnosis import FaultState, Hypothesis, Symptom, by_fault_set
from homeostat.domain.disturbance import Disturbance
from homeostat.domain.events.deviations import Deviated, Missed, Strayed
from homeostat.domain.events.foresight import Foreseen, Reached
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import (
    Attempted,
    Compared,
    Diagnosed,
    Doubted,
    FallbackArmed,
    FaultsEnded,
    GaveUp,
    NoActionTaken,
    NotAsked,
    Noticed,
    Probed,
    ProbeEnded,
    ReleasedActions,
    ReleaseRefused,
    Remarked,
    Retrieved,
    SymptomsCleared,
    Waited,
)
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.quotation import printable, quote, quoted
from homeostat.domain.remark import RemarkKind
from homeostat.journal import Event, RunFinished, RunStarted
from homeostat.journal.calls import ModelCalled
from homeostat.record.foretold import first_hard
from homeostat.record.run_record import RunRecord
from homeostat.record.story.apart import told_apart
from homeostat.record.story.folding import ATTEMPT, Folding
from homeostat.record.story.guard import GuardStory
from homeostat.record.story.line import Line, Tone
from homeostat.record.story.plain import plainly
from homeostat.record.story.wording import (
    commands,
    compared,
    lasting,
    named,
    percent,
    probabilities,
    quantity,
    who,
    worst,
)

_MOST_DETAIL = 400
"""Longest reason why a model did not answer [characters]."""


class Story:
    """Turns events into lines."""

    def __init__(self, plant: PlantDescription, run_dir: Path | str = "RUN") -> None:
        """``plant`` knows the operator's words and the units; orders to the run name ``run_dir``."""
        self._plant = plant
        self._guard = GuardStory(plant, str(run_dir))
        self._scales = plant.scales
        self.record = RunRecord()
        """Everything that was told."""
        self._coming: list[tuple[float, str]] = []
        self._reports = 0
        self._notices = 0
        self._asked: set[str] = set()
        self._foretold: dict[str, float] = {}
        self._folding = Folding()
        self.phase = "starting"
        """What the system is doing, one word."""
        self.state = plant.machine.initial.name
        """State of the supervisory state machine."""

    def watch(self, at_s: float) -> Iterator[Line]:
        """The plant was seen at ``at_s`` [s]: nobody is thinking."""
        self.phase = "starting" if self.state == self._plant.machine.initial.name else "watching"
        yield from self._folding.show(self._pass_time(at_s))

    def _pass_time(self, at_s: float) -> Iterator[Line]:
        while self._coming and self._coming[0][0] <= at_s:
            onset_s, what = self._coming.pop(0)
            yield Line(onset_s, "onset", f"{what} (ground truth)", Tone.WARNING)

    def tell(self, event: Event, at_s: float) -> Iterator[Line]:
        """The lines of one event, with what happened in the plant before it; what says the same again is counted."""
        self.record(event, at_s)
        told = (replace(line, text=plainly(line.text)) for line in self._lines(event, at_s))
        yield from self._folding.fold(event, at_s, told)

    def _lines(self, event: Event, at_s: float) -> Iterator[Line]:
        yield from self._pass_time(at_s)
        yield from self._guard.tell(event, at_s)
        match event:
            case RunStarted():
                yield self._begin(event)
            case Noticed():
                self.phase = "thinking"
                self._notices += 1
            case Retrieved() if self._notices <= 1 and event.form != "ASK" and event.query_sha256 not in self._asked:
                self._asked.add(event.query_sha256)
                about = ", ".join(event.about)
                yield Line(at_s, "asked", f"the graph: {event.question} ({about}): {event.answer}", Tone.MUTED)
            case Deviated() | Strayed() | Missed():
                yield _departs(event, at_s)
            case Diagnosed():
                yield from self._report(event, at_s)
            case Doubted():
                yield self._doubt(event, at_s)
            case Foreseen() if not event.digest and event.first is not None:
                yield from self._foresee(event, event.first, at_s)
            case SymptomsCleared():
                self._foretold = {}
            case FaultsEnded():
                self._foretold = {}
                yield self._over(event, at_s)
            case FallbackArmed() if not event.approved or self._reports == 1:
                yield self._arm(event, at_s)
            case ModelCalled():
                yield _call(event, at_s)
            case Attempted():
                yield self._attempt(event, at_s)
            case Remarked():
                yield _remark(event, at_s)
            case Compared() if event.chosen or self.record.acted_s is None:
                yield from (Line(at_s, "compared", text, Tone.MUTED) for text in compared(event))
            case GaveUp() if self.record.acted_s is None:
                yield Line(at_s, "gave up", event.reason, Tone.MUTED)
            case NotAsked() if self.record.acted_s is None:
                yield Line(at_s, "enough", event.reason, Tone.MUTED)
            case RunFinished():
                yield Line(at_s, "end", event.outcome.replace("_", " "), Tone.MUTED)
            case _:
                yield from self._answers(event, at_s)

    def _answers(self, event: Event, at_s: float) -> Iterator[Line]:
        """What was done about what was found."""
        match event:
            case ReleasedActions():
                self._foretold = {}
                held = f", for {event.for_s:g} s" if event.for_s else ""
                yield Line(at_s, "released", commands(event.commands, self._plant) + held, Tone.GOOD)
            case ReleaseRefused():
                text = f"{event.proposer}: the release check, because {printable(event.reason)}"
                yield Line(at_s, "refused", text, Tone.WARNING)
            case NoActionTaken():
                yield _let_be(event, at_s)
            case Probed():
                yield _probe(event, at_s)
            case Waited():
                yield _wait(event, at_s)
            case ProbeEnded():
                said = f"{100 * event.probability:.0f} % {event.likeliest}"
                text = f"told apart: {said}" if event.told else f"not told apart: {said} at most"
                yield Line(at_s, "probed", text, Tone.GOOD if event.told else Tone.WARNING)
            case StateEntered():
                self.state = event.state
                label = self._plant.machine.state(event.state).label
                yield Line(at_s, "state", f"{label} ({event.state})", Tone.MUTED)
            case FallbackActivated():
                self.state = event.strategy
                text = f"{event.strategy!r}: {commands(event.commands, self._plant)}, because {event.reason}"
                yield Line(at_s, "fallback", text, Tone.BAD)
            case _:
                pass  # an event that is not for the operator

    def _begin(self, event: RunStarted) -> Line:
        if (end_s := event.settings.get("end_s")) is None:
            return Line(0.0, "run", f"{event.case}, attached")
        disturbed = [(Disturbance.parse(text).from_s, text) for text in event.disturbances]
        self._coming = sorted([*((f.onset_s, self._fault(f)) for f in self.record.faults), *disturbed])
        what = " + ".join((*event.faults, *event.disturbances)) or "no fault"
        return Line(0.0, "run", f"{event.case}, {what}, seed {event.seed}, {float(end_s):g} s")

    def _fault(self, state: FaultState) -> str:
        mode = self._plant.fault(state.fault)
        return f"{mode.label}: {mode.name} {quantity(state.severity, mode.severity_unit)}"

    def _report(self, event: Diagnosed, at_s: float) -> Iterator[Line]:
        self._reports += 1
        believed = self._believed(event.hypotheses)
        if self._reports > 1:
            yield Line(at_s, "review", believed)
            return
        if event.symptoms:
            yield Line(at_s, "detected", self._seen(event.symptoms), Tone.WARNING)
        yield Line(at_s, "diagnosed", believed)

    def _believed(self, hypotheses: Sequence[Hypothesis]) -> str:
        held = by_fault_set(hypotheses)
        looks = told_apart(held, self._plant)
        return probabilities(held, self._plant) + (f"; told apart by {looks}" if looks else "")

    def _seen(self, symptoms: Iterable[Symptom]) -> str:
        rules = {rule.name: rule.description for rule in self._plant.symptom_rules}
        told = (f"{rules.get(s.rule, s.rule)} ({s.rule}, {s.severity:.1f} times its threshold)" for s in symptoms)
        return "; ".join(told)

    def _doubt(self, event: Doubted, at_s: float) -> Line:
        believed = self._believed(event.hypotheses)
        if not event.symptoms:
            return Line(at_s, "may be", f"it may come back: {believed}")
        seen = self._seen(event.symptoms)
        if event.explained:
            return Line(at_s, "may be", f"explained without a fault ({believed}): {seen}")
        return Line(at_s, "may be", f"{believed}, because {seen}", Tone.WARNING)

    def _foresee(self, event: Foreseen, first: Reached, at_s: float) -> Iterator[Line]:
        """When a hard limit trips if nothing is done: once, and again where it is another one, or twice as near."""
        limit = first_hard(event, self._plant)
        if limit in self._foretold and first.earliest_s >= 0.5 * self._foretold[limit]:
            return
        self._foretold[limit] = first.earliest_s
        text = f"{limit} trips {_within(first)} if nothing is done, in {first.members} of {event.members} members"
        yield Line(at_s, "foreseen", f"{text} ({percent(first.probability)} %)", Tone.WARNING)

    def _over(self, event: FaultsEnded, at_s: float) -> Line:
        text = f"{named(event.faults, self._plant)}: nothing of it is to be seen since {event.since_s:.0f} s"
        return Line(at_s, "over", text, Tone.GOOD)

    def _arm(self, event: FallbackArmed, at_s: float) -> Line:
        text = f"fallback {event.strategy!r}"
        if not event.approved:
            text += f" is the best there is, {worst(event.findings, self._scales)}"
        tone = Tone.MUTED if event.approved else Tone.WARNING
        return Line(at_s, "armed", f"{text}; {event.deadline_s:.0f} s to find something better", tone)

    def _attempt(self, event: Attempted, at_s: float) -> Line:
        hard = {limit.name for limit in self._plant.limits.hard}
        beside = any(finding.margin < 0.0 and finding.criterion in hard for finding in event.findings)
        approved = "approved, as the fallback does no better:" if beside else "approved,"
        verdict = approved if event.approved else "refused because"
        way = lasting(event) or " > ".join(event.path)
        text = f"{event.number} by {who(event.proposer, event.polished)}, {way}"
        # A review's proposal is told in full only where it is released, and a wait commands nothing.
        if self.record.acted_s is None and event.what is not AlternativeKind.WAIT:
            text += f": {commands(event.commands, self._plant)}"
        text += f"; {verdict} {worst(event.findings, self._scales)}"
        return Line(at_s, ATTEMPT, text, Tone.PLAIN if event.approved else Tone.MUTED)


def _within(first: Reached) -> str:
    earliest, latest = f"{first.earliest_s:.0f}", f"{first.latest_s:.0f}"
    return f"in {earliest} s" if earliest == latest else f"in {earliest} to {latest} s"


def _let_be(event: NoActionTaken, at_s: float) -> Line:
    why = "was found in time" if event.late else "needed" if event.min_margin >= 0.0 else "would cost less"
    text = event.recurs or f"{why} in {event.state!r}"
    return Line(at_s, "no action", text, Tone.MUTED)


def _wait(event: Waited, at_s: float) -> Line:
    """Nothing is released for a while, who says so, and what refuses now and will not then."""
    text = f"{event.seconds:g} s by {event.proposer}, then {event.follows}"
    if event.nuisance:
        text += f"; a nuisance: {', '.join(event.nuisance)} refuses it now and clears by itself"
    return Line(at_s, "waits", text)


def _departs(event: Deviated | Strayed | Missed, at_s: float) -> Line:
    if isinstance(event, Missed):
        return Line(at_s, "missed", event.reason, Tone.WARNING)
    if isinstance(event, Strayed):
        return Line(at_s, "strays", event.reason, Tone.WARNING)
    return Line(at_s, "deviates", f"from the prediction in {event.state!r}: {event.reason}", Tone.WARNING)


def _probe(event: Probed, at_s: float) -> Line:
    """What is tried, or waited for, only to learn something; what is written for it is told when it is released."""
    what = f"{event.state or 'a wait'} for {event.seconds:g} s to tell {event.apart[0]} from {event.apart[1]}"
    worth = f"{event.nats:.1f} nats expected, worth {event.value:.3f}, costs {event.cost:.3f}"
    return Line(at_s, "probe", f"{what}; {worth}")


_REMARKS: Final = {
    RemarkKind.REASONING: ("reasoning", Tone.MUTED),
    RemarkKind.NOTE: ("note", Tone.PLAIN),
    RemarkKind.MAINTENANCE: ("request", Tone.WARNING),
    RemarkKind.DOUBT: ("doubt", Tone.WARNING),
    RemarkKind.UNLISTED_CAUSE: ("suspects", Tone.WARNING),
}
"""Label of the line of a remark, and what it is to the operator."""


def _remark(event: Remarked, at_s: float) -> Line:
    """What a proposer said besides its proposal, quoted: nothing was decided by it."""
    label, tone = _REMARKS[event.remark]
    about = f" about {quoted(event.about)}" if event.about else ""
    return Line(at_s, label, f"{event.proposer}, {event.agent}{about}: {quote(event.text, _MOST_DETAIL)}", tone)


def _call(event: ModelCalled, at_s: float) -> Line:
    """What a language model was asked; the operator sees who answered, and that it cost time.

    What a server says is quoted here too: the journal of a replay may be older than this program, or forged.
    """
    if event.failure:
        return Line(at_s, "model", f"{event.agent}: {event.model}: {quoted(event.detail, _MOST_DETAIL)}", Tone.WARNING)
    tokens = f", {event.input_tokens} tokens in, {event.output_tokens} out" if event.input_tokens else ""
    text = f"{event.agent}: {quoted(event.served)} answered in {event.wall_latency_s:.1f} s{tokens}"
    return Line(at_s, "model", text, Tone.MUTED)
