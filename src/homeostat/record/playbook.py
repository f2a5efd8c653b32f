"""A playbook on disk: one entry a line, each with its own digest; what is no entry is told, and skipped."""

import fcntl
import hashlib
import json
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from homeostat.domain.playbook import Entry
from homeostat.journal.beside.lock import locked
from homeostat.journal.chain import digest
from homeostat.journal.encode import Json, canonical, encode_fields
from homeostat.record.decode import made_of

FORMAT: Final = 1
"""Version of a line's content, under the key of the same name."""
MOST_BYTES: Final = 8 * 2**20
"""Largest file that is read and written [byte]: some thousand entries."""
LONGEST: Final = 64 * 2**10
"""Longest line [byte]."""
WAIT_S: Final = 2.0
"""Longest wait for another process that adds to the same file [s]."""
TOLD: Final = 5
"""Lines that are told one by one; of more of them their number."""


class PlaybookError(ValueError):
    """A playbook cannot be used or added to; one line with the remedy."""


@dataclass(frozen=True, slots=True)
class Content:
    """What a playbook holds."""

    entries: tuple[Entry, ...]
    """Its entries, in order; of a release that was written before what came of it was known, the later line."""
    troubles: tuple[str, ...]
    """What in it is no entry, a sentence each."""
    raw: bytes
    """What was read."""

    @property
    def sha256(self) -> str:
        """Digest of what was read."""
        return hashlib.sha256(self.raw).hexdigest()


def read_playbook(path: Path) -> Content:
    """What the file at ``path`` holds; nothing where there is none yet.

    At most :data:`MOST_BYTES` are read. PlaybookError where it is no file or has no folder, OSError where it cannot be
    read.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # a pipe nobody writes to would be waited for
    except FileNotFoundError:
        if path.parent.is_dir():
            return Content((), (), b"")
        raise PlaybookError(f"playbook {str(path)!r} cannot be made: there is no such folder; make it first") from None
    try:
        _check_regular(descriptor, path)
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            return _content(file.read(MOST_BYTES + 1), path.name)
    finally:
        os.close(descriptor)


def _content(raw: bytes, name: str) -> Content:
    entries, troubles = list[Entry](), list[str]()
    lines = raw[:MOST_BYTES].splitlines()
    if len(raw) > MOST_BYTES:
        lines.pop()
        troubles.append(f"playbook {name!r} is longer than {MOST_BYTES} bytes; what follows is not read: split it")
    bad = []
    for number, line in enumerate(lines, 1):
        try:
            if line.strip():
                entries.append(_entry(line))
        except (LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RecursionError) as error:
            why = str(error) if isinstance(error, PlaybookError) else f"it is no entry ({type(error).__name__})"
            bad.append(f"playbook {name!r}, line {number}: {why}; it is skipped: remove it, or restore the file")
    troubles += bad[:TOLD]
    if len(bad) > TOLD:
        troubles.append(f"playbook {name!r}: {len(bad) - TOLD} more lines are no entries; they are skipped")
    known = {_release(entry) for entry in entries if entry.aftermath is not None}
    current = (entry for entry in entries if entry.aftermath is not None or _release(entry) not in known)
    return Content(tuple(current), tuple(troubles), raw)


def _release(entry: Entry) -> Entry:
    """``entry`` as it was when its commands were released."""
    return replace(entry, aftermath=None)


def _entry(line: bytes) -> Entry:
    if len(line) > LONGEST:
        raise PlaybookError(f"it is longer than {LONGEST} bytes")
    content: dict[str, Any] = json.loads(line)
    same = canonical(content).encode("ascii") == line.strip()  # 310e0 is 310.0, and nobody has written it
    found = content.pop("sha256")
    if content.get("format") != FORMAT:
        raise PlaybookError(f"it has format {content.get('format')!r}, this version reads {FORMAT}")
    if not same or digest(canonical(content).encode("ascii")) != found:
        raise PlaybookError("it is not what was written: its digest does not match")
    entry: Entry = made_of(Entry, content)
    return entry


def line_of(entry: Entry) -> bytes:
    """The line of ``entry``, with its end."""
    content: dict[str, Json] = {"format": FORMAT, **encode_fields(entry, "entry")}
    content["sha256"] = digest(canonical(content).encode("ascii"))
    return canonical(content).encode("ascii") + b"\n"


def add_to_playbook(path: Path, entries: Sequence[Entry]) -> int:
    """Add those of ``entries`` that the file at ``path`` does not hold yet; how many there were.

    The file is made where there is none. PlaybookError where it would grow beyond :data:`MOST_BYTES`, or another
    process holds it; OSError where the disk does not take it, and then nothing is added.
    """
    if not entries:
        return 0
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK, 0o644)
    try:
        _check_regular(descriptor, path)
        with _locked(descriptor, path):
            return _add(descriptor, path, map(line_of, entries))
    finally:
        os.close(descriptor)


def _add(descriptor: int, path: Path, lines: Iterable[bytes]) -> int:
    before = os.fstat(descriptor).st_size
    there = os.pread(descriptor, MOST_BYTES, 0)
    known = set(there.splitlines())
    fresh = [line for line in dict.fromkeys(lines) if line.rstrip(b"\n") not in known]
    left = b"".join(fresh)
    if left and there and not there.endswith(b"\n"):
        left = b"\n" + left  # a line that was cut off stays by itself
    if before + len(left) > MOST_BYTES:
        raise PlaybookError(
            f"playbook {str(path)!r} would be longer than {MOST_BYTES} bytes; nothing was added: begin another file"
        )
    try:
        while left:
            left = left[os.write(descriptor, left) :]
        os.fsync(descriptor)
    except OSError as error:
        with suppress(OSError):
            os.ftruncate(descriptor, before)
        raise OSError(error.errno, error.strerror, str(path)) from error
    return len(fresh)


@contextmanager
def _locked(descriptor: int, path: Path) -> Iterator[None]:
    """The file for this process alone; PlaybookError where another one does not give it back in time."""
    if not locked(descriptor, WAIT_S):
        text = f"playbook {str(path)!r} was in use for {WAIT_S:g} s"
        raise PlaybookError(f"{text}; nothing was added: wait, and run again")
    try:
        yield
    finally:
        fcntl.flock(descriptor, fcntl.LOCK_UN)


def _check_regular(descriptor: int, path: Path) -> None:
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        raise PlaybookError(f"playbook {str(path)!r} is no file; name one that 'homeostat playbook build' wrote")
