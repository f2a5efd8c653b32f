"""What guard and thinking tell each other, as bytes: the guard believes nothing that it cannot check.

Observations go to thinking, which takes the guard's word for everything. What comes back is JSON, made into types one
field at a time; transitions travel by name, and the guard takes them from its own tables.
"""

from __future__ import annotations

import io
import json
import pickle
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias

from homeostat.domain.events import deviations, foresight, recovery
from homeostat.domain.observation import (
    Arm,
    Correction,
    FallBack,
    Message,
    NoAction,
    Observation,
    Settled,
    Trouble,
    Withdraw,
)
from homeostat.domain.plant.state_machine import StateMachine, Transition
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.request import Request, Seal
from homeostat.journal import Event
from homeostat.journal.calls import ModelCalled
from homeostat.journal.encode import Json, canonical, encode, encode_fields
from homeostat.record.decode import made_of
from homeostat.record.events import declared

LARGEST: Final = 4_000_000
"""Longest message from thinking [byte]."""
_SHA256: Final = re.compile(r"([0-9a-f]{64})?")
_PLAIN: Final[Mapping[str, type]] = {
    kind.__name__: kind for kind in (Withdraw, Arm, NoAction, FallBack, Trouble, Settled)
}
"""Messages whose fields are numbers and texts."""
EVENTS: Final[Mapping[str, type[Event]]] = {
    ModelCalled.kind: ModelCalled,
    **{kind.kind: kind for module in (recovery, deviations, foresight) for kind in declared(module)},
}
"""Kinds of events that thinking may have journalled: none that a guard takes its position from."""


@dataclass(frozen=True, slots=True)
class Hello:
    """The first thing that thinking is told."""

    key: bytes
    """Key of the release check's seals."""
    configuration: str
    """Digest of the configuration that the guard has."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """An event for the journal."""

    event: Event
    """The event."""
    at_s: float
    """Process time at which it happened [s]."""


@dataclass(frozen=True, slots=True)
class Ready:
    """Thinking has loaded everything and watches."""

    process: int
    """Its number."""
    playbook: str = ""
    """Digest of the playbook that it begins with; empty for none."""


FromThinking: TypeAlias = Message | Recorded | Ready
Told: TypeAlias = Hello | Observation


class _Pickler(pickle.Pickler):
    """Leaves out what both sides have."""

    def persistent_id(self, given: Any) -> Any:
        if isinstance(given, StateMachine):
            return "machine", given.name
        return ("transition", given.name) if isinstance(given, Transition) else None


class _Unpickler(pickle.Unpickler):
    """Puts in what was left out."""

    def __init__(self, frame: bytes, machine: StateMachine) -> None:
        super().__init__(io.BytesIO(frame))
        self._machine = machine

    def persistent_load(self, name: Any) -> Any:
        what, called = name
        return self._machine if what == "machine" else _transition(self._machine, called)


def to_thinking(told: Told) -> bytes:
    """``told`` as it travels from the guard."""
    frame = io.BytesIO()
    _Pickler(frame, pickle.HIGHEST_PROTOCOL).dump(_once(told) if isinstance(told, Observation) else (told, None))
    return frame.getvalue()


def _once(seen: Observation) -> tuple[Observation, dict[str, float] | None]:
    """``seen`` without readings of its snapshot that are as they came, and those that are not: most are told once."""
    judged, came = seen.snapshot, seen.sample
    if judged is None or came is None or judged is came or list(judged.values) != list(came.values):
        return seen, None
    changed = {tag: value for tag, value in judged.values.items() if not _same(value, came.values[tag])}
    return replace(seen, snapshot=replace(judged, values={})), changed


def _same(one: float, other: float) -> bool:
    return one is other or (one == other and one != 0.0)  # a zero may have another sign


def from_guard(frame: bytes, machine: StateMachine) -> Told:
    """What the guard told; only for a frame that came from the guard, because it can have anything made."""
    told: Told
    told, changed = _Unpickler(frame, machine).load()
    if isinstance(told, Observation) and told.snapshot is not None and told.sample is not None and changed is not None:
        return replace(told, snapshot=replace(told.snapshot, values={**told.sample.values, **changed}))
    return told


def to_guard(said: FromThinking) -> bytes:
    """``said`` as it travels to the guard; TypeError for what does not."""
    match said:
        case Recorded(event, at_s):
            return _line({"event": event.kind, "at_s": encode(at_s), "fields": encode_fields(event, event.kind)})
        case Ready(process, playbook):
            return _line({"ready": process, "playbook": playbook})
        case Request():
            fields = {name: getattr(said, name) for name in ("id", "proposer", "state", "diagnosis", "configuration")}
            return _line(
                {"request": {**fields, "path": list(said.path)}, **_of(said.actions), "seal": encode(said.seal)}
            )
        case Correction():
            return _line({"correction": encode(said.errors)})
    if type(said).__name__ not in _PLAIN:
        raise TypeError(f"thinking may not send {type(said).__name__!r}")
    return _line({"message": type(said).__name__, "fields": encode_fields(said, type(said).__name__)})


def from_thinking(frame: bytes, machine: StateMachine) -> FromThinking:
    """What thinking said; ValueError, TypeError or LookupError where it is nothing that it may say."""
    said = json.loads(frame)
    if "event" in said:
        return Recorded(made_of(EVENTS[said["event"]], said["fields"]), float(said["at_s"]))
    if "ready" in said:
        return Ready(int(said["ready"]), _digest(said.get("playbook", "")))
    if "request" in said:
        return _request(said, machine)
    if "correction" in said:
        return Correction(tuple({str(tag): float(by) for tag, by in error.items()} for error in said["correction"]))
    message: Message = made_of(_PLAIN[said["message"]], said["fields"])
    return message


def _digest(text: str) -> str:
    """``text`` where it is a SHA-256 digest or empty; ValueError where it is not."""
    if _SHA256.fullmatch(text) is None:
        raise ValueError("a playbook has a digest of 64 hexadecimal digits")
    return text


def _request(said: Mapping[str, Any], machine: StateMachine) -> Request:
    given, then = said["request"], []
    for name, commands in said["then"]:
        then.append(Step(_transition(machine, name), made_of(tuple[Command, ...], commands)))
    texts = {name: made_of(str, given[name]) for name in ("id", "proposer", "state", "diagnosis", "configuration")}
    actions = ActionSet(made_of(tuple[Command, ...], said["commands"]), made_of(str, said["target"]), tuple(then))
    return Request(
        actions=actions, path=made_of(tuple[str, ...], given["path"]), seal=made_of(Seal, said["seal"]), **texts
    )


def _of(actions: ActionSet) -> dict[str, Json]:
    then: list[Json] = [[step.transition.name, encode(step.commands)] for step in actions.then]
    return {"commands": encode(actions.commands), "target": actions.target, "then": then}


def _transition(machine: StateMachine, name: str) -> Transition:
    found = next((t for t in machine.transitions if t.name == name), None)
    if found is None:
        raise LookupError(f"there is no transition {name!r}")
    return found


def _line(content: Mapping[str, Any]) -> bytes:
    return canonical(dict(content)).encode()
