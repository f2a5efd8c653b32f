"""Memory: what a journal says of the guard, so that a restart goes on where a death left it and repeats nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from homeostat.domain.guard_events import Cause
from homeostat.domain.mode import Mode
from homeostat.domain.recovery import Command

PUT_RIGHT = "put right"
"""Source of a write that puts right what came late; it belongs to no strategy."""


class Recorded(Protocol):
    """One event as a journal holds it."""

    @property
    def kind(self) -> str:
        """The event's kind."""
        ...

    @property
    def fields(self) -> Mapping[str, Any]:
        """The event's fields in JSON form."""
        ...


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


@dataclass(frozen=True, slots=True)
class Memory:
    """Where the guard stood when its journal ends."""

    mode: Mode | None = None
    """Mode; None where the journal does not say."""
    latched: str | None = None
    """Why a fallback acted; None while none had."""
    strategy: str = ""
    """Fallback that acted last and is not known to stand; empty where none is."""
    state: str = ""
    """State of the machine; empty for the initial one."""
    waiting: tuple[tuple[str, tuple[Command, ...]], ...] | None = None
    """Transitions that wait, each with its commands; None for the nominal sequence."""
    aborting: bool = False
    """Whether they belong to a fallback."""
    out: frozenset[str] = frozenset()
    """Tags that were out of service."""
    writes: int = 0
    """Writes that were numbered."""
    open: Mapping[int, OpenWrite] = field(default_factory=dict)
    """Writes whose effect was not read back, by number."""

    @classmethod
    def of(cls, events: Iterable[Recorded]) -> Memory:
        """What ``events``, in order, leave behind."""
        memory = cls()
        for event in events:
            fold = _FOLDS.get(event.kind)
            memory = memory if fold is None else fold(memory, event.fields)
        return memory


def _commands(given: Any) -> tuple[Command, ...]:
    return tuple(Command(c["tag"], c["value"], c["rate"]) for c in given)


def _steps(given: Any) -> tuple[tuple[str, tuple[Command, ...]], ...]:
    return tuple((str(s["transition"]), _commands(s["commands"])) for s in given)


def _intended(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    """A fallback latches by its intention: whoever dies behind it must not come back unlatched."""
    number, cause, source = int(fields["write"]), Cause[fields["cause"]], str(fields["source"])
    write = OpenWrite(cause, source, _commands(fields["commands"]), str(fields["state"]), _steps(fields["steps"]))
    memory = replace(memory, writes=max(memory.writes, number), open={**memory.open, number: write})
    if cause is not Cause.FALLBACK or source == PUT_RIGHT:
        return memory
    return replace(memory, strategy=source, latched=memory.latched or f"fallback {source!r} was being written")


def _read_back(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    return replace(memory, open={n: c for n, c in memory.open.items() if n != int(fields["write"])})


def _loaded(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    aborting = bool(fields["aborting"])
    return replace(memory, state=str(fields["state"]), waiting=_steps(fields["steps"]), aborting=aborting)


def _step_taken(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    name = str(fields["transition"])
    if memory.waiting and memory.waiting[0][0] == name:
        memory = replace(memory, waiting=memory.waiting[1:])
    return replace(memory, state=str(fields["state"]))


def _served(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    tag = str(fields["tag"])
    return replace(memory, out=memory.out - {tag} if fields["in_service"] else memory.out | {tag})


def _reset(memory: Memory, fields: Mapping[str, Any]) -> Memory:
    return replace(memory, latched=None, strategy="", state=str(fields["state"]), waiting=(), aborting=False)


_FOLDS: Mapping[str, Any] = {
    "mode-entered": lambda m, f: replace(m, mode=Mode(f["mode"])),
    "latched": lambda m, f: replace(m, latched=str(f["reason"])),
    "fell-back": lambda m, f: replace(m, strategy=str(f["strategy"]), latched=str(f["reason"])),
    "fallback-stands": lambda m, f: replace(m, strategy=""),
    "latch-reset": _reset,
    "write-intended": _intended,
    "read-back": _read_back,
    "state-entered": lambda m, f: replace(m, state=str(f["state"])),
    "sequence-loaded": _loaded,
    "step-taken": _step_taken,
    "service-changed": _served,
}
