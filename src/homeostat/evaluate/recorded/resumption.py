"""Resumption: a run that was killed goes on from its journal, on the same simulated plant, made again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from homeostat.domain.events.guard import RequestAnswered, SequenceLoaded, StateEntered, StepTaken
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.recovery import ReleasedActions
from homeostat.domain.events.trips import FallbackActivated, LatchReset, Shed
from homeostat.domain.events.writes import Cause, ReadBack, WriteIntended
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation
from homeostat.domain.recovery import ActionSet, Step
from homeostat.evaluate.beginning import beginning
from homeostat.evaluate.local_control import LocalControl, Told
from homeostat.evaluate.scenario import Scenario, departing, repaired
from homeostat.guard.restart.memory import Memory
from homeostat.journal import Event, Record, RunStarted
from homeostat.journal.events import BEGINS_IN, SETPOINT
from homeostat.links.retracing import Retracing
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant
from homeostat.plants.truth import NONE
from homeostat.process.seeds import NAMING
from homeostat.record.releases import Release
from homeostat.record.run_record import RunRecord, WriteAttempt


class ResumptionError(ValueError):
    """A run cannot go on; one line with the reason."""


@dataclass(frozen=True, slots=True)
class Past:
    """What a journal holds of a run that was killed."""

    started: RunStarted
    """How it began."""
    record: RunRecord
    """Everything that happened until then, at the times of the journal's lines."""
    memory: Memory
    """Where its guard stood."""

    @classmethod
    def of(cls, records: Sequence[Record]) -> Past:
        """The past of a journal; ResumptionError where it holds no run that was killed."""
        record = RunRecord.of(records)
        if record.started is None:
            raise ResumptionError("its journal does not begin with a run")
        if record.finished:
            raise ResumptionError("it came to its end; there is nothing to go on with")
        return cls(record.started, record, Memory.of(records))

    @property
    def at_s(self) -> float:
        """Process time of the last line [s]."""
        return self.record.entries[-1].at_s

    def scenario(self, plant: Plant) -> Scenario:
        """The scenario of the run; ResumptionError where ``plant`` is not what it was, or the journal does not say.

        It may begin elsewhere than ``plant`` does by design (:func:`homeostat.evaluate.beginning.watched`).
        """
        chosen = self.started.settings
        if chosen.get("configuration") != plant.configuration:
            raise ResumptionError(f"the configuration of {plant.name!r} has changed since the run began")
        if (naming := chosen.get("seeds")) != NAMING:
            raise ResumptionError(
                f"its draws follow from the seed as in {naming!r} and here as in {NAMING!r}, so that its plant cannot "
                "be made again; use the version that recorded it"
            )
        set_by_then = {n.removeprefix(SETPOINT): float(v) for n, v in chosen.items() if n.startswith(SETPOINT)}
        try:
            whole = Scenario(plant.name, self.record.faults, self.started.seed, float(chosen["end_s"]))
            whole = beginning(plant, whole, str(chosen.get(BEGINS_IN, "")), set_by_then)
            departed = departing(plant, whole, self.started.disturbances, str(chosen.get("mismatch", NONE)))
            return repaired(departed, None if (at_s := chosen.get("repaired_s")) is None else float(at_s))
        except (KeyError, ValueError) as error:
            raise ResumptionError(f"its first event does not say {error}") from None

    def retrace(self, link: SimulatedLink, local: LocalControl) -> tuple[Observation, ...]:
        """Let ``link`` do again what it did until the last line, and what was seen of it; nobody decides anything.

        ``local`` runs its recipe again, told what it was told then.
        """
        seen, again = _Seen(local.told.state), Retracing(link)
        observations: list[Observation] = []
        for entry in self.record.entries:
            while link.now_s < entry.at_s and not link.ended:
                local.tell(seen.told)
                observations.append(seen.observed(link))
            seen.take(entry.event)
            match entry.event:
                case ModeEntered(mode=mode) if Mode(mode).writes:
                    again.lease()
                case ModeEntered() | Shed():
                    again.give_back()
                case WriteIntended() as intended if self._attempt(intended).arrived:
                    again.write(intended.commands)
        local.tell(seen.told)
        return tuple(observations)

    def unsaid(self, plant: Plant) -> ReleasedActions | None:
        """The release that the plant of ``plant`` has and that recovery did not live to record; None for none."""
        begun: WriteIntended | None = None
        written: WriteIntended | None = None
        for entry in self.record.entries:
            match entry.event:
                case WriteIntended(cause=Cause.REQUEST) as intended:
                    begun = intended if intended.attempt == 1 else begun  # another attempt may send what is left
                    written = begun if self._attempt(intended).arrived else written
                case RequestAnswered(status="failed" | "withdrawn", request=request):
                    written = None if written is not None and request == written.source else written
                case ReleasedActions() | FallbackActivated():
                    written = None
        if written is None:
            return None
        made = next(release for release in reversed(self.record.releases) if release.digest == written.digest)
        return _release(plant, written, made)

    def _attempt(self, intended: WriteIntended) -> WriteAttempt:
        return self.record.write_attempt(intended.write, intended.attempt)


class _Seen:
    """Follows the events and says how each tick looked to recovery."""

    def __init__(self, initial: str) -> None:
        self._last = Observation(0.0, None, initial, ActionSet((), ""), None, None, (), None, Mode.OBSERVE, (), None)
        self._flying: int | None = None
        self._waiting = 0

    @property
    def told(self) -> Told:
        """What the plant's own control was told of it."""
        last = self._last
        carries = last.mode.writes and (self._flying is not None or self._waiting > 0)
        return Told(last.state, last.latched is not None, carries)

    def take(self, event: Event) -> None:
        """Take note of one event."""
        match event:
            case WriteIntended():
                self._flying = event.write
            case ReadBack() if event.write == self._flying and not event.deviating:
                self._flying = None
            case RequestAnswered() if event.status in ("failed", "withdrawn"):
                self._flying = None
            case SequenceLoaded():
                self._waiting = len(event.steps) if event.source else 0
            case StepTaken():
                self._waiting = max(self._waiting - 1, 0)
            case StateEntered():
                self._last = replace(self._last, state=event.state, rest=ActionSet((), event.state))
            case ModeEntered():
                self._last = replace(self._last, mode=Mode(event.mode))
            case FallbackActivated():
                self._last = replace(self._last, latched=event.reason)
            case LatchReset():
                self._last = replace(self._last, latched=None)

    def observed(self, link: SimulatedLink) -> Observation:
        """The next tick of ``link``."""
        snapshot = link.advance()
        return replace(self._last, now_s=link.now_s, snapshot=snapshot, sample=snapshot)


def _release(plant: Plant, written: WriteIntended, made: Release) -> ReleasedActions:
    """What recovery would have recorded of the release ``made``, which was ``written``."""
    by_name = {t.name: t for t in plant.description.machine.transitions}
    try:
        then = tuple(Step(by_name[step.transition], step.commands) for step in written.steps)
    except KeyError as unknown:
        raise ResumptionError(f"{plant.name!r} has no transition {unknown}, which was released") from None
    margin = math.inf if made.min_margin is None else made.min_margin
    return ReleasedActions.of(made.proposer, ActionSet(written.commands, written.state, then), margin)


def told(past: Past) -> Iterator[str]:
    """In what the run that goes on may differ from one that was never killed, line by line."""
    yield f"it goes on at {past.at_s:.10g} s; what was thought and not released by then is thought again"
    for write in past.record.open_writes:
        yield f"whether write {write} reached the plant is not known: the plant is made again without it, and read"
