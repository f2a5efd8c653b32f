"""A run that has ended: its ground truth, its record, what the plant truly did, and the score."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Hypothesis, by_fault_set
from homeostat.domain.outcome import Outcome
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.transcript import TranscriptEntry
from homeostat.journal import Summary
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.journal.beside.files import write_whole
from homeostat.plants.plant import Plant
from homeostat.record.directory import RunDirectory
from homeostat.record.foretold import Foretold, foretold
from homeostat.record.probes import probes_made
from homeostat.record.result import Exposure, Result, StepScores
from homeostat.record.run_record import RunRecord

E = TypeVar("E")


@dataclass(frozen=True, slots=True)
class Run:
    """One scenario from start to score."""

    plant: Plant
    """The plant."""
    scenario: Scenario
    """Its ground truth."""
    record: RunRecord
    """Everything that happened."""
    truth: Trajectory
    """True values."""
    measured: Trajectory
    """What the instruments said, at the same times."""
    outcome: Outcome
    """How it ended."""
    detected_s: float | None
    """Process time of the first report, a diagnosis or a trip, from the onset on [s]; None where there was none."""
    false_alarm: bool
    """Whether something was reported before there was a fault."""
    exposures: tuple[Exposure, ...]
    """Seconds outside each limit."""
    force: LimitsInForce
    """Which limits held when."""
    production_loss: float
    """Fraction of the fault-free production lost from the onset on [1]; NaN where none was to be made."""
    cost: Cost
    """What it cost from the onset on, in the plant's currency; NaN where that is not known."""
    complete_s: float | None
    """Process time at which a state was entered that nothing but the fallback leaves, without the fallback [s]."""
    nominal_s: float | None
    """The same in the fault-free run [s]."""
    totals: Mapping[str, float]
    """What the plant adds up over a run -> its true value at the end."""
    thought_s: float
    """Wall-clock seconds of all thinking [s]."""
    thinking_s: float
    """Those from the notice that led to the first action until that action; all where nothing was done [s]."""
    wall_s: float
    """Wall-clock seconds of the whole run [s]."""
    cost_alone: Cost | None = None
    """What leaving the plant alone would have cost over the same time, in its currency; None where nothing was
    released, the fallback acted, or a plant that is left alone leaves the physical world."""
    transcript: tuple[TranscriptEntry, ...] = ()
    """What a language model answered, in order."""
    texts: MemoryArchive = field(default_factory=MemoryArchive)
    """What graph and models were asked and answered, where it is not on disk."""
    steps: StepScores | None = None
    """How many single steps a language model got right; None unless it was asked in every state."""

    @property
    def good(self) -> bool:
        """Recovered, or rightly left alone."""
        return self.outcome.good

    @property
    def actor(self) -> str:
        """Who acted: ``search``, ``language``, ``fallback`` or ``none``."""
        return self.record.actor

    @property
    def released_s(self) -> float | None:
        """Process time of the first release [s]; None where there was none."""
        return self.record.released_s

    @property
    def attempts(self) -> int:
        """Proposals that were judged."""
        return len(self.record.attempts)

    @property
    def min_margin(self) -> float | None:
        """Least margin of the first approval, each criterion in its own unit."""
        return self.record.min_margin

    @property
    def reason(self) -> str:
        """Why the fallback acted; empty where it did not."""
        return self.record.reason

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """The last diagnosis before the first release, or the last one."""
        return self.record.hypotheses

    @property
    def actions(self) -> tuple[Command, ...]:
        """The last commands that were written."""
        return self.record.actions

    @property
    def state(self) -> str:
        """State of the machine at the end."""
        states = self.record.states
        return states[-1][0] if states else self.plant.description.machine.initial.name

    @property
    def started_s(self) -> float:
        """Process time at which the plant left start-up [s]."""
        return self.record.started_s(self.truth.start_s)

    @property
    def foreseen(self) -> Foretold | None:
        """When a hard limit would have tripped, as it was foreseen last before anything was done; None for never."""
        record = self.record
        acted = [at_s for at_s, _ in record.fallbacks]
        acted += [] if record.released_s is None else [record.released_s]
        return foretold(record.foreseen, min(acted, default=None), self.plant.description)

    def result(self, folder: Path) -> Result:
        """As ``result.json`` has it, whose record is in ``folder``; what is not a finite number is None there.

        A total that is none, as an output that is on automatic at the end, is left out.
        """
        return Result(
            case=self.scenario.case,
            fault=self.scenario.fault,
            seed=self.scenario.seed,
            outcome=self.outcome,
            actor=self.actor,
            onset_s=self.scenario.onset_s,
            detected_s=self.detected_s,
            released_s=self.released_s,
            attempts=self.attempts,
            hypotheses=by_fault_set(self.hypotheses),
            actions=self.actions,
            min_margin=finite(self.min_margin),
            limit_exposure_s=self.exposures,
            production_loss=finite(self.production_loss),
            cost=_known(self.cost),
            cost_alone=_known(self.cost_alone),
            currency=self.plant.prices.currency,
            state=self.state,
            complete_s=self.complete_s,
            nominal_s=self.nominal_s,
            totals=known_totals(self.totals),
            steps=self.steps,
            thinking_s=self.thinking_s,
            wall_s=self.wall_s,
            trace=str(folder),
            disturbances=tuple(map(str, self.scenario.disturbances)),
            mismatch=self.scenario.mismatch,
            probes=probes_made(self.record.entries),
            foreseen=self.foreseen,
        )

    def events(self, kind: type[E]) -> tuple[E, ...]:
        """Everything of one kind that happened, in order: ``run.events(homeostat.events.Diagnosed)``.

        TypeError where ``kind`` is no type.
        """
        if not isinstance(kind, type):
            raise TypeError(f"kind {kind!r} must be a type of events, as homeostat.events.Diagnosed")
        return self.record.of_kind(kind)

    def figure(self, path: Path | str) -> Path:
        """Draw the run as a PNG at ``path``, which is returned."""
        from homeostat.record.figure.figure import draw

        Path(path).parent.mkdir(parents=True, exist_ok=True)
        write_whole(Path(path), draw(self))
        return Path(path)

    def save(self, folder: Path | str) -> Path:
        """Keep the run in ``folder``, new or empty: journal, result, trajectory, figure and a manifest over them.

        `homeostat replay` tells it again and `homeostat trace verify` checks it. RunDirectoryError where the folder
        holds something, OSError where there is no room.
        """
        from homeostat.evaluate.recorded.run import store

        with RunDirectory(Path(folder)) as directory:
            self.texts.copy_to(directory)
            for entry in self.record.entries:
                directory.record(entry.event, entry.at_s)
            store(directory, self)
            directory.close(Summary(self.scenario.seed, self.outcome.value, self.plant.configuration))
            if directory.missing:
                raise OSError(f"the record in {str(directory.path)!r} is incomplete: {directory.missing}")
        return Path(folder)


def _known(cost: Cost | None) -> Cost | None:
    return cost if cost is not None and math.isfinite(cost.total) else None


def known_totals(totals: Mapping[str, float]) -> dict[str, float]:
    """Those of the ``totals`` that are finite numbers: nothing that is kept of a run can hold another one."""
    return {name: value for name, value in totals.items() if math.isfinite(value)}


def finite(value: float | None) -> float | None:
    """``value``; None where it is not a finite number."""
    return value if value is not None and math.isfinite(value) else None
