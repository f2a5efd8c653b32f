"""What the rules of meaning look at: the journal's events, the manifest, the result."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from homeostat.domain.events import guard, people, trips
from homeostat.domain.events.recovery import ReleasedActions
from homeostat.domain.events.writes import ReadBack, WriteEnded, WriteIntended
from homeostat.domain.plant.timing import TICK_S
from homeostat.journal.beside.files import RESULT
from homeostat.journal.beside.manifest import Manifest
from homeostat.journal.encode import Json
from homeostat.journal.events import TICK, Event, RunFinished, RunStarted
from homeostat.journal.reading import Record

_OF_GUARD: Final = (guard.GuardStarted, people.ModeEntered, guard.SequenceLoaded, guard.StateEntered)
_OF_ALARMS: Final = (people.AlarmRaised, people.AlarmReturned)
_OF_FALLBACKS: Final = (trips.FallbackStands, trips.FallbackActivated, trips.Latched, trips.LatchReset)
_OF_REQUESTS: Final = (people.PersonHeard, guard.RequestAnswered, people.ServiceChanged)
_OF_RUN: Final = (RunStarted, RunFinished, ReleasedActions, WriteIntended, WriteEnded, ReadBack)
_TOLD: Final = frozenset(e.kind for e in (*_OF_GUARD, *_OF_ALARMS, *_OF_FALLBACKS, *_OF_REQUESTS, *_OF_RUN))
"""Events whose fields a rule looks at; of the others it counts that they happened, and when."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """A recorded run whose bytes are known to be what was written."""

    records: tuple[Record, ...]
    """Every event, `condensed`."""
    manifest: Manifest | None
    """What closes it; None where it was not closed."""
    result: Mapping[str, Json] | None
    """What it came to; None where it has no result."""

    @property
    def tick_s(self) -> float:
        """Process time between two samples of the plant, as the run says it [s]."""
        for record in self.of(RunStarted):
            stated = record.fields.get("configuration")
            for setting in stated if isinstance(stated, list) else ():
                value = setting.get("value") if isinstance(setting, dict) and setting.get("name") == TICK else None
                if isinstance(value, int | float) and value > 0.0:
                    return float(value)
        return TICK_S

    def of(self, *events: type[Event]) -> Iterator[Record]:
        """The events of some types, in order."""
        kinds = {event.kind for event in events}
        return (r for r in self.records if r.kind in kinds)


def condensed(record: Record) -> Record:
    """The record without fields that no rule looks at: a long run must fit into memory."""
    return record if record.kind in _TOLD else replace(record, fields={})


def result_values(run_dir: Path) -> Mapping[str, Json] | None:
    """The values of the run's result; None where it has none that can be read."""
    try:
        content = json.loads((run_dir / RESULT).read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) else None


def word(value: Json) -> str:
    """The name of an enum's member, or its value, as one spelling: ``TIMED_OUT`` and ``timed-out`` are the same."""
    return str(value).lower().replace("_", "-")


def text(record: Record, name: str) -> str:
    """A field that is a text; empty where it is missing or none."""
    value = record.fields.get(name)
    return value if isinstance(value, str) else ""


def whole(record: Record, name: str) -> int:
    """A field that is an integer; -1 where it is missing or none."""
    value = record.fields.get(name)
    return value if type(value) is int else -1
