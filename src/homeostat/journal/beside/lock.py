"""A file, or a folder, for one process alone, which is waited for and not for ever."""

import fcntl
import time
from typing import Final

_AGAIN_S: Final = 0.02
"""Wait before a lock is tried again, wall-clock [s]."""


def locked(descriptor: int, within_s: float) -> bool:
    """Lock what ``descriptor`` is open on; False where another one has had it for ``within_s`` [s].

    The lock ends with the descriptor. OSError where it cannot be locked at all.
    """
    end = time.monotonic() + within_s
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= end:
                return False
            time.sleep(_AGAIN_S)
        else:
            return True
