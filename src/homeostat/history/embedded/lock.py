"""One process at a time writes a store."""

import fcntl
import os
from pathlib import Path
from typing import Final

from homeostat.history.store import HistoryError

LOCK: Final = "lock"
"""File that whoever writes holds; it has the number of the process."""


def hold(store: Path) -> int:
    """A descriptor with the lock of ``store``, which ends with the process; HistoryError where another one has it."""
    file = os.open(store / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        holder = os.pread(file, 20, 0).decode("ascii", "replace").strip()
        os.close(file)
        who = f"process {holder}" if holder.isdigit() else "another process"
        text = f"the history in {str(store)!r} is written by {who}"
        raise HistoryError(f"{text}; end that one first, or choose another directory") from None
    os.ftruncate(file, 0)
    os.pwrite(file, f"{os.getpid()}\n".encode(), 0)
    return file
