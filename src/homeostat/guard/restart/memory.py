"""Memory: what a journal says of the guard, so that a restart goes on where a death left it and repeats nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Protocol

from homeostat.domain.events.writes import Cause, WriteResult
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import Command
from homeostat.domain.request import RequestStatus
from homeostat.guard.fallback.trial import OF_TRIALS, Trial
from homeostat.guard.writing.flight import PUT_RIGHT

LOCAL = "local control"
"""Source of a position of the sequence that the plant's own control has brought about."""
REMEMBERED = 10_000
"""Requests and orders that are remembered as used, each, over restarts, too; older ones have expired long ago."""


class Recorded(Protocol):
    """One event as a journal holds it."""

    @property
    def kind(self) -> str:
        """The event's kind."""

    @property
    def fields(self) -> Mapping[str, Any]:
        """The event's fields in JSON form."""


@dataclass(frozen=True, slots=True)
class OpenWrite:
    """A write that was intended and not read back."""

    cause: Cause
    """On whose behalf."""
    source: str
    """Name of the request, strategy, transition or person."""
    commands: tuple[Command, ...]
    """What was to be sent."""
    state: str
    """State of the machine that they lead to."""
    steps: tuple[tuple[str, tuple[Command, ...]], ...]
    """What was to follow: transitions, each with its commands."""
    taken: bool
    """Whether the sequence has gone on behind it."""
    given_up: bool = False
    """Whether something overtook it; whatever it brings, the sequence does not go on behind it."""
    latched: bool = False
    """Whether it was begun under a latch: a step is the fallback's own then."""


@dataclass(frozen=True, slots=True)
class Memory:
    """Where the guard stood when its journal ends."""

    mode: Mode | None = None
    """Mode; None where the journal does not say."""
    latched: str | None = None
    """Why a fallback acted; None while none had."""
    strategy: str = ""
    """Fallback that acted last and is not known to stand; empty where none is."""
    untold: str = ""
    """Fallback that was read to stand without the journal saying so; empty where none is."""
    acted: str = ""
    """Fallback that acted last, whether or not it stands; empty where none has since the last reset."""
    spent: frozenset[str] = frozenset()
    """Fallbacks that have stood and not helped since the last reset."""
    state: str = ""
    """State of the machine; empty for the initial one."""
    waiting: tuple[tuple[str, tuple[Command, ...]], ...] | None = None
    """Transitions that wait, each with its commands; None for the nominal sequence."""
    aborting: bool = False
    """Whether they belong to a fallback."""
    released: bool = False
    """Whether they were released or belong to a fallback, and are not the nominal sequence."""
    starting_s: float | None = None
    """Process time at which the last start-up began [s]; None where none has."""
    started: bool = False
    """Whether its limits hold no more."""
    left: str | None = None
    """State that was left for the present one; None where it is known whether start-up began with that."""
    trial: Trial = field(default_factory=Trial)
    """How the fallbacks have fared."""
    out: frozenset[str] = frozenset()
    """Tags that were out of service."""
    targets: Mapping[str, float | None] = field(default_factory=dict)
    """Writable tag -> the target that the plant was last read to hold, in its unit; None for automatic."""
    writes: int = 0
    """Writes that were numbered."""
    open: Mapping[int, OpenWrite] = field(default_factory=dict)
    """Writes whose effect was not read back, by number."""
    last: OpenWrite | None = None
    """The write that was intended last."""
    owed: OpenWrite | None = None
    """A step that counts as taken, and that the plant was read not to hold; None where none is."""
    requests: tuple[str, ...] = ()
    """Requests that were authorised, the last ones."""
    act_by_s: float | None = None
    """Process time by which recovery must have acted [s]; None for no such time."""
    orders: tuple[str, ...] = ()
    """Orders of people that were answered, carried out or not, the last ones."""

    @classmethod
    def of(cls, events: Iterable[Recorded]) -> Memory:
        """What ``events``, in order, leave behind."""
        memory = cls()
        for event in events:
            fold = _FOLDS.get(event.kind)
            memory = memory if fold is None else fold(memory, event.fields)
            trial = memory.trial.fold(event.kind, event.fields)
            memory = memory if trial is memory.trial else replace(memory, trial=trial)
        return memory


