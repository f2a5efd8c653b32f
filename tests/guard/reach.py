"""Which tests run which lines: a mutant in a line that a test never runs cannot be noticed by it."""

from __future__ import annotations

import os
import pickle
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any


@dataclass(frozen=True)
class Reach:
    """What one test does in the modules that are mutated."""

    lines: dict[str, set[int]] = field(default_factory=dict)
    """Module -> lines that were run."""
    lasts_s: float = 0.0
    """How long the test took [s of CPU time]."""

    def meets(self, module: str, lines: tuple[int, int] | None) -> bool:
        """Whether the test runs one of ``lines``; None for what runs when the module is loaded."""
        return lines is None or any(lines[0] <= line <= lines[1] for line in self.lines.get(module, ()))


def reach_of(test: Callable[[], Any], modules: Iterable[str]) -> Reach:
    """What ``test`` reaches when it runs in a fresh copy of this process."""
    reads, writes = os.pipe()
    child = os.fork()
    if not child:
        with os.fdopen(writes, "wb") as pipe:
            pipe.write(pickle.dumps(_traced(test, modules)))
        os._exit(0)
    os.close(writes)
    with os.fdopen(reads, "rb") as pipe:
        found = pipe.read()
    os.waitpid(child, 0)
    return pickle.loads(found) if found else Reach()


def _traced(test: Callable[[], Any], modules: Iterable[str]) -> Reach:
    names = {str(Path(sys.modules[name].__file__ or "")): name for name in modules}
    lines: dict[str, set[int]] = {name: set() for name in names.values()}

    def note(frame: FrameType, event: str, _: object) -> Any:
        lines[names[frame.f_code.co_filename]].add(frame.f_lineno)
        return note

    def call(frame: FrameType, event: str, _: object) -> Any:
        return note(frame, event, _) if frame.f_code.co_filename in names else None

    threading.settrace(call)
    sys.settrace(call)
    started = time.process_time()
    try:
        test()
    finally:
        sys.settrace(None)
        threading.settrace(None)  # type: ignore[arg-type]
    return Reach(lines, time.process_time() - started)
