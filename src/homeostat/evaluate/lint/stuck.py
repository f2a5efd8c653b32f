"""Whether a process hangs, and in which line of a plant's code.

It is asked by a signal, and its frames are read from a file. A process that has too little of a busy machine is slow
and does not hang: silence is counted by what it computes.
"""

from __future__ import annotations

import faulthandler
import os
import re
import signal
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

ASKED_S: Final = 2.0
"""Longest wait for the frames [s]."""
HELD_UP: Final = 0.8
"""Share of its limit that a process may compute in silence [1]: whoever starts it also takes some of the time."""
WAITS: Final = 0.025
"""Share of a silence that it has computed at most if it waits for something [1]."""
_FRAME: Final = re.compile(r'^  File "(?P<file>.+)", line (?P<line>\d+) in ', re.MULTILINE)


def hangs(pid: int | None, said: Connection, limit_s: float) -> bool:
    """Wait until the process says something, or ends; whether it hangs instead.

    So it does where it has computed for ``limit_s`` [s], or has waited as long and computed nothing.
    """
    began = before = computed_s(pid)
    while not said.poll(limit_s):
        now = computed_s(pid)
        if now is None or began is None or before is None:  # a system that does not tell, or a process that is gone
            return True
        if now - began >= HELD_UP * limit_s or now - before <= WAITS * limit_s:
            return True
        before = now
    return False


def computed_s(pid: int | None) -> float | None:
    """Processor's time of a process [s]; None where nobody tells.

    Its clock has the number that Linux makes of a process's number (clock_getcpuclockid).
    """
    if pid is None or not sys.platform.startswith("linux"):
        return None
    try:
        return time.clock_gettime((~pid << 3) | 2)
    except OSError:
        return None


def answer_to(file: Path) -> None:
    """Let this process write its frames to ``file`` whenever it is asked; whatever it is doing, it can."""
    stream = file.open("w", encoding="utf-8")
    faulthandler.register(signal.SIGUSR1, stream, all_threads=True)


def ask(process: int | None, file: Path, folder: Path) -> tuple[str, int] | None:
    """Innermost file of ``folder`` and its line in which ``process`` is; None where it is in none, or does not say."""
    if process is None:
        return None
    os.kill(process, signal.SIGUSR1)
    until = time.monotonic() + ASKED_S
    # It writes a piece at a time, and may have to wait for a busy machine in between.
    while (found := _innermost(file.read_text(encoding="utf-8"), folder)) is None and time.monotonic() < until:
        time.sleep(0.05)
    return found


def _innermost(frames: str, folder: Path) -> tuple[str, int] | None:
    for frame in _FRAME.finditer(frames):
        if Path(frame["file"]).is_relative_to(folder):
            return Path(frame["file"]).relative_to(folder).as_posix(), int(frame["line"])
    return None
