"""``python -m benchmarks.house --against COMMIT``: CPU time of a few commands before and after, as a Markdown table.

The old commit is checked out beside this one. Both run in turn, with one interpreter and the same settings; of each
command the least CPU time (user and system) counts, since everything that disturbs a measurement adds to it. Neither
pays for compiling: one run of each goes before and is told apart, unless ``--warm`` says that there was one already.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from benchmarks.host import ROOT, measured_on

RUN = ("-m", "homeostat", "run", "cstr", "--fault", "cool_stuck_closed", "--seed", "1")
COMMANDS = {
    "homeostat run cstr --fault cool_stuck_closed --seed 1": RUN,
    "the same, each thought declared to take 1 s": (*RUN, "--thinking-declared", "1"),
    "homeostat cases": ("-m", "homeostat", "cases"),
    "homeostat --help": ("-m", "homeostat", "--help"),
    "import homeostat": ("-c", "import homeostat"),
}
"""What is measured -> arguments of the interpreter."""


@dataclass(frozen=True, slots=True, order=True)
class Cost:
    """What one command took."""

    cpu_s: float
    """User and system time of the process and its children [s]."""
    wall_s: float
    """Wall-clock time [s]."""


def measured(tree: Path, arguments: tuple[str, ...]) -> Cost:
    """What ``arguments`` take with the sources of ``tree``; CalledProcessError where they fail."""
    with tempfile.TemporaryDirectory() as out:
        kept = ("--out", f"{out}/run") if "run" in arguments else ()
        environment = {**os.environ, "PYTHONPATH": str(tree / "src"), "PYTHONDONTWRITEBYTECODE": ""}
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        command = [sys.executable, *arguments, *kept]
        subprocess.run(command, cwd=tree, env=environment, check=True, capture_output=True)
        after, wall_s = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic() - began
    return Cost(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall_s)


def installed_mb() -> dict[str, float]:
    """Library of the base installation -> what it takes on the disk [MB], the largest first; what is missing is 0."""
    names = [line.split("==")[0] for line in (ROOT / "requirements" / "base.txt").read_text().splitlines()]
    found = {name: _size_mb(name) for name in names if name and name[0].isalnum()}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def _size_mb(library: str) -> float:
    try:
        files = [Path(str(file.locate())) for file in distribution(library).files or ()]
    except PackageNotFoundError:  # needed by another version of Python
        return 0.0
    return sum(file.stat().st_blocks * 512e-6 for file in files if file.exists())


@contextmanager
def checked_out(commit: str) -> Iterator[Path]:
    """A folder with the files of ``commit``, as long as this lasts."""
    folder = Path(tempfile.mkdtemp()) / "before"
    git = ("git", "-C", str(ROOT), "worktree")
    subprocess.run([*git, "add", "-q", "--detach", str(folder), commit], check=True)
    try:
        yield folder
    finally:
        subprocess.run([*git, "remove", "--force", str(folder)], check=True)
        shutil.rmtree(folder.parent, ignore_errors=True)


def table(before: Path, after: Path, times: int, warm: bool) -> Iterator[str]:
    """The lines of the table."""
    yield "| Command | CPU before [s] | CPU after [s] | Ratio | Wall before [s] | Wall after [s] |"
    yield "|---|---|---|---|---|---|"
    if not warm:
        yield _line("the first run, compiling", measured(before, RUN), measured(after, RUN))
    for name, arguments in COMMANDS.items():
        pairs = [(measured(before, arguments), measured(after, arguments)) for _ in range(times)]
        yield _line(f"`{name}`" if name.startswith("homeostat") else name, *map(min, zip(*pairs, strict=True)))


def _line(name: str, before: Cost, after: Cost) -> str:
    ratio = after.cpu_s / before.cpu_s
    return (
        f"| {name} | {before.cpu_s:.2f} | {after.cpu_s:.2f} | {ratio:.2f} | {before.wall_s:.2f} | {after.wall_s:.2f} |"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.house", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--against", default="97b8ed9", metavar="COMMIT", help="what to compare with (%(default)s)")
    parser.add_argument("--times", type=int, default=3, metavar="N", help="runs of each command (%(default)s)")
    parser.add_argument("--warm", action="store_true", help="everything is compiled already")
    chosen = parser.parse_args()
    with checked_out(chosen.against) as before:
        for line in table(before, ROOT, chosen.times, chosen.warm):
            print(line, flush=True)
    sizes = installed_mb()
    largest = ", ".join(f"{name} {mb:.0f}" for name, mb in list(sizes.items())[:8])
    print(f"\nThe libraries of a base installation take {sum(sizes.values()):.0f} MB on the disk: {largest}.")
    print(f"\n{measured_on()} Load {os.getloadavg()[0]:.1f}.")


if __name__ == "__main__":
    main()
