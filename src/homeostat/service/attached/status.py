"""What is shown of an attached plant: requested and actual mode apart, link, thinking, alarms, what waits."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from homeostat.domain.events.guard import RequestAnswered, ThinkingBegan, ThinkingEnded
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.guard import Guard
from homeostat.journal import Event, Record
from homeostat.record.decode import decode
from homeostat.service.attached.standing import Connected


@dataclass(frozen=True, slots=True)
class ModeShown:
    """The mode that a person has asked for, and the one that the guard stands in."""

    requested: str = Mode.OBSERVE.value
    """What a person ordered last."""
    by: str = ""
    """Who; empty where nobody has ordered any."""
    actual: str = Mode.OBSERVE.value
    """What the guard stands in; at most what was requested."""
    since_s: float = 0.0
    """Since when, in process time [s]."""
    why: str = ""
    """Why it is not what was requested; empty where it is."""

    def after(self, event: Event, at_s: float) -> ModeShown:
        """What is shown after ``event``, which happened at process time ``at_s`` [s]."""
        if not isinstance(event, ModeEntered):
            return self
        entered = replace(self, actual=event.mode, since_s=at_s, why="")
        if event.person:
            return replace(entered, requested=event.mode, by=event.person)
        return (
            replace(entered, why=event.reason or "the guard began again") if self.requested != event.mode else entered
        )


@dataclass(frozen=True, slots=True)
class ThinkingShown:
    """The process that thinks."""

    process: int | None = None
    """Its number; None while there is none."""
    begun: int = 0
    """How often one has begun since the guard did."""
    reason: str = ""
    """Why the last one ended; empty where none has."""

    def after(self, event: Event) -> ThinkingShown:
        """What is shown after ``event``."""
        match event:
            case ThinkingBegan():
                return replace(self, process=event.process, begun=self.begun + 1)
            case ThinkingEnded():
                return replace(self, process=None, reason=event.reason)
        return self


@dataclass(slots=True)
class Ticks:
    """How well the guard keeps its second."""

    number: int = 0
    """Ticks since the guard began."""
    without: int = 0
    """Those to which no sample came."""
    longest_s: float = 0.0
    """Longest time between two ticks, wall-clock [s]."""
    _last: float = field(default=-1.0, repr=False)

    def take(self, sampled: bool) -> None:
        """One more tick, with a sample or without."""
        now = time.monotonic()
        if self._last >= 0.0:
            self.longest_s = max(self.longest_s, now - self._last)
        self.number, self.without, self._last = self.number + 1, self.without + (not sampled), now


class StatusBoard:
    """Follows the guard's ticks and the journal's events; whoever asks reads it from another thread."""

    def __init__(self, guard: Guard, link: Connected, missed: Callable[[], int], known: Mapping[str, Any]) -> None:
        """``missed``: samples that came too fast; ``known``: what does not change (plant, configuration, processes)."""
        self._guard, self._link, self._missed, self._known = guard, link, missed, dict(known)
        self._mode, self._thinking, self._ticks = ModeShown(), ThinkingShown(), Ticks()
        self._offered: dict[str, str] = {}
        self._seen: Observation | None = None
        self._sample: tuple[Snapshot, float] | None = None

    def recall(self, records: tuple[Record, ...]) -> None:
        """Take over what the journal says of an earlier guard."""
        for record in records:
            if record.kind == ModeEntered.kind and (event := decode(record)) is not None:
                self._mode = self._mode.after(event, record.at_s)

    def follow(self, event: Event, at_s: float) -> None:
        """Take note of an event, which happened at process time ``at_s`` [s]."""
        self._mode, self._thinking = self._mode.after(event, at_s), self._thinking.after(event)
        if isinstance(event, RequestAnswered):
            if event.status == "offered":
                self._offered[event.request] = event.digest
            else:
                self._offered.pop(event.request, None)

    def show(self, seen: Observation) -> None:
        """Take note of one tick."""
        self._ticks.take(seen.sample is not None)
        if seen.sample is not None:
            self._sample = seen.sample, time.monotonic()
        self._seen = seen

    def told(self) -> dict[str, Any]:
        """Everything, as JSON takes it."""
        seen, guard, link = self._seen, self._guard, self._link
        out = guard.out_of_service
        bad = {} if seen is None or seen.snapshot is None else dict(sorted(seen.snapshot.reasons.items()))
        return {
            **self._known,
            "now_s": None if seen is None else seen.now_s,
            "mode": {**asdict(self._mode), "actual": guard.mode.value},
            "state": None if seen is None else seen.state,
            "latched": guard.latched,
            "act_by_s": None if seen is None else seen.act_by_s,
            "link": {"trouble": link.trouble, "clock_s": round(link.clock_s, 3), "missed": self._missed()},
            "thinking": asdict(self._thinking),
            "ticks": {k: v for k, v in asdict(self._ticks).items() if not k.startswith("_")},
            "alarms": [
                {
                    "alarm": a.id,
                    "priority": a.priority.value,
                    "since_s": a.raised_s,
                    "lasts": a.returned_s is None,
                    "acknowledged_by": a.acknowledged_by,
                    "cause": a.cause,
                }
                for a in guard.alarms
            ],
            "offered": dict(self._offered),
            "out_of_service": sorted(out),
            "readings": bad,
            "sample": self._sampled(),
        }

    def _sampled(self) -> dict[str, Any] | None:
        """The last sample that came, with its age by the wall clock; None where none has come yet."""
        if self._sample is None:
            return None
        sample, came = self._sample
        values = {tag: value if math.isfinite(value) else None for tag, value in sample.values.items()}
        return {"at_s": sample.at_s, "age_s": round(time.monotonic() - came, 3), "values": values}
