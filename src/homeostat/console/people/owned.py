"""Small files that their owner alone may use: read only where that is so, and replaced as a whole."""

from __future__ import annotations

import errno
import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final, TypeVar

from homeostat.journal.beside.lock import locked

_T = TypeVar("_T")
_LARGEST: Final = 10_000_000
LOCKED_S: Final = 5.0
"""Longest wait for who else has the folder locked, wall-clock [s]: whoever may read a folder can lock it for ever."""


class NotOwned(ValueError):
    """A file is open to others than its owner, is no file, or does not say what it should; one line with the remedy."""


@contextmanager
def reading(path: Path) -> Iterator[BinaryIO]:
    """The file at ``path``, to be read; OSError where it cannot be opened, NotOwned where others could use it."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    with os.fdopen(descriptor, "rb") as file:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode) or found.st_mode & 0o077 or found.st_uid not in (os.getuid(), 0):
            raise NotOwned(f"{str(path)!r} must be a file that its owner alone can use: chmod 600")
        yield file


def mapping(path: Path, kind: type[_T], says: str) -> dict[str, _T]:
    """What the JSON file at ``path`` keeps by name, each of ``kind``; nothing where there is no such file yet.

    NotOwned where it cannot be used; ``says`` is what it should say, and the remedy where there is one.
    """
    try:
        with reading(path) as file:
            found = json.loads(file.read(_LARGEST))
    except FileNotFoundError:
        return {}
    except NotOwned:
        raise
    except OSError as error:
        raise NotOwned(str(error)) from error
    except (ValueError, RecursionError) as error:
        raise NotOwned(f"{str(path)!r} does not say {says}") from error
    if not isinstance(found, dict) or not all(isinstance(value, kind) for value in found.values()):
        raise NotOwned(f"{str(path)!r} does not say {says}")
    return found


@contextmanager
def changing(path: Path) -> Iterator[None]:
    """Nobody else changes the file at ``path`` meanwhile; OSError where its folder cannot be used, or stays locked."""
    descriptor = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        if not locked(descriptor, LOCKED_S):
            why = f"another process has kept its folder locked for {LOCKED_S:g} s"
            raise TimeoutError(errno.ETIMEDOUT, why, str(path))
        yield
    finally:
        os.close(descriptor)


def replace(path: Path, content: bytes) -> None:
    """Write ``content`` to ``path`` for its owner alone, all of it or nothing; OSError where that cannot be done.

    Nobody else changes it meanwhile: it is called within :func:`changing`.
    """
    fresh = path.with_name(f".{path.name}.{os.getpid()}.partial")
    fresh.unlink(missing_ok=True)  # of a process that was killed over it; in a container the next one has its number
    descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    finally:
        fresh.unlink(missing_ok=True)
