"""The command as a user starts it: a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import homeostat as package

COMMAND = (sys.executable, "-m", "homeostat")
SOURCE = Path(package.__file__).resolve().parents[1]
LIMIT_S = 120


@dataclass(frozen=True)
class Done:
    """A command that has ended."""

    status: int
    out: str
    err: str
    cwd: Path


def environment() -> dict[str, str]:
    """The environment of a command: this source tree, and nothing that changes how text is shown."""
    kept = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "FORCE_COLOR", "COLUMNS")}
    return {**kept, "PYTHONPATH": str(SOURCE), "PYTHONIOENCODING": "utf-8"}


def homeostat(*arguments: str, cwd: Path) -> Done:
    """Carry ``homeostat arguments`` out in folder ``cwd``, with pipes for its output."""
    done = subprocess.run(
        [*COMMAND, *arguments], cwd=cwd, env=environment(), capture_output=True, encoding="utf-8", timeout=LIMIT_S
    )
    return Done(done.returncode, done.stdout, done.stderr, cwd)


def refused(done: Done, *words: str) -> None:
    """The command said in one line what is wrong, printed nothing, and exited with 2."""
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith("homeostat: ") and done.err.count("\n") == 1
    for word in words:
        assert word in done.err
