"""The command as a user gives it: in this process, which has loaded everything, or in one of its own."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import pytest

import homeostat as package
from homeostat.cli.main import main

COMMAND = (sys.executable, "-m", "homeostat")
SOURCE = Path(package.__file__).resolve().parents[1]
LIMIT_S = 240
SHOWING = ("NO_COLOR", "FORCE_COLOR", "COLUMNS")
"""Variables that change how text is shown."""


@dataclass(frozen=True)
class Done:
    """A command that has ended."""

    status: int
    out: str
    err: str
    cwd: Path


def environment() -> dict[str, str]:
    """The environment of a command: this source tree, and nothing that changes how text is shown."""
    kept = {name: value for name, value in os.environ.items() if name not in SHOWING}
    return {**kept, "PYTHONPATH": str(SOURCE), "PYTHONIOENCODING": "utf-8"}


def homeostat(*arguments: str, cwd: Path) -> Done:
    """Carry ``homeostat arguments`` out in folder ``cwd``, in this process, and keep what it says."""
    out, err = (io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2))
    with pytest.MonkeyPatch.context() as patch, chdir(cwd), redirect_stdout(out), redirect_stderr(err):
        for name in SHOWING:
            patch.delenv(name, raising=False)
        status = _carried_out(arguments)
    said, complained = (stream.buffer.getvalue().decode() for stream in (out, err))  # type: ignore[attr-defined]
    return Done(status, said, complained, cwd)


def _carried_out(arguments: Sequence[str]) -> int:
    try:
        return main(arguments)
    except SystemExit as end:  # help, the version
        return int(end.code or 0)


def homeostat_process(*arguments: str, cwd: Path) -> Done:
    """Carry ``homeostat arguments`` out in folder ``cwd``, in a process of its own with pipes for its output."""
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
