"""Reports of a run, as ``homeostat report`` makes them: one at a time, each in a process of its own within bounds."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, final

from homeostat.console.opened import OpenedRun

LONGEST_S: Final = 120
"""Longest time that a report may take [s]."""
MOST_BYTES: Final = 3 << 30
"""Most memory that it may take [byte]."""
_LARGEST: Final = 20_000_000
"""Largest page that is passed on [byte]."""

Last = Literal["8h", "24h", "7d", "all"]
"""How much of the journal a report is of."""


class NotReported(Exception):
    """There is no report; one line says why."""


class Busy(NotReported):
    """Another one is being made."""


@dataclass(frozen=True, slots=True)
class Report:
    """A report that was made."""

    name: str
    """Name of a file for it."""
    page: str
    """The page, HTML."""


@final
class Reports:
    """All reports of one run that are asked for."""

    def __init__(self, run: OpenedRun, longest_s: int = LONGEST_S, most_bytes: int = MOST_BYTES) -> None:
        """Nobody has asked yet; one takes ``longest_s`` [s] and ``most_bytes`` at most."""
        self._run, self._bounds = run, (longest_s, most_bytes)
        self._making = threading.Lock()

    def make(self, last: Last, until_s: float) -> Report:
        """The report of what was ``last`` before process time ``until_s`` [s]; NotReported where there is none."""
        if not self._making.acquire(blocking=False):
            raise Busy("a report is being made already; ask again when it is there")
        try:
            with tempfile.TemporaryDirectory(prefix="homeostat-report-") as folder:
                return self._made(last, until_s, Path(folder) / "report.html")
        except OSError as error:
            raise NotReported(f"no report can be made: {error}") from error
        finally:
            self._making.release()

    def _made(self, last: Last, until_s: float, out: Path) -> Report:
        (longest_s, most_bytes), run = self._bounds, self._run
        # -P: what lies in the folder that the console was started in is no code of anybody's
        bounded = [sys.executable, "-P", "-m", "homeostat.console.reports", str(most_bytes), str(longest_s)]
        until = f"{math.ceil(until_s * 1000.0) / 1000.0:.3f}s"  # what happened at that moment is in it
        asked = ["report", str(run.run_dir.absolute()), "--until", until, "--out", str(out)]
        asked += [] if last == "all" else ["--last", last]
        asked += [] if run.plant.folder is None else ["--case", run.plant.folder]
        try:
            done = subprocess.run(
                [*bounded, *asked], capture_output=True, stdin=subprocess.DEVNULL, timeout=longest_s, check=False
            )
        except subprocess.TimeoutExpired:
            raise NotReported(f"the report was not made within {longest_s} s; ask for less") from None
        if done.returncode < 0:
            raise NotReported(f"the report was ended by signal {-done.returncode}; it may take {longest_s} s")
        if done.returncode > 0 and not out.is_file():  # one whose journal has lost its end says so itself
            said = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or ["it said nothing"]
            if "MemoryError" in said[0]:
                raise NotReported(f"the report needs more than {most_bytes >> 20} MiB; ask for less")
            raise NotReported(f"no report was made: {said[0].removeprefix('homeostat: ')[:300]}")
        if out.stat().st_size > _LARGEST:
            raise NotReported(f"the report has more than {_LARGEST} byte; make it with 'homeostat report'")
        return Report(f"report-{last}-until-{until_s:.0f}s.html", out.read_text(encoding="utf-8"))