def _commands(given: Any) -> tuple[Command, ...]:
    return tuple(Command(c["tag"], c["value"], c["rate"]) for c in given)


def _steps(given: Any) -> tuple[tuple[str, tuple[Command, ...]], ...]:
    return tuple((str(s["transition"]), _commands(s["commands"])) for s in given)


def _intended(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    """A fallback latches by its intention: whoever dies behind it must not come back unlatched."""
    number, cause, source = int(fields["write"]), Cause[fields["cause"]], str(fields["source"])
    before = memory.last if number == memory.writes else None
    paid = cause is Cause.SEQUENCE and memory.owed is not None and memory.owed.source == source
    taken = paid or (before is not None and before.taken)
    commands, state, steps = _commands(fields["commands"]), str(fields["state"]), _steps(fields["steps"])
    write = OpenWrite(cause, source, commands, state, steps, taken, latched=memory.latched is not None)
    owed = memory.owed if source == PUT_RIGHT else None
    memory = replace(memory, writes=number, open={**memory.open, number: write}, last=write, owed=owed)
    if cause is not Cause.FALLBACK or source == PUT_RIGHT:
        return memory
    if not taken:  # nothing that was to follow before a fallback follows after it
        memory = replace(memory, waiting=(), aborting=True)
    latched = memory.latched or f"fallback {source!r} was being written"
    return replace(memory, strategy=source, untold="", acted=source, latched=latched, act_by_s=None)


def _ended(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    if WriteResult[fields["result"]] is not WriteResult.GIVEN_UP:
        return memory
    return _marked(memory, given_up=True)


def _marked(memory: Memory, **marks: Any) -> Memory:
    """``memory`` with ``marks`` at the last write, of which there is one at a time."""
    if memory.last is None:
        return memory
    last, number = replace(memory.last, **marks), memory.writes
    opened = {number: last} if number in memory.open else {}
    return replace(memory, last=last, open={**memory.open, **opened})


def _read_back(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    """What was read to be carried out counts, also where the journal ends before it says what followed."""
    number, held = int(fields["write"]), not fields["deviating"]
    write = memory.open.get(number)
    memory = replace(memory, open={n: w for n, w in memory.open.items() if n != number})
    if write is None:
        return memory
    confirmed = {c.tag: c.value for c in write.commands if c.tag in fields["confirmed"]}
    memory = replace(memory, targets={**memory.targets, **confirmed})
    if not held:
        return _missed(memory, number, write)
    if write.cause is Cause.FALLBACK and write.source == memory.strategy:
        memory = replace(memory, strategy="", untold=write.source)
    if write.cause is Cause.REQUEST and not write.given_up:
        memory = replace(memory, act_by_s=None)
    if number != memory.writes or write.taken or write.given_up or write.source == PUT_RIGHT:
        return memory
    memory = _marked(memory, taken=True)
    if write.cause is Cause.SEQUENCE:
        return _step_taken(memory, {"transition": write.source, "state": write.state})
    aborting = write.cause is Cause.FALLBACK
    memory = _entered(memory, {"state": write.state})
    return replace(memory, waiting=write.steps, aborting=aborting, released=True)


def _missed(memory: Memory, number: int, write: OpenWrite) -> Memory:
    """A step that counts as taken is owed; nothing follows a request or a start that the plant does not hold."""
    if write.cause is Cause.SEQUENCE and write.taken and not write.given_up:
        return replace(memory, owed=write)
    if write.cause in (Cause.REQUEST, Cause.PERSON) and write.taken and number == memory.writes:
        return replace(_marked(memory, taken=False), waiting=())
    return memory


def _loaded(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    memory = _marked(memory, taken=True)
    steps, aborting = _steps(fields["steps"]), bool(fields["aborting"])
    memory = replace(_entered(memory, fields), waiting=steps, aborting=aborting, owed=None)
    found = fields["source"] in ("", LOCAL)  # nobody has started anything
    return replace(memory, released=bool(fields["source"]), left=None if found else memory.left)


def _step_taken(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    name = str(fields["transition"])
    if memory.waiting and memory.waiting[0][0] == name:
        memory = replace(memory, waiting=memory.waiting[1:])
    if memory.last is not None and memory.last.cause is Cause.SEQUENCE and memory.last.source == name:
        memory = _marked(memory, taken=True)
    return _entered(memory, fields)


def _entered(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    state = str(fields["state"])
    return memory if state == memory.state else replace(memory, state=state, left=memory.state)


def _served(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    tag = str(fields["tag"])
    return replace(memory, out=memory.out - {tag} if fields["in_service"] else memory.out | {tag})


def _reset(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    state = str(fields["state"])
    memory = replace(memory, waiting=(), aborting=False, released=False, owed=None, left=None)
    anew = replace(memory, latched=None, strategy="", untold="", acted="", spent=frozenset())
    return replace(anew, mode=Mode.OBSERVE, state=state)


def _stands(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    memory = replace(memory, untold="")
    return replace(memory, strategy="") if fields["strategy"] == memory.strategy else memory


def _armed(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    by_s = fields["act_by_s"]
    return replace(memory, act_by_s=None if by_s is None else float(by_s))


def _latched(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    waiting = memory.waiting if memory.aborting else ()
    return replace(memory, latched=str(fields["reason"]), waiting=waiting, act_by_s=None)


def _answered(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    """A seal is used once it was authorised; nothing follows behind a write whose request was answered with a no."""
    status, name = RequestStatus(fields["status"]), str(fields["request"])
    if status is RequestStatus.CONFIRMED:
        return replace(memory, act_by_s=None)
    if status is RequestStatus.AUTHORISED:
        return replace(memory, requests=(*memory.requests, name)[-REMEMBERED:])
    last = memory.last
    written = last is not None and last.cause is Cause.REQUEST and last.source == name
    if not written or status not in (RequestStatus.FAILED, RequestStatus.WITHDRAWN):
        return memory
    memory = _marked(memory, given_up=True)
    return replace(memory, waiting=()) if last is not None and last.taken else memory


def _mode_entered(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    """Where nobody writes no step is owed any more, also once somebody does again; a fallback's latch lasts."""
    mode = Mode(fields["mode"])
    memory = replace(memory, mode=mode)
    if mode.writes or memory.latched is not None:
        return memory
    opened = {n: replace(w, given_up=w.given_up or _stepped(w)) for n, w in memory.open.items()}
    last = memory.last
    if last is not None and _stepped(last):
        last = replace(last, given_up=True)
    return replace(memory, open=opened, last=last, owed=None)


def _stepped(write: OpenWrite) -> bool:
    """Whether ``write`` is a step that counts as taken."""
    return write.cause is Cause.SEQUENCE and write.taken


_FOLDS: Mapping[str, Any] = {
    "mode-entered": _mode_entered,
    "armed": _armed,
    "latched": _latched,
    "fallback-activated": lambda m, f: replace(m, latched=str(f["reason"]), acted=str(f["strategy"]), act_by_s=None),
    "fallback-stands": _stands,
    "fallback-ineffective": lambda m, f: replace(m, spent=m.spent | {str(f["strategy"])}) if f["acted"] else m,
    "latch-reset": _reset,
    "write-intended": _intended,
    "write-ended": _ended,
    "read-back": _read_back,
    "targets-held": lambda m, f: replace(m, targets={**m.targets, **f["targets"]}),
    "state-entered": _entered,
    "start-up-began": lambda m, f: replace(m, starting_s=float(f["since_s"]), started=False, left=None),
    "start-up-ended": lambda m, f: replace(m, started=True),
    "sequence-loaded": _loaded,
    "step-taken": _step_taken,
    "service-changed": _served,
    "request-answered": _answered,
    "person-heard": lambda m, f: replace(m, orders=(*m.orders, str(f["command"]))[-REMEMBERED:]),
}
FOLDED: Final = OF_TRIALS.union(_FOLDS)
"""Kinds of the events that it is made of."""
