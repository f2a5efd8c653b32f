"""Make each of the sixty mistakes and ask the command: ``python -m benchmarks.plants [NAME ...]``; prints a table.

A mistake counts as found where the command ends with 1, no traceback, and a finding that counts points at it and says
what to do.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.host import measured_on
from benchmarks.plants.in_models import IN_MODELS
from benchmarks.plants.in_tables import IN_TABLES
from benchmarks.plants.mistake import Mistake
from benchmarks.plants.site import NAME, change, make

LIMIT_S = 300
BAR_S = 60


@dataclass(frozen=True)
class Answer:
    """What the command said of one mistake."""

    mistake: Mistake
    status: int
    traceback: bool
    findings: tuple[dict[str, Any], ...]
    seconds: float

    @property
    def pointing(self) -> dict[str, Any] | None:
        """The first finding that points at the mistake, has a place and says what to do."""
        for finding in self.findings:
            where, whole = finding["where"], json.dumps(finding)
            placed = bool(where["file"]) and (where["row"] is not None or bool(where["key"]))
            if placed and finding["remedy"] and any(point in whole for point in self.mistake.points):
                return finding
        return None

    @property
    def found(self) -> bool:
        """Whether it was refused, with place and remedy."""
        return self.status == 1 and not self.traceback and self.pointing is not None


def answer(mistake: Mistake, template: Path, where: Path) -> Answer:
    """Make the mistake in a copy of ``template`` and ask for a deep check of it."""
    folder = where / NAME
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(template, folder)
    change(folder, mistake.edits)
    began = time.perf_counter()
    command = (sys.executable, "-m", "homeostat", "plant", "check", "--deep", "--json", str(folder))
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    seconds = time.perf_counter() - began
    said = json.loads(done.stdout)["findings"] if done.stdout.startswith("{") else []
    counted = tuple(finding for finding in said if finding["severity"] != "note")
    return Answer(mistake, done.returncode, "Traceback" in done.stderr, counted, seconds)


def row(given: Answer) -> str:
    """One line of the table."""
    pointing = given.pointing
    if pointing is None:
        said = f"{len(given.findings)} other findings" if given.findings else "nothing"
        return f"| {given.mistake.kind} | {given.mistake.name} | no: {said} | | {given.seconds:.0f} |"
    where = pointing["where"]
    place = f"{where['file']}{'' if where['row'] is None else ' row ' + str(where['row'])} ({where['key']})"
    found = "yes" if given.found else f"no: status {given.status}"
    by = f"{pointing['check']}: {place}"
    return f"| {given.mistake.kind} | {given.mistake.name} | {found} | {by} | {given.seconds:.0f} |"


def summary(answers: Sequence[Answer]) -> str:
    """What it comes to."""
    found, slow = sum(each.found for each in answers), max(each.seconds for each in answers)
    broke = sum(each.traceback for each in answers)
    return (
        f"{found} of {len(answers)} found with place and remedy; {broke} tracebacks; the slowest answer took "
        f"{slow:.0f} s (bar: {BAR_S} s)."
    )


def main() -> None:
    """Print the table, each line as soon as it is known."""
    wanted = [m for m in (*IN_TABLES, *IN_MODELS) if not sys.argv[1:] or m.name in sys.argv[1:]]
    print("| Class | Mistake | Found | By, at | s |\n|---|---|---|---|---|", flush=True)
    answers = []
    with tempfile.TemporaryDirectory() as scratch:
        template = make(Path(scratch) / "template")
        for mistake in wanted:
            answers.append(answer(mistake, template, Path(scratch)))
            print(row(answers[-1]), flush=True)
    print(f"\n{summary(answers)}\n\n{measured_on()}")


if __name__ == "__main__":
    main()
