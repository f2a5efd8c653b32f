"""Reading a journal back, with its chain verified line by line."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from homeostat.journal.beside.files import JOURNAL
from homeostat.journal.chain import GENESIS, HAPPENED, HEADER, digest
from homeostat.journal.encode import Json, canonical

FORMER: Final = {"departed": "deviated", "left-as-is": "no-action", "fell-back": "fallback-activated"}
"""Name of an event before format 3 -> its name."""
_HEAD: Final = re.compile(
    rb'\{"seq":([1-9][0-9]{0,17}),"prev":"([0-9a-f]{64})","at_s":-?[0-9][0-9.e+-]*,"event":"([^"\\\\]+)"'
)


class BrokenChain(ValueError):
    """The journal is not what was written; the message says where."""

    def __init__(self, problem: str, verified: int) -> None:
        super().__init__(problem)
        self.verified = verified
        """Number of lines that a later line confirms."""


@dataclass(frozen=True, slots=True)
class Record:
    """One event as the journal holds it."""

    seq: int
    """Position in the run, from 1."""
    at_s: float
    """Process time of the line [s]; never less than that of the line before."""
    kind: str
    """The event's kind."""
    fields: Mapping[str, Json]
    """The event's fields in JSON form: enums by name, nested records as objects with ``@type``."""
    happened_s: float
    """Process time at which it happened [s]; before ``at_s`` where it was recorded late."""


@dataclass(frozen=True, slots=True)
class Line:
    """A verified line: what it says and its bytes."""

    record: Record
    """What it says."""
    raw: bytes
    """Its bytes without the newline."""


@dataclass(frozen=True, slots=True)
class Skimmed:
    """A line that follows, and was read where somebody asked for its kind."""

    record: Record | None
    """What it says; None where nobody asked."""
    raw: bytes
    """Its bytes without the newline."""
    digest: str
    """What the next line must carry."""


def read_events(run_dir: Path | str, kinds: Collection[str] | None = None) -> Iterator[Record]:
    """The events of the run in ``run_dir``, in order; where ``kinds`` are given those of these, and the last one.

    Stops before a torn last line, which a killed run may leave; `homeostat.journal.verify` tells whether the run is
    complete. Raises FileNotFoundError where there is no journal, BrokenChain at the first line that does not follow.
    """
    path = Path(run_dir) / JOURNAL
    if kinds is None:
        return (line.record for line in scan(path))
    return (line.record for line in skim(path, kinds) if line.record is not None)


def scan(path: Path) -> Iterator[Line]:
    """The whole lines of a journal file, each checked against the one before; BrokenChain at the first that fails."""
    last = GENESIS
    with path.open("rb") as file:
        for number, ended in enumerate(file, start=1):
            if not ended.endswith(b"\n"):
                return
            raw = ended[:-1]
            record = follow(number, raw, last)
            last = digest(raw)
            yield Line(record, raw)


def skim(path: Path, kinds: Collection[str]) -> Iterator[Skimmed]:
    """As :func:`scan`, of a long journal of which only some ``kinds`` are wanted: of the rest the chain is followed.

    The last line is read whatever it is: no other confirms it. That the rest is written as a run writes it is not
    looked at; the digest that the next line carries is.
    """
    last, number, asked = GENESIS, 0, frozenset(kinds)
    with path.open("rb") as file:
        ended = file.readline()
        while ended.endswith(b"\n"):
            raw, ended, number = ended[:-1], file.readline(), number + 1
            head = _HEAD.match(raw)
            skipped = (
                head is not None
                and ended.endswith(b"\n")
                and int(head[1]) == number
                and head[2].decode() == last
                and FORMER.get(kind := head[3].decode("ascii", "replace"), kind) not in asked
            )
            record = None if skipped else follow(number, raw, last)
            last = digest(raw)
            wanted = record is None or record.kind in asked or not ended.endswith(b"\n")
            yield Skimmed(record if wanted else None, raw, last)


def parse(line: bytes) -> Record:
    """One line of a journal without its chain; ValueError when it is none."""
    return _parts(line)[0]


def follow(number: int, raw: bytes, last: str) -> Record:
    """The record of line ``number`` if the line follows one whose digest is ``last``; else BrokenChain."""
    confirmed = max(number - 2, 0)  # nothing confirms the line before this one unless this one is sound
    try:
        record, prev = _parts(raw)
    except (ValueError, RecursionError):
        raise BrokenChain(f"line {number} is not a line that a run writes: it was altered", confirmed) from None
    if record.seq != number:
        problem = f"line {number} carries number {record.seq}: a line was removed, added, moved or altered"
        raise BrokenChain(problem, confirmed)
    if prev != last:
        before = f"line {number - 1}" if number > 1 else "the start of a run"
        raise BrokenChain(f"line {number} does not follow {before}: one was altered", confirmed)
    return record


def _parts(line: bytes) -> tuple[Record, str]:
    content = json.loads(line)
    if not isinstance(content, dict) or tuple(content)[: len(HEADER)] != HEADER:
        raise ValueError(f"a line must be an object that starts with {', '.join(HEADER)}")
    if canonical(content).encode("ascii") != line:  # a key twice, a number that is none, blanks
        raise ValueError("a line must be written as a run writes it")
    seq, prev, at_s, kind = (content.pop(name) for name in HEADER)
    kind = FORMER.get(kind, kind) if type(kind) is str else kind
    happened_s = content.pop(HAPPENED, at_s)
    if type(seq) is not int or type(prev) is not str or type(at_s) is not float or type(kind) is not str:
        raise ValueError(f"line {seq!r}: {', '.join(HEADER)} must be an integer, a text, a number and a text")
    if type(happened_s) is not float:
        raise ValueError(f"line {seq!r}: {HAPPENED} must be a number")
    return Record(seq, at_s, kind, MappingProxyType(content), happened_s), prev
