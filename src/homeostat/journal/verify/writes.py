"""The lives of writes in a journal: what may follow what, and who may write when."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from homeostat.domain.events.guard import GuardStarted, Stopped
from homeostat.domain.events.people import ModeEntered
from homeostat.domain.events.trips import FallbackActivated, Latched, LatchReset
from homeostat.domain.events.writes import ReadBack, WriteEnded, WriteIntended
from homeostat.journal.reading import Record
from homeostat.journal.verify.evidence import Evidence, whole, word
from homeostat.journal.verify.gaps import KINDS, Gap

_WATCHING: Final = frozenset({"observe", "advise"})
"""Modes in which nobody writes."""


@dataclass(slots=True)
class _Write:
    """A write as far as it has come."""

    attempt: int = 0
    """Number of the last one; 0 before the first."""
    ended: bool = True
    """Whether it has an outcome."""


def lives_of_writes(evidence: Evidence) -> Iterator[str]:
    """An intention before each attempt, one attempt in flight, attempts in order, a read-back after the end.

    What a gap has left open is known again with the first new write after it.
    """
    writes: dict[int, _Write] = {}
    gap, unsure = Gap(), False
    for record in evidence.of(*KINDS, WriteIntended, WriteEnded, ReadBack):
        ended = gap.follow(record)
        if ended or record.kind == GuardStarted.kind:  # what was in flight when the guard died is found by reading
            for write in writes.values():
                write.ended = True
        unsure = (unsure or ended) and not (record.kind == WriteIntended.kind and whole(record, "attempt") == 1)
        problems = tuple(_step(record, writes))
        if not (gap.standing or unsure):
            yield from problems


def _step(record: Record, writes: dict[int, _Write]) -> Iterator[str]:
    """What is wrong with the next event of a write."""
    number, attempt = whole(record, "write"), whole(record, "attempt")
    write = writes.get(number, _Write())
    match record.kind:
        case WriteIntended.kind:
            yield from _intended(record, number, attempt, writes)
        case WriteEnded.kind if number not in writes or attempt != write.attempt:
            yield f"line {record.seq}: attempt {attempt} at write {number} ended, and was never intended"
        case WriteEnded.kind if write.ended:
            yield f"line {record.seq}: attempt {attempt} at write {number} ended twice"
        case WriteEnded.kind:
            write.ended = True
        case ReadBack.kind if number not in writes:
            yield f"line {record.seq}: write {number} was read back, and never intended"
        case ReadBack.kind if not write.ended:
            yield f"line {record.seq}: write {number} was read back before its attempt {write.attempt} had ended"


def _intended(record: Record, number: int, attempt: int, writes: dict[int, _Write]) -> Iterator[str]:
    cause, write = word(record.fields.get("cause")), writes.setdefault(number, _Write())
    if attempt != write.attempt + 1:
        yield f"line {record.seq}: attempt {attempt} at write {number} follows attempt {write.attempt}"
    flying = next((n for n, w in writes.items() if not w.ended), None)
    if flying is not None and cause != "fallback":
        yield f"line {record.seq}: write {number} was intended while write {flying} was in flight"
    write.attempt, write.ended = attempt, False


@dataclass(slots=True)
class _Standing:
    """Who may write, as far as the journal has told."""

    mode: str = ""
    """The mode; empty where it is not known."""
    latched: int = 0
    """Line of the latch; 0 where there is none."""
    fell: bool = False
    """Whether a fallback has begun since."""
    stopped: int = 0
    """Line in which the guard was stopped; 0 while it runs."""


def writes_that_mode_or_latch_forbid(evidence: Evidence) -> Iterator[str]:
    """Nothing is written in observe and advise but a fallback that has begun, no request after the latch.

    And nothing at all after the guard was stopped.
    """
    now, gap = _Standing(), Gap()
    for record in evidence.of(*KINDS, ModeEntered, Latched, LatchReset, FallbackActivated, Stopped, WriteIntended):
        if gap.follow(record):
            now = _Standing()
        match record.kind:
            case GuardStarted.kind:
                now.mode, now.stopped = word(record.fields.get("mode")), 0
            case ModeEntered.kind:
                now.mode = word(record.fields.get("mode"))
            case Latched.kind:
                now.latched = record.seq
            case LatchReset.kind:
                now.latched, now.fell = 0, False
            case FallbackActivated.kind:
                now.fell = True
            case Stopped.kind:
                now.stopped = record.seq
            case WriteIntended.kind:
                problems = tuple(_forbidden(record, now))
                now.fell = now.fell or word(record.fields.get("cause")) == "fallback"
                if not gap.standing:
                    yield from problems


def _forbidden(record: Record, now: _Standing) -> Iterator[str]:
    cause = word(record.fields.get("cause"))
    if now.stopped:
        yield f"line {record.seq}: a {cause} was written after the guard was stopped in line {now.stopped}"
    if now.mode in _WATCHING and not (cause == "fallback" and (now.fell or now.latched)):
        yield f"line {record.seq}: a {cause} was written in mode {now.mode!r}, in which nobody writes"
    if now.latched and cause == "request":
        yield f"line {record.seq}: a request was written after the latch of line {now.latched} without a reset"
    if now.latched and cause == "sequence" and not now.fell:  # a fallback may have later steps
        yield f"line {record.seq}: a step was written after the latch of line {now.latched} without a fallback"
