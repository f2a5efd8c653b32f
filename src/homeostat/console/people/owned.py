"""Small files that their owner alone may use: read only where that is so, and replaced as a whole."""

from __future__ import annotations

import fcntl
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


class NotOwned(ValueError):
    """A file is open to others than its owner, or is no file; one line with the remedy."""


@contextmanager
def reading(path: Path) -> Iterator[BinaryIO]:
    """The file at ``path``, to be read; OSError where it cannot be opened, NotOwned where others could use it."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with os.fdopen(descriptor, "rb") as file:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode) or found.st_mode & 0o077 or found.st_uid not in (os.getuid(), 0):
            raise NotOwned(f"{str(path)!r} must be a file that its owner alone can use: chmod 600")
        yield file


@contextmanager
def changing(path: Path) -> Iterator[None]:
    """Nobody else changes the file at ``path`` meanwhile; OSError where its folder cannot be used."""
    descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def replace(path: Path, content: bytes) -> None:
    """Write ``content`` to ``path`` for its owner alone, all of it or nothing; OSError where that cannot be done."""
    fresh = path.with_name(f".{path.name}.{os.getpid()}.partial")
    descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)
