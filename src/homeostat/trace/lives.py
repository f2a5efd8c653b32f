"""The lives of writes and requests in a journal: what may follow what."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from homeostat.domain.guard_events import (
    AlarmRaised,
    AlarmReturned,
    FellBack,
    GuardStarted,
    Latched,
    LatchReset,
    ModeEntered,
    RequestAnswered,
    SequenceLoaded,
)
from homeostat.domain.write_events import ReadBack, WriteEnded, WriteIntended
from homeostat.trace.evidence import Evidence, text, whole, word
from homeostat.trace.replay import Record

_FINAL: Final = frozenset({"confirmed", "failed", "advised", "refused", "withdrawn"})
"""Statuses after which nothing more is said of a request."""
_MAY_FOLLOW: Final = {
    "received": {"", *_FINAL},  # a name that is used again begins another life
    "authorised": {"", "received", *_FINAL},
    "verified": {"", "received", "authorised", "offered"},  # verified again after a person's yes
    "offered": {"received", "authorised", "verified"},
    "accepted": {"verified", "offered"},
    "confirmed": {"accepted"},
    "failed": {"accepted"},
    "advised": {"", "received", "authorised", "verified"},
    "refused": {"", "received", "authorised", "verified", "offered"},
    "withdrawn": {"", "received", "authorised", "verified", "offered", "accepted"},
}
"""Status of a request -> statuses that may come right before; empty for nothing."""
_DEAD: Final = frozenset({"refused", "withdrawn", "advised"})
"""Statuses after which nothing is sent for a request."""
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
    """An intention before each attempt, one attempt in flight, attempts in order, a read-back after the end."""
    if has_gaps(evidence):
        return
    writes: dict[int, _Write] = {}
    for record in evidence.of(GuardStarted.kind, WriteIntended.kind, WriteEnded.kind, ReadBack.kind):
        number, attempt = whole(record, "write"), whole(record, "attempt")
        write = writes.get(number, _Write())
        match record.kind:
            case GuardStarted.kind:  # what was in flight when the guard died is found out by reading
                for write in writes.values():
                    write.ended = True
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


def has_gaps(evidence: Evidence) -> bool:
    """Whether the guard says that its journal failed: then events are missing that were never written."""
    return any(text(record, "alarm") == "journal" for record in evidence.of(AlarmRaised.kind, AlarmReturned.kind))


def _intended(record: Record, number: int, attempt: int, writes: dict[int, _Write]) -> Iterator[str]:
    cause, write = word(record.fields.get("cause")), writes.setdefault(number, _Write())
    if attempt != write.attempt + 1:
        yield f"line {record.seq}: attempt {attempt} at write {number} follows attempt {write.attempt}"
    flying = next((n for n, w in writes.items() if not w.ended), None)
    if flying is not None and cause != "fallback":
        yield f"line {record.seq}: write {number} was intended while write {flying} was in flight"
    write.attempt, write.ended = attempt, False


@dataclass(slots=True)
class _Request:
    """A request as far as it has come."""

    status: str = ""
    """What was said of it last; empty for nothing."""
    digest: str = ""
    """Digest of its action set."""
    written: list[int] = field(default_factory=list)
    """Numbers of the writes for it."""
    accepted: int = 0
    """Line in which it was accepted last; 0 where it was not."""


def lives_of_requests(evidence: Evidence) -> Iterator[str]:
    """Answers in their order, none after the final one; nothing sent for a request that is dead, or is no request."""
    requests: dict[str, _Request] = {}
    confirmed: set[int] = set()
    loaded = {text(record, "source") for record in evidence.of(SequenceLoaded.kind)}
    if has_gaps(evidence):
        return
    for record in evidence.of(RequestAnswered.kind, WriteIntended.kind, ReadBack.kind):
        if record.kind == RequestAnswered.kind:
            yield from _answered(record, requests, confirmed)
        elif record.kind == WriteIntended.kind and word(record.fields.get("cause")) == "request":
            yield from _sent(record, requests.get(text(record, "source")))
        elif record.kind == ReadBack.kind and not record.fields.get("deviating"):
            confirmed.add(whole(record, "write"))
    for name, request in requests.items():
        if request.status == "confirmed" and not request.written and name not in loaded:
            yield f"line {request.accepted}: request {name!r} was accepted, and nothing was ever sent for it"


def _answered(record: Record, requests: dict[str, _Request], confirmed: set[int]) -> Iterator[str]:
    status, name, digest = word(record.fields.get("status")), text(record, "request"), text(record, "digest")
    if status == "refused" and not digest:  # something that is not the request whose name it bears
        return
    before = requests[name].status if name in requests else ""
    if before == "" or (before in _FINAL and status in ("received", "authorised")):
        requests[name] = _Request()
    request = requests[name]
    if status not in _MAY_FOLLOW:
        yield f"line {record.seq}: request {name!r} is {status!r}, which is no status"
    elif before not in _MAY_FOLLOW[status]:
        yield f"line {record.seq}: request {name!r} is {status!r} after {before or 'nothing'!r}"
    if request.digest and digest != request.digest:
        yield f"line {record.seq}: request {name!r} has digest {digest[:12]}, before it had {request.digest[:12]}"
    if status == "confirmed" and request.written and not confirmed & set(request.written):
        yield f"line {record.seq}: request {name!r} is confirmed, and no read-back says so"
    request.status, request.digest = status, digest
    request.accepted = record.seq if status == "accepted" else request.accepted


def _sent(record: Record, request: _Request | None) -> Iterator[str]:
    name, digest = text(record, "source"), text(record, "digest")
    if request is None:
        yield f"line {record.seq}: something was sent for request {name!r}, which nobody had made"
        return
    if request.status in _DEAD:
        yield f"line {record.seq}: something was sent for request {name!r} after it was {request.status}"
    if digest and digest != request.digest:
        yield f"line {record.seq}: digest {digest[:12]} was sent for request {name!r} of digest {request.digest[:12]}"
    request.written.append(whole(record, "write"))


def writes_that_mode_or_latch_forbid(evidence: Evidence) -> Iterator[str]:
    """Nothing is written in observe and advise but a fallback that has begun, and no request after the latch."""
    mode, latched, fell = "", 0, False
    for record in evidence.of(
        GuardStarted.kind, ModeEntered.kind, Latched.kind, LatchReset.kind, FellBack.kind, WriteIntended.kind
    ):
        match record.kind:
            case GuardStarted.kind | ModeEntered.kind:
                mode = word(record.fields.get("mode"))
            case Latched.kind:
                latched = record.seq
            case LatchReset.kind:
                latched, fell = 0, False
            case FellBack.kind:
                fell = True
            case WriteIntended.kind:
                cause = word(record.fields.get("cause"))
                if mode in _WATCHING and not (cause == "fallback" and (fell or latched)):
                    yield f"line {record.seq}: a {cause} was written in mode {mode!r}, in which nobody writes"
                if latched and cause == "request":
                    yield f"line {record.seq}: a request was written after the latch of line {latched} without a reset"
                fell = fell or cause == "fallback"
                if latched and cause == "sequence" and not fell:  # a fallback may have later steps
                    yield f"line {record.seq}: a step was written after the latch of line {latched} without a fallback"
