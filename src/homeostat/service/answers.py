"""Answers: what a run's journal says of an order, and which requests wait for a person."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Protocol

from homeostat.domain.guard_events import PersonHeard, RequestAnswered
from homeostat.domain.request import RequestStatus
from homeostat.trace.decisions import Attempted
from homeostat.trace.files import JOURNAL, MANIFEST
from homeostat.trace.replay import parse

_LOOK_S: Final = 0.1


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
class Heard:
    """What came of an order."""

    done: bool
    """Whether it was carried out."""
    reason: str
    """Why not, or the person's own reason."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A request that waits for a person."""

    request: str
    """Identifier of the request."""
    proposer: str
    """Who proposed it."""
    digest: str
    """Digest of its action set."""
    commands: tuple[Mapping[str, Any], ...]
    """Its first commands, each with ``tag``, ``value`` and ``rate``; empty where the journal does not have them."""
    findings: tuple[Mapping[str, Any], ...]
    """What was checked before, each with ``criterion``, ``margin`` and ``unit``."""


def waiting(events: Iterable[Recorded]) -> tuple[Waiting, ...]:
    """Requests that ``events``, in order, leave waiting for a person, the oldest first."""
    attempts: dict[str, Mapping[str, Any]] = {}
    found: dict[str, Waiting] = {}
    for event in events:
        fields = event.fields
        if event.kind == Attempted.kind:
            attempts[str(fields["digest"])] = fields
        elif event.kind == RequestAnswered.kind and fields["status"] == RequestStatus.OFFERED.value:
            known = attempts.get(str(fields["digest"]), {"commands": (), "findings": ()})
            found[str(fields["request"])] = Waiting(
                str(fields["request"]), str(fields["proposer"]), str(fields["digest"]),
                tuple(known["commands"]), tuple(known["findings"]),
            )  # fmt: skip
        elif event.kind == RequestAnswered.kind:
            found.pop(str(fields["request"]), None)
    return tuple(found.values())


def length(run_dir: Path) -> int:
    """Bytes that the journal of ``run_dir`` has now."""
    return (run_dir / JOURNAL).stat().st_size


def wait_for(run_dir: Path, order: str, after: int, within_s: float) -> Heard | None:
    """What came of ``order``, which was given when the journal had ``after`` bytes.

    None where ``within_s`` [s] have passed, or the run has ended, without an answer.
    """
    deadline = time.monotonic() + within_s
    while True:
        over = (run_dir / MANIFEST).exists()  # looked at before the lines: nothing is written after it
        for event, end in _lines(run_dir / JOURNAL, after):
            after = end
            if event.kind == PersonHeard.kind and event.fields["command"] == order:
                return Heard(bool(event.fields["done"]), str(event.fields["reason"]))
        if over or time.monotonic() >= deadline:
            return None
        time.sleep(_LOOK_S)


def _lines(path: Path, after: int) -> Iterator[tuple[Recorded, int]]:
    """The whole lines of a journal behind its first ``after`` bytes, each with where it ends."""
    with path.open("rb") as file:
        file.seek(after)
        for line in file:
            if not line.endswith(b"\n"):
                return
            after += len(line)
            yield parse(line[:-1]), after
