"""The course of a run in its journal: how it begins and ends, and that what was confirmed was released."""

from collections.abc import Iterator
from itertools import chain
from typing import Final

from homeostat.domain.events import guard, people, trips
from homeostat.domain.events.recovery import GaveUp, NoActionTaken, ReleasedActions
from homeostat.domain.events.writes import Cause, ReadBack, WriteEnded, WriteIntended
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.plant.timing import TICK_S
from homeostat.journal.events import Resumed, RunFinished, RunStarted, Signed
from homeostat.journal.reading import Record
from homeostat.journal.verify.evidence import Evidence, text, word
from homeostat.journal.verify.gaps import KINDS, Gap

AFTERWARDS: Final = 10.0
"""Recovery says within so many ticks that it released what the guard has confirmed, unless something comes between."""
_MODES: Final = frozenset(mode.value for mode in Mode)
_OWN: Final = (trips.Latched, people.ModeEntered)
_GUARDED: Final = (WriteIntended, WriteEnded, ReadBack, guard.RequestAnswered, trips.FallbackActivated, *_OWN)
"""Events of a guard."""
_BETWEEN: Final = (
    trips.FallbackActivated,
    GaveUp,
    guard.GuardStarted,
    guard.ThinkingEnded,
    NoActionTaken,
    RunFinished,
    guard.Stopped,
    trips.Tripped,
    *_OWN,
)
"""What may come between a confirmation and the word of recovery that it released something."""
_RELEASED: Final = (guard.RequestAnswered, ReleasedActions, WriteIntended, Resumed)
"""What says of a request how far it has come."""


def begin(evidence: Evidence) -> Iterator[str]:
    """A guard begins before it does anything, in a mode that there is."""
    started = next(evidence.of(guard.GuardStarted), None)
    first = next(evidence.of(*_GUARDED), None)
    if first is not None and (started is None or first.seq < started.seq):
        yield f"line {first.seq}: {first.kind!r} comes from a guard, and none had started"
    for record in evidence.of(guard.GuardStarted, people.ModeEntered):
        if word(record.fields.get("mode")) not in _MODES:
            yield f"line {record.seq}: {word(record.fields.get('mode'))!r} is no mode"


def end(evidence: Evidence) -> Iterator[str]:
    """A run that was closed ends once, with its outcome, and nothing happens after that."""
    finished: Record | None = None
    for record in evidence.records:
        if record.kind == Resumed.kind:
            finished = None
        elif finished is not None and record.kind != Signed.kind:
            yield f"line {record.seq}: {record.kind!r} comes after the run had ended in line {finished.seq}"
            finished = None if record.kind != RunFinished.kind else record
        elif record.kind == RunFinished.kind:
            finished = record
    began = next(evidence.of(RunStarted, guard.GuardStarted), None)
    if began is not None and evidence.manifest is not None and next(evidence.of(RunFinished), None) is None:
        yield f"the run was closed, and no line says how it ended ({RunFinished.kind!r} is missing)"


def starts_of_people(evidence: Evidence) -> Iterator[str]:
    """What is written on a person's behalf was ordered by that person: a start, which is answered in the same tick."""
    unheard, gap = dict[str, int](), Gap()
    for record in evidence.of(*KINDS, WriteIntended, people.PersonHeard):
        if gap.follow(record) or record.kind == guard.GuardStarted.kind:  # the answer may be lost with the guard
            unheard.clear()
        elif record.kind == people.PersonHeard.kind and word(record.fields.get("verb")) == Verb.START.value:
            unheard.pop(text(record, "person"), None)
        elif _for_a_person(record) and not gap.standing:
            unheard.setdefault(text(record, "source"), record.seq)
    if evidence.manifest is not None:
        for person, line in unheard.items():
            yield f"line {line}: this was written on behalf of {person!r}, who ordered no start"


def _for_a_person(record: Record) -> bool:
    """Whether ``record`` intends the first attempt at what a person has ordered."""
    first = record.kind == WriteIntended.kind and record.fields.get("attempt") == 1
    return first and word(record.fields.get("cause")) == Cause.PERSON.value


def releases(evidence: Evidence) -> Iterator[str]:
    """What the guard has confirmed of a request, recovery says to have released; and it says so of nothing else."""
    if next(evidence.of(guard.GuardStarted), None) is None:
        return
    confirmed, gap, owed = set[str](), Gap(), dict[str, Record]()
    begun, between = set[str](), {event.kind for event in _BETWEEN}
    afterwards_s = AFTERWARDS * max(evidence.tick_s, TICK_S)
    for record in evidence.of(*dict.fromkeys(chain(KINDS, _BETWEEN, _RELEASED))):
        if gap.follow(record):
            owed.clear()
        late = [r for r in owed.values() if record.at_s > r.at_s + afterwards_s]
        yield from map(_unsaid, late)
        owed = {digest: r for digest, r in owed.items() if r not in late}
        digest = text(record, "digest")
        if record.kind == WriteIntended.kind and word(record.fields.get("cause")) == Cause.REQUEST.value:
            begun.add(digest)
        elif record.kind == Resumed.kind:
            confirmed |= begun  # what became of a write that a dead guard had begun is read after it is told
        elif record.kind == guard.RequestAnswered.kind and word(record.fields.get("status")) == "confirmed":
            confirmed.add(digest)
            if not gap.standing:
                owed[digest] = record
        elif record.kind == ReleasedActions.kind:
            owed.pop(digest, None)
            if digest not in confirmed and not gap.excuses(record):
                yield f"line {record.seq}: {digest[:12]} is said to be released, and no request of it is confirmed"
        elif record.kind in between:
            owed.clear()


def _unsaid(record: Record) -> str:
    return f"line {record.seq}: request {text(record, 'request')!r} is confirmed, and nobody says that it was released"
