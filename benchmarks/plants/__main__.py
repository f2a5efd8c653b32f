"""Make each of the sixty mistakes and ask the command: ``python -m benchmarks.plants [--jobs N] [NAME ...]``.

It prints a table; all of them are written into the page of plants as a section. What was asked for the present sources
is not asked again. A mistake counts as found where the command ends with 1, no traceback, and a finding that counts
points at it and says what to do.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.host import commit, host, kept
from benchmarks.plants.in_models import IN_MODELS
from benchmarks.plants.in_tables import IN_TABLES
from benchmarks.plants.mistake import Mistake
from benchmarks.plants.page import PAGE, with_section
from benchmarks.plants.site import NAME, change, make

LIMIT_S = 600
BAR_S = 60
TITLE = "Sixty mistakes"
ABOUT = """Made by `python -m benchmarks.plants`. Each of sixty mistakes, five of each of twelve classes, is made in a
copy of a plant, the reactor's tables with a model of its own, and `homeostat plant check --deep` is asked about it.
It counts as found where the command ends with status 1 and a finding points at it, with file, row or key, and
remedy; asked for: at least 57. *s* is the time of the whole command by the clock, *CPU s* that of the processor."""
HEAD = "| Class | Mistake | Found | By, at | s | CPU s |\n|---|---|---|---|---|---|"


@dataclass(frozen=True)
class Answer:
    """What the command said of one mistake."""

    name: str
    status: int
    traceback: bool
    findings: tuple[dict[str, Any], ...]
    seconds: float
    """By the clock."""
    cpu_s: float
    """What the command and its child took of the processor."""

    def pointing(self, mistake: Mistake) -> dict[str, Any] | None:
        """The first finding that points at the mistake, has a place and says what to do."""
        for finding in self.findings:
            where, whole = finding["where"], json.dumps(finding)
            placed = bool(where["file"]) and (where["row"] is not None or bool(where["key"]))
            if placed and finding["remedy"] and any(point in whole for point in mistake.points):
                return finding
        return None

    def found(self, mistake: Mistake) -> bool:
        """Whether it was refused, with place and remedy."""
        return self.status == 1 and not self.traceback and self.pointing(mistake) is not None


def answer(mistake: Mistake, template: Path, where: Path) -> Answer:
    """Make the mistake in a copy of ``template`` below ``where``, and ask for a deep check of it."""
    folder = Path(tempfile.mkdtemp(dir=where)) / NAME
    shutil.copytree(template, folder)
    change(folder, mistake.edits)
    began = time.perf_counter()
    command = (sys.executable, "-m", "homeostat", "plant", "check", "--deep", "--json", str(folder))
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        process = subprocess.Popen(command, stdout=out, stderr=err)
        _, status, used = os.wait4(process.pid, 0)  # what this one took, and no other that runs beside it
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.perf_counter() - began
        printed, complained = (_content(stream) for stream in (out, err))
    said = json.loads(printed)["findings"] if printed.startswith("{") else []
    counted = tuple(finding for finding in said if finding["severity"] != "note")
    cpu_s = used.ru_utime + used.ru_stime
    return Answer(mistake.name, process.returncode, "Traceback" in complained, counted, seconds, cpu_s)


def _content(stream: Any) -> str:
    stream.seek(0)
    return str(stream.read())


def row(mistake: Mistake, given: Answer) -> str:
    """One line of the table."""
    pointing, times = given.pointing(mistake), f"{given.seconds:.0f} | {given.cpu_s:.0f}"
    if pointing is None:
        said = f"{len(given.findings)} other findings" if given.findings else "nothing"
        return f"| {mistake.kind} | {mistake.name} | no: {said} | | {times} |"
    where = pointing["where"]
    place = f"{where['file']}{'' if where['row'] is None else ' row ' + str(where['row'])} ({where['key']})"
    found = "yes" if given.found(mistake) else f"no: status {given.status}"
    return f"| {mistake.kind} | {mistake.name} | {found} | {pointing['check']}: {place} | {times} |"


def summary(mistakes: Sequence[Mistake], answers: Sequence[Answer]) -> str:
    """What it comes to."""
    found = sum(given.found(mistake) for mistake, given in zip(mistakes, answers, strict=True))
    return (
        f"{found} of {len(answers)} found with place and remedy; {sum(each.traceback for each in answers)} tracebacks. "
        f"The slowest answer\ntook {max(each.seconds for each in answers):.0f} s by the clock (asked for: {BAR_S} s), "
        f"and the dearest {max(each.cpu_s for each in answers):.0f} s of the processor."
    )


def told(mistake: Mistake, template: Path, where: Path) -> Answer:
    """The answer, which was kept or is asked for now; its line is printed."""
    path = kept("plants") / "mistakes.jsonl"
    lines = path.read_text("utf-8").splitlines() if path.exists() else []
    given = next((each for each in map(json.loads, lines) if each["name"] == mistake.name), None)
    if given is not None:
        found = Answer(**{**given, "findings": tuple(given["findings"])})
    else:
        found = answer(mistake, template, where)
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(f"{json.dumps(asdict(found))}\n")
    print(row(mistake, found), flush=True)
    return found


def main() -> None:
    """Print each line as soon as it is known; write the section where none is lacking."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="mistakes (default: all)")
    parser.add_argument("--jobs", type=int, default=1, help="how many are asked at once (default: 1)")
    options, every = parser.parse_args(), (*IN_TABLES, *IN_MODELS)
    if unknown := sorted({*options.names} - {mistake.name for mistake in every}):
        parser.error(f"no mistake is called {', '.join(map(repr, unknown))}")
    wanted = [mistake for mistake in every if not options.names or mistake.name in options.names]
    print(HEAD, flush=True)
    with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(options.jobs) as pool:
        template = make(Path(scratch) / "template")
        answers = list(pool.map(lambda mistake: told(mistake, template, Path(scratch)), wanted))
    said = summary(wanted, answers)
    print(f"\n{said}")
    if len(wanted) == len(every):
        here = host()
        measured = (
            f"Measured for the sources of `{commit()}`, {options.jobs} at once, at a load of {here['load']:g} on "
            f"{here['cores']} cores; the\nyardstick takes {here['yardstick_s']:.3f} s there."
        )
        table = "\n".join([HEAD, *map(row, wanted, answers)])
        body = f"{ABOUT}\n\n{said}\n\n{table}\n\n{measured}"
        PAGE.write_text(with_section(PAGE.read_text("utf-8"), TITLE, body), encoding="utf-8")


if __name__ == "__main__":
    main()
