"""The record of a run: every event in order, and what follows from them; every account of a run is a view of it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self, TypeVar

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.guard import StartUpBegan, StartUpEnded, StateEntered
from homeostat.domain.events.recovery import Attempted, Diagnosed, Remarked, Waited
from homeostat.domain.events.trips import FallbackActivated, Tripped
from homeostat.domain.events.writes import WriteEnded, WriteIntended, WriteResult
from homeostat.domain.recovery import Command
from homeostat.domain.remark import RemarkKind
from homeostat.journal.events import Event, RunFinished, RunStarted
from homeostat.journal.memory import Entry
from homeostat.journal.reading import Record
from homeostat.record.decode import decode
from homeostat.record.releases import Release, Releases

E = TypeVar("E")
Span = tuple[float, float]
"""First and last process time of something [s]."""
NOBODY = "none"
"""Actor of a run in which nothing was done but the steps of a batch as usual."""


@dataclass(frozen=True, slots=True)
class WriteAttempt:
    """One attempt to write to the plant."""

    intended: WriteIntended
    """What was to be sent."""
    result: WriteResult | None = None
    """What became of it; None where nothing is known."""

    @property
    def arrived(self) -> bool:
        """Whether something of it is known to have reached the plant."""
        return self.result not in (None, WriteResult.FAILED)


class RunRecord:
    """Follows a trace, or reads one again; nothing in it knows what truly happened."""

    def __init__(self, stepwise: bool = False) -> None:
        """``stepwise``: every step is released, and before anything is diagnosed it is the batch as usual."""
        self.stepwise = stepwise
        self._entries: list[Entry] = []
        self._releases = Releases()
        self._writes: dict[tuple[int, int], WriteAttempt] = {}
        self._usual: int | None = None  # releases before the first diagnosis

    @classmethod
    def of(cls, records: Iterable[Record]) -> Self:
        """What a journal says, at the times of its lines; DecodeError where one of them cannot be read."""
        made = cls()
        for record in records:
            event = decode(record)
            if event is not None:
                made(event, record.at_s)
        return made

    def __call__(self, event: Event, at_s: float) -> None:
        """Take one event."""
        self._entries.append(Entry(at_s, event))
        if isinstance(event, Diagnosed) and self._usual is None:
            self._usual = len(self._releases.made)
        self._releases.take(event, at_s)
        match event:
            case WriteIntended():
                self._writes[event.write, event.attempt] = WriteAttempt(event)
            case WriteEnded() if (tried := self._writes.get((event.write, event.attempt))) is not None:
                self._writes[event.write, event.attempt] = replace(tried, result=event.result)

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Everything that happened, in order."""
        return tuple(self._entries)

    def of_kind(self, kind: type[E]) -> tuple[E, ...]:
        """All events of one class, in order."""
        return tuple(entry.event for entry in self._entries if isinstance(entry.event, kind))

    def _timed(self, kind: type[E]) -> list[tuple[float, E]]:
        """All events of one class, each after its process time [s]."""
        return [(entry.at_s, entry.event) for entry in self._entries if isinstance(entry.event, kind)]

    @property
    def started(self) -> RunStarted | None:
        """How the run began; None where its first event is another one."""
        first = self._entries[0].event if self._entries else None
        return first if isinstance(first, RunStarted) else None

    @property
    def finished(self) -> bool:
        """Whether the run came to its end."""
        return bool(self.of_kind(RunFinished))

    @property
    def faults(self) -> tuple[FaultState, ...]:
        """The injected faults, as the run's first event has them; LookupError or ValueError where it does not."""
        if self.started is None:
            return ()
        chosen = self.started.settings
        return tuple(
            FaultState(n, float(chosen[f"severity {n}"]), float(chosen[f"onset_s {n}"])) for n in self.started.faults
        )

    def write_attempt(self, write: int, number: int) -> WriteAttempt:
        """Attempt ``number`` of ``write``, and what became of it; KeyError where it was never intended."""
        return self._writes[write, number]

    @property
    def open_writes(self) -> tuple[int, ...]:
        """Numbers of writes of which an attempt has no outcome: nobody knows whether the plant got them."""
        return tuple(sorted({tried.intended.write for tried in self._writes.values() if tried.result is None}))

    @property
    def states(self) -> list[tuple[str, float]]:
        """States of the machine, each with the process time at which it was entered [s]."""
        return [(entered.state, at_s) for at_s, entered in self._timed(StateEntered)]

    def started_s(self, never_s: float) -> float:
        """Process time at which the plant left start-up, ``never_s`` where it did not [s]."""
        return next((at_s for _, at_s in self.states), never_s)

    @property
    def start_ups(self) -> list[Span]:
        """Start-ups that the guard told of, from and to [s]; the last may have no end yet: infinite."""
        spans: list[Span] = []
        for entry in self._entries:
            match entry.event:
                case StartUpBegan(since_s=since_s):
                    spans.append((since_s, math.inf))
                case StartUpEnded() if spans:
                    spans[-1] = (spans[-1][0], min(entry.at_s, spans[-1][1]))
        return spans

    @property
    def diagnosed(self) -> list[tuple[float, Diagnosed]]:
        """Every report of monitoring, after its process time [s]."""
        return self._timed(Diagnosed)

    @property
    def foreseen(self) -> list[tuple[float, Foreseen]]:
        """Every time that the twin looked ahead, after its process time [s]."""
        return self._timed(Foreseen)

    @property
    def attempts(self) -> tuple[Attempted, ...]:
        """Proposals that were judged."""
        return self.of_kind(Attempted)

    @property
    def remarks(self) -> tuple[Remarked, ...]:
        """What proposers said besides proposals and their reasoning, each once, in order."""
        said = (event for event in self.of_kind(Remarked) if event.remark is not RemarkKind.REASONING)
        return tuple(dict.fromkeys(said))

    @property
    def waits(self) -> list[tuple[float, Waited]]:
        """Every time that it was waited instead of releasing anything, after its process time [s]."""
        return self._timed(Waited)

    @property
    def fallbacks(self) -> list[tuple[float, FallbackActivated]]:
        """Every time that a fallback acted, after its process time [s]."""
        return self._timed(FallbackActivated)

    @property
    def tripped_s(self) -> list[float]:
        """Process times of trips [s]."""
        return [at_s for at_s, _ in self._timed(Tripped)]

    @property
    def releases(self) -> tuple[Release, ...]:
        """What was released, in order, the steps of a batch as usual too."""
        return self._releases.made

    @property
    def released(self) -> tuple[Release, ...]:
        """What was released because something was wrong, in order."""
        if not self.stepwise:
            return self.releases
        return () if self._usual is None else self.releases[self._usual :]

    @property
    def released_s(self) -> float | None:
        """Process time of the first release [s]."""
        return next((release.at_s for release in self.released), None)

    @property
    def min_margin(self) -> float | None:
        """Least margin of the first approval, each criterion in its own unit."""
        return next((release.min_margin for release in self.released), None)

    @property
    def actor(self) -> str:
        """Who acted last: ``search``, ``language``, ``fallback`` or ``none``."""
        if self.fallbacks:
            return "fallback"
        return self.released[-1].proposer if self.released else NOBODY

    @property
    def actions(self) -> tuple[Command, ...]:
        """The last commands that were written."""
        if self.fallbacks:
            return self.fallbacks[-1][1].commands
        return self.released[-1].commands if self.released else ()

    @property
    def acted_s(self) -> float | None:
        """Process time of the last release, or of the last fallback once one has acted [s]; None for neither."""
        acted = [at_s for at_s, _ in self.fallbacks] or [release.at_s for release in self.releases]
        return acted[-1] if acted else None

    @property
    def reason(self) -> str:
        """Why the first fallback acted; empty where none did."""
        return next((event.reason for _, event in self.fallbacks), "")

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """The last diagnosis before the first release, or the last one."""
        first_s = self.released_s
        held = [event for at_s, event in self.diagnosed if first_s is None or at_s <= first_s]
        return held[-1].hypotheses if held else ()
