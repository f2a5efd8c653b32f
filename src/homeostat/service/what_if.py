"""An episode of a history watched again, by a plant as it is configured today: nobody writes, and advice is kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NoReturn, final

import numpy as np

from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.recovery import Attempted, Diagnosed, Noticed
from homeostat.domain.events.trips import Tripped
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.history.quality import severity
from homeostat.history.samples import Series, Span
from homeostat.history.store import HistoryError, HistoryReader
from homeostat.journal import Event, MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.errors import LinkError
from homeostat.plants.plant import Plant
from homeostat.plants.wired.supervisor import Supervisor
from homeostat.service.historian.observed import PROCESS_TIME


@dataclass(frozen=True, slots=True)
class Advice:
    """What would have been released."""

    at_s: float
    """Process time [s]."""
    commands: tuple[Command, ...]
    """What would have been written at once."""


@dataclass(frozen=True, slots=True)
class WhatIf:
    """What today's configuration makes of an episode."""

    from_s: float
    """Process time of the first sample [s]."""
    to_s: float
    """That of the last one [s]."""
    detected_s: float | None
    """When something would have been noticed first [s]; None for never."""
    diagnosis: str
    """What would have been likeliest at last; empty where nothing was diagnosed."""
    advice: tuple[Advice, ...]
    """What would have been released, in order; the plant went on without it, so the first says most."""
    trips: tuple[tuple[float, str], ...]
    """Process time and name of each hard limit that would have tripped [s]."""


def what_if(plant: Plant, history: HistoryReader, span: Span, tell: Callable[[Event, float], None]) -> WhatIf:
    """Watch what ``history`` has in ``span`` in advise; ``tell`` is told every event with its process time [s].

    Thinking is charged a second at a time, so that equal episodes give equal answers. HistoryError where there is
    nothing to watch, UnknownTag where the history has no process time.
    """
    source = RecordedSource(plant, history, span)
    trace = MemoryTrace()
    trace.subscribe(tell)
    Supervisor(plant, RecordedLink(source), Mode.ADVISE, trace, clock=DeclaredClock(1.0)).run()
    return _found(trace, source)


def _found(trace: MemoryTrace, source: RecordedSource) -> WhatIf:
    detected_s, diagnosis = None, ""
    tried: dict[str, tuple[Command, ...]] = {}
    advice, trips = list[Advice](), list[tuple[float, str]]()
    for entry in trace.entries:
        match entry.event:
            case Noticed() if detected_s is None:
                detected_s = entry.at_s
            case Diagnosed(hypotheses=hypotheses) if hypotheses:
                diagnosis = max(hypotheses, key=lambda h: h.probability).name
            case Attempted(digest=digest, commands=commands):
                tried[digest] = commands
            case RequestAnswered(status="advised", digest=digest):
                advice.append(Advice(entry.at_s, tried.get(digest, ())))
            case Tripped(limit=limit):
                trips.append((entry.at_s, limit))
    return WhatIf(source.begin_s, source.now_s, detected_s, diagnosis, tuple(advice), tuple(trips))


@final
class RecordedSource:
    """Implements :class:`homeostat.domain.ports.Source` over samples that were kept."""

    never_blocks = True
    """Everything was read before."""

    def __init__(self, plant: Plant, history: HistoryReader, span: Span) -> None:
        process = history.read([PROCESS_TIME], span)[PROCESS_TIME]
        if not process.length:
            raise HistoryError("the history has no samples in that span; choose another one")
        tags = sorted(plant.description.tags_by_name.keys() & set(history.tags()))
        self._writables = plant.description.writables
        self._samples = self._each(process, {tag: history.read([tag], span)[tag] for tag in tags})
        self.begin_s = self.now_s = float(process.value[0])
        """Process time of the first sample, and of the last that was given [s]."""
        self.ended = False
        """Whether there is no further sample."""
        self._next = next(self._samples, None)

    def advance(self) -> Snapshot | None:
        """The next sample; None where its time is no later than that of the one before, as after a restart."""
        sample, self._next = self._next, next(self._samples, None)
        self.ended = self._next is None
        if sample is None or sample.at_s < self.now_s:
            return None
        self.now_s = sample.at_s
        return sample

    def _each(self, process: Series, series: dict[str, Series]) -> Iterator[Snapshot]:
        columns = {}
        for tag, one in series.items():
            place = np.searchsorted(one.time_us, process.time_us, side="right") - 1
            latest = np.maximum(place, 0)
            columns[tag] = one.value[latest], np.where(place >= 0, severity(one.quality[latest]), 2)
        for k, at_s in enumerate(process.value.tolist()):
            values = {tag: float(value[k]) for tag, (value, _) in columns.items()}
            bad = frozenset(tag for tag, (_, level) in columns.items() if level[k] >= 2)
            uncertain = frozenset(tag for tag, (_, level) in columns.items() if level[k] == 1)
            held = {t: values[t] for t in self._writables if t in values and t not in bad}
            accepted = {t: None if math.isnan(v) else v for t, v in held.items()}
            yield Snapshot(at_s, values, bad, uncertain, accepted=accepted)


@final
class RecordedLink:
    """Implements :class:`homeostat.domain.ports.Link`: what was can be read, and not written."""

    never_blocks = True
    """It has nobody to wait for."""

    def __init__(self, source: RecordedSource) -> None:
        self.source = source
        """The reading side."""

    def take(self) -> NoReturn:
        """LinkError: what was cannot be changed."""
        raise LinkError("a history cannot be written to a plant")

    def beat(self) -> None:
        """Nobody listens."""

    def give_back(self) -> None:
        """There is nothing to give back."""
