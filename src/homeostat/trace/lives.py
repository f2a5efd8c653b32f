"""The lives of writes and requests in a journal: what may follow what."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from homeostat.domain.guard_events import (
    FallbackStands,
    FellBack,
    GuardStarted,
    Latched,
    LatchReset,
    ModeEntered,
    ReadBack,
    RequestAnswered,
    WriteEnded,
    WriteIntended,
)
from homeostat.trace.evidence import Evidence, text, whole, word
from homeostat.trace.replay import Record

_MAY_FOLLOW: Final = {
    "received": {""},
    "authorised": {"", "received"},
    "verified": {"", "received", "authorised", "offered"},  # verified again after a person's yes
    "offered": {"verified"},
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
    """Line in which it was accepted; 0 where it was not."""


def lives_of_requests(evidence: Evidence) -> Iterator[str]:
    """Answers in their order, none after the final one; nothing sent for a request that is dead, or is no request."""
    requests: dict[str, _Request] = {}
    confirmed: set[int] = set()
    for record in evidence.of(RequestAnswered.kind, WriteIntended.kind, ReadBack.kind):
        if record.kind == RequestAnswered.kind:
            yield from _answered(record, requests.setdefault(text(record, "request"), _Request()), confirmed)
        elif record.kind == WriteIntended.kind and word(record.fields.get("cause")) == "request":
            yield from _sent(record, requests.get(text(record, "source")))
        elif record.kind == ReadBack.kind and not record.fields.get("deviating"):
            confirmed.add(whole(record, "write"))
    for name, request in requests.items():
        if request.accepted and not request.written and request.status == "confirmed":
            yield f"line {request.accepted}: request {name!r} was accepted, and nothing was ever sent for it"


def _answered(record: Record, request: _Request, confirmed: set[int]) -> Iterator[str]:
    status, name, digest = word(record.fields.get("status")), text(record, "request"), text(record, "digest")
    before = request.status
    if status not in _MAY_FOLLOW:
        yield f"line {record.seq}: request {name!r} is {status!r}, which is no status"
    elif before not in _MAY_FOLLOW[status]:
        yield f"line {record.seq}: request {name!r} is {status!r} after {before or 'nothing'!r}"
    if request.digest and digest != request.digest:
        yield f"line {record.seq}: request {name!r} has digest {digest[:12]}, before it had {request.digest[:12]}"
    if status == "confirmed" and request.written and not confirmed & set(request.written):
        yield f"line {record.seq}: request {name!r} is confirmed, and no read-back says so"
    request.status, request.digest = status, digest
    request.accepted = request.accepted or (record.seq if status == "accepted" else 0)


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
    """Nothing is written in observe and advise, and no request after the latch, but a fallback until it stands."""
    mode, latched, falling, fell = "", 0, False, False
    for record in evidence.of(
        GuardStarted.kind, ModeEntered.kind, Latched.kind, LatchReset.kind, FellBack.kind, FallbackStands.kind,
        WriteIntended.kind,
    ):  # fmt: skip
        match record.kind:
            case GuardStarted.kind | ModeEntered.kind:
                mode = word(record.fields.get("mode"))
            case Latched.kind:
                latched = record.seq
            case LatchReset.kind:
                latched, falling, fell = 0, False, False
            case FellBack.kind:
                falling = fell = True
            case FallbackStands.kind:
                falling = False
            case WriteIntended.kind:
                cause = word(record.fields.get("cause"))
                if mode in _WATCHING and not (falling and cause == "fallback"):
                    yield f"line {record.seq}: a {cause} was written in mode {mode!r}, in which nobody writes"
                if latched and cause == "request":
                    yield f"line {record.seq}: a request was written after the latch of line {latched} without a reset"
                if latched and cause == "sequence" and not fell:  # a fallback may have later steps
                    yield f"line {record.seq}: a step was written after the latch of line {latched} without a fallback"
