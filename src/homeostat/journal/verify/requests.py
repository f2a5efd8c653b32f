"""The lives of requests in a journal: what may be said of one after what, who agreed to it, what came of it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from homeostat.domain.events import guard, people, trips
from homeostat.domain.events.writes import ReadBack, WriteIntended
from homeostat.journal.encode import Json
from homeostat.journal.reading import Record
from homeostat.journal.verify.evidence import Evidence, text, whole, word
from homeostat.journal.verify.gaps import KINDS, Gap

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
    offered: bool = False
    """Whether it was shown to a person."""
    agreed: bool = False
    """Whether a person has said yes to it since."""


@dataclass(slots=True)
class _Sent:
    """What was sent with one write, and what the plant has taken of it."""

    cause: str
    """On whose behalf."""
    source: str
    """Name of the request or strategy."""
    tags: frozenset[str]
    """Tags that the last attempt commands."""
    confirmed: bool = False
    """Whether the plant was read back and holds all of it."""


@dataclass(slots=True)
class _Told:
    """What a journal has told so far."""

    mode: str = ""
    """The mode; empty where it is not known."""
    requests: dict[str, _Request] = field(default_factory=dict)
    """Requests by name."""
    sent: dict[int, _Sent] = field(default_factory=dict)
    """Writes by number."""
    out: set[str] = field(default_factory=set)
    """Tags that are out of service."""


def lives_of_requests(evidence: Evidence) -> Iterator[str]:
    """Answers in their order, none after the final one; nothing sent for a request that is dead, or is no request."""
    told, gap = _Told(), Gap()
    loaded = {text(record, "source") for record in evidence.of(guard.SequenceLoaded)}
    ordered = (people.ModeEntered, people.PersonHeard, people.ServiceChanged)
    for record in evidence.of(*KINDS, *ordered, guard.RequestAnswered, WriteIntended, ReadBack, trips.FallbackStands):
        if gap.follow(record):  # nobody knows what was said meanwhile
            told.requests.clear()
        problems = tuple(_step(record, told))
        if not gap.excuses(record):
            yield from problems
    for name, request in told.requests.items():
        if request.status == "confirmed" and request.accepted and not request.written and name not in loaded:
            yield f"line {request.accepted}: request {name!r} was accepted, and nothing was ever sent for it"


def _step(record: Record, told: _Told) -> Iterator[str]:
    """What is wrong with the next event; what it says is kept."""
    cause = word(record.fields.get("cause"))
    match record.kind:
        case "guard-started" | "mode-entered":
            told.mode = word(record.fields.get("mode"))
        case people.PersonHeard.kind:
            _heard(record, told)
        case people.ServiceChanged.kind:
            change = told.out.discard if record.fields.get("in_service") else told.out.add
            change(text(record, "tag"))
        case guard.RequestAnswered.kind:
            yield from _answered(record, told)
        case WriteIntended.kind:
            tags = _tags(record.fields.get("commands"))
            told.sent[whole(record, "write")] = _Sent(cause, text(record, "source"), tags)
            if cause == "request":
                yield from _sent(record, told.requests.get(text(record, "source")))
        case ReadBack.kind if (sent := told.sent.get(whole(record, "write"))) is not None:
            confirmed, deviating = (_names(record.fields.get(k)) for k in ("confirmed", "deviating"))
            sent.confirmed = sent.confirmed or (not deviating and sent.tags <= confirmed | told.out)
        case trips.FallbackStands.kind:
            strategy = text(record, "strategy")
            if not any(s.confirmed for s in told.sent.values() if (s.cause, s.source) == ("fallback", strategy)):
                yield f"line {record.seq}: fallback {strategy!r} stands, and no read-back says so"


def _heard(record: Record, told: _Told) -> None:
    request = told.requests.get(text(record, "subject"))
    if request is not None and word(record.fields.get("verb")) == "approve" and record.fields.get("done") is True:
        request.agreed = request.offered


def _answered(record: Record, told: _Told) -> Iterator[str]:
    requests = told.requests
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
    if status == "accepted" and told.mode == "approve" and not request.agreed:
        why = "nobody said yes to it" if request.offered else "it was offered to nobody"
        yield f"line {record.seq}: request {name!r} is accepted in mode 'approve', and {why}"
    if status == "confirmed" and request.written and not any(told.sent[n].confirmed for n in request.written):
        yield f"line {record.seq}: request {name!r} is confirmed, and no read-back says so"
    request.status, request.digest = status, digest
    request.offered = request.offered or status == "offered"
    request.accepted = record.seq if status == "accepted" else request.accepted


def _sent(record: Record, request: _Request | None) -> Iterator[str]:
    name, digest = text(record, "source"), text(record, "digest")
    if request is None:
        yield f"line {record.seq}: something was sent for request {name!r}, which nobody had made"
        return
    if request.status in _DEAD:
        yield f"line {record.seq}: something was sent for request {name!r} after it was {request.status}"
    elif request.status not in ("accepted", "failed", "confirmed"):
        yield f"line {record.seq}: something was sent for request {name!r} before it was accepted"
    if digest and digest != request.digest:
        yield f"line {record.seq}: digest {digest[:12]} was sent for request {name!r} of digest {request.digest[:12]}"
    request.written.append(whole(record, "write"))


def accepted_in_gaps(evidence: Evidence) -> Iterator[str]:
    """While the guard's alarm of its journal stands it releases nothing; the tick that ends the alarm may."""
    gap, waiting = Gap(), list[Record]()
    for record in evidence.of(*KINDS, guard.RequestAnswered):
        if gap.follow(record) and record.kind != "guard-started":
            waiting = [r for r in waiting if r.happened_s < record.happened_s]
        answered = record.kind == guard.RequestAnswered.kind
        if gap.standing and answered and word(record.fields.get("status")) == "accepted":
            waiting.append(record)
        if not gap.standing:
            yield from _released_in_gap(waiting)
            waiting = []
    yield from _released_in_gap(waiting)


def _released_in_gap(accepted: list[Record]) -> Iterator[str]:
    for record in accepted:
        yield f"line {record.seq}: request {text(record, 'request')!r} was accepted while the journal did not work"


def _tags(commands: Json) -> frozenset[str]:
    rows = commands if isinstance(commands, list) else []
    return frozenset(str(row.get("tag")) for row in rows if isinstance(row, dict))


def _names(given: Json) -> frozenset[str]:
    return frozenset(map(str, given)) if isinstance(given, list) else frozenset()
