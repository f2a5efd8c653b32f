"""One question answered on the simulated plant: the fault begins, its diagnosis is given, what is released counts."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from homeostat import __version__
from homeostat.agents.playbook.distance import Measure
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.recovery import GaveUp, NoActionTaken, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation
from homeostat.domain.playbook import Entry, Occasion
from homeostat.domain.ports import Source
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.conditions import LabelGiven
from homeostat.evaluate.playbook.points import Question
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import LONGEST, Scenario, scenario
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Event, MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import LinkConfiguration, SimulatedLink
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Arrangement, wire
from homeostat.plants.wired.recoveries import entry_of, recoveries
from homeostat.process.batch import ProcessError
from homeostat.record.run_record import RunRecord

LOOKED_S: Final = 1500.0
"""How long a question is followed: two reviews and a half, as faults that grow matter late [s]."""
THOUGHT_S: Final = 1.0
"""What every thought costs in process time, whatever it takes: equal questions have equal answers [s]."""
UNHURRIED: Final = GuardSettings(sync_s=5.0)
"""No plant waits for the journal, which is in memory."""


def answered(plant: Plant, question: Question) -> Entry:
    """The entry of ``question``: what was released first, or why nothing was.

    It comes from a simulated plant that nobody watched any longer, so that nothing is said of what came of it.
    """
    timing = plant.description.timing
    end_s = min(question.onset_s + timing.time_s(LOOKED_S), LONGEST * timing.tick_s)
    chosen = scenario(plant, question.fault, question.seed, question.onset_s, question.severity, end_s)
    record, seen = RunRecord(), list[Snapshot]()
    broke = _run(plant, chosen, record, seen)
    found = recoveries(record.entries)
    if found:
        return entry_of(plant, found[0], _at(seen, found[0].noticed_s), question.source)
    setpoints = Measure(plant.description).setpoints(_at(seen, question.onset_s))
    occasion = Occasion(question.state, Mode.CLOSED_LOOP.value, (Hypothesis(chosen.faults, 1.0),), setpoints)
    needed = bool(broke or record.fallbacks)
    reason = broke or _reason(record, end_s - question.onset_s)
    return Entry(plant.configuration, __version__, question.source, occasion, None, reason, needed=needed)


def _run(plant: Plant, chosen: Scenario, record: RunRecord, seen: list[Snapshot]) -> str:
    """Run ``chosen`` until something is released or the fallback acts; why it broke, empty where it did not."""
    trace, until = MemoryTrace(), _Until()
    trace.subscribe(record)
    trace.subscribe(until)
    link = SimulatedLink(
        open_process(plant, chosen), LinkConfiguration.of(plant.recipe, plant.description.timing.tick_s)
    )
    arrangement = Arrangement(
        guard=UNHURRIED,
        given=lambda monitoring: LabelGiven(monitoring, chosen.faults, plant.monitoring.review_s),
    )
    assembly = wire(plant, link, DeclaredClock(THOUGHT_S), trace, chosen.seed, arrangement)

    def hook(observation: Observation) -> None:
        if observation.snapshot is not None:
            seen.append(observation.snapshot)

    try:
        assembly.run(_Ending(link.source, until), hook)
    except ProcessError as broke:
        return f"no answer: {broke}"
    return ""


class _Until:
    """Follows a trace until there is an answer, or will be none."""

    def __init__(self) -> None:
        self.over = False

    def __call__(self, event: Event, at_s: float) -> None:
        self.over = self.over or isinstance(event, ReleasedActions | FallbackActivated)


@dataclass(frozen=True, slots=True)
class _Ending:
    """A source that ends with whatever it is followed ``until``."""

    source: Source
    until: _Until

    @property
    def never_blocks(self) -> bool:
        return self.source.never_blocks

    @property
    def now_s(self) -> float:
        return self.source.now_s

    @property
    def ended(self) -> bool:
        return self.until.over or self.source.ended

    def advance(self) -> Snapshot | None:
        return self.source.advance()


def _reason(record: RunRecord, looked_s: float) -> str:
    fallbacks = record.of_kind(FallbackActivated)
    if fallbacks:
        gave_up = record.of_kind(GaveUp)
        return f"no answer: {gave_up[-1].reason if gave_up else fallbacks[0].reason}"
    left = record.of_kind(NoActionTaken)
    if left:
        return f"nothing need be done: every criterion holds in {left[-1].state!r} if it is left alone"
    return f"nothing was noticed within {looked_s:g} s"


def _at(seen: list[Snapshot], at_s: float) -> Snapshot:
    """The first sample at ``at_s`` [s] or later, else the last one."""
    later: Iterator[Snapshot] = (s for s in seen if s.at_s >= at_s)
    return next(later, seen[-1])
