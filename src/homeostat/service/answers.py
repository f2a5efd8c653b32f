"""Answers: what a run's journal says of an order, and which requests wait for a person."""

import fcntl
import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from homeostat.domain.events.guard import GuardStarted, RequestAnswered
from homeostat.domain.events.people import PersonHeard
from homeostat.domain.request import RequestStatus
from homeostat.journal.beside.files import JOURNAL, MANIFEST
from homeostat.journal.reading import Record, parse

_LOOK_S: Final = 0.1
_BLOCK: Final = 65_536


@dataclass(frozen=True, slots=True)
class Heard:
    """What came of an order."""

    done: bool
    """Whether it was carried out."""
    reason: str
    """Why not, who else must order it, or the person's own reason."""
    counts: bool = False
    """Whether it counts though it was not carried out: more people must order it."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A request that waits for a person."""

    request: str
    """Identifier of the request."""
    proposer: str
    """Who proposed it."""
    digest: str
    """Digest of its action set."""
    at_s: float
    """Process time from which it waits [s]."""
    void_s: float | None = None
    """Process time at which it is void [s]; None where the record is too old to say."""


TELLING: Final = frozenset({GuardStarted.kind, RequestAnswered.kind})
"""Kinds of the events that say what waits for a person."""


def waiting(events: Iterable[Record]) -> tuple[Waiting, ...]:
    """Requests that ``events``, in order, leave waiting for a person, the oldest first."""
    found: dict[str, Waiting] = {}
    for event in events:
        if event.kind == GuardStarted.kind:  # one that begins again knows of no request
            found.clear()
        if event.kind != RequestAnswered.kind:
            continue
        fields = event.fields
        request = str(fields["request"])
        if fields["status"] == RequestStatus.OFFERED.value:
            void_s = fields.get("void_s")
            named = request, str(fields["proposer"]), str(fields["digest"]), event.at_s
            found[request] = Waiting(*named, float(void_s) if isinstance(void_s, int | float) else None)
        else:
            found.pop(request, None)
    return tuple(found.values())


def length(run_dir: Path) -> int:
    """Bytes of the whole lines that the journal of ``run_dir`` has now: one that is being written may be taken away."""
    with (run_dir / JOURNAL).open("rb") as file:
        end = file.seek(0, os.SEEK_END)
        while end > 0:
            begin = max(0, end - _BLOCK)
            file.seek(begin)
            if (last := file.read(end - begin).rfind(b"\n")) >= 0:
                return begin + last + 1
            end = begin
    return 0


def wait_for(run_dir: Path, order: str, after: int, within_s: float) -> Heard | None:
    """What came of ``order``, which was given when the journal had ``after`` bytes.

    None where ``within_s`` [s] have passed, or the run has ended or was killed, without an answer.
    """
    deadline = time.monotonic() + within_s
    while True:
        # looked at before the lines: nothing is written after it
        over = (run_dir / MANIFEST).exists() or not is_written(run_dir)
        for event, end in _lines(run_dir / JOURNAL, after):
            after = end
            if event.kind == PersonHeard.kind and event.fields["command"] == order:
                fields, missing = event.fields, event.fields.get("missing", 0)
                return Heard(bool(fields["done"]), str(fields["reason"]), isinstance(missing, int) and missing > 0)
        if over or time.monotonic() >= deadline:
            return None
        time.sleep(_LOOK_S)


def is_written(run_dir: Path) -> bool:
    """Whether a process holds the journal of ``run_dir``: its lock ends with the process."""
    with (run_dir / JOURNAL).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False


def _lines(path: Path, after: int) -> Iterator[tuple[Record, int]]:
    """The whole lines of a journal behind its first ``after`` bytes, each with where it ends.

    What is no line of one is nobody's answer, and passed over.
    """
    with path.open("rb") as file:
        file.seek(after)
        for line in file:
            if not line.endswith(b"\n"):
                return
            after += len(line)
            try:
                record = parse(line[:-1])
            except (ValueError, RecursionError):
                continue
            yield record, after
