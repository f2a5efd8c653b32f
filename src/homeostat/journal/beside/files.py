"""The files of a run directory: how they are named, described and written whole."""

import errno
import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

JOURNAL = "events.jsonl"
"""The journal of a run."""
MANIFEST = "manifest.json"
"""What closes a run; written last."""
RESULT = "result.json"
"""What a run came to."""


@dataclass(frozen=True, slots=True)
class StoredFile:
    """A file of a run as its manifest or an event names it."""

    name: str
    """Path relative to the run directory, with forward slashes."""
    size_bytes: int
    """Length [byte]."""
    sha256: str
    """SHA-256 of the content, in hexadecimal."""


def describe(path: Path, run_dir: Path) -> StoredFile:
    """Size and digest of a file as they are now; ValueError when it is not inside ``run_dir``."""
    with path.open("rb") as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        return StoredFile(path.relative_to(run_dir).as_posix(), file.tell(), sha256)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file that other readers see either not at all or whole, even after a power cut.

    Raises OSError, which names ``path``, where it cannot be written, or there is something that is no file.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():  # a device, say: what is renamed to its name would take its place
        raise FileExistsError(errno.EEXIST, "it is no file, and is not replaced by one", str(path))
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:  # it names the temporary file
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        temporary.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
