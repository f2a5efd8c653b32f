"""Which line of a plant's code a process hangs in: it is asked by a signal, and its frames are read from a file."""

from __future__ import annotations

import faulthandler
import os
import re
import signal
import time
from pathlib import Path
from typing import Final

ASKED_S: Final = 2.0
"""Longest wait for the frames [s]."""
_FRAME: Final = re.compile(r'^  File "(?P<file>.+)", line (?P<line>\d+) in ', re.MULTILINE)


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
    while not (text := file.read_text(encoding="utf-8")) and time.monotonic() < until:
        time.sleep(0.05)
    for frame in _FRAME.finditer(text):
        if Path(frame["file"]).is_relative_to(folder):
            return Path(frame["file"]).relative_to(folder).as_posix(), int(frame["line"])
    return None
