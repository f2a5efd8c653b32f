"""``python -m benchmarks.house``: size, shape and CPU time before and after, written to docs/results/house.md.

The old commit is checked out beside this one. Both run in turn, with one interpreter and the same settings; of each
command the least CPU time (user and system) counts, since everything that disturbs a measurement adds to it. Neither
pays for compiling: one run of each, with an empty cache, goes before and is told apart.
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


PAGE = ROOT / "docs" / "results" / "house.md"
TEMPLATE, TRIAL = Path(__file__).with_name("house.md"), Path(__file__).with_name("trial.md")
"""The page without its figures; what a person found who knew the docs alone."""


@dataclass(frozen=True, slots=True, order=True)
class Cost:
    """What one command took."""

    cpu_s: float
    """User and system time of the process and its children [s]."""
    wall_s: float
    """Wall-clock time [s]."""


def measured(tree: Path, arguments: tuple[str, ...], cache: str) -> Cost:
    """What ``arguments`` take with the sources of ``tree`` and compiled code in ``cache``.

    CalledProcessError where they fail.
    """
    with tempfile.TemporaryDirectory() as out:
        kept = ("--out", f"{out}/run") if "run" in arguments else ()
        environment = {**os.environ, "PYTHONPATH": str(tree / "src"), "PYTHONDONTWRITEBYTECODE": ""}
        environment["NUMBA_CACHE_DIR"] = cache
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


def costs(before: Path, after: Path, times: int) -> Iterator[str]:
    """The lines of the table of costs."""
    yield "| Command | CPU before [s] | CPU after [s] | Ratio | Wall before [s] | Wall after [s] |"
    yield "|---|---|---|---|---|---|"
    with tempfile.TemporaryDirectory() as old, tempfile.TemporaryDirectory() as new:
        yield _line("the first run, compiling", measured(before, RUN, old), measured(after, RUN, new))
        for name, arguments in COMMANDS.items():
            pairs = [(measured(before, arguments, old), measured(after, arguments, new)) for _ in range(times)]
            yield _line(f"`{name}`" if name.startswith("homeostat") else name, *map(min, zip(*pairs, strict=True)))


def _line(name: str, before: Cost, after: Cost) -> str:
    ratio = after.cpu_s / before.cpu_s
    return (
        f"| {name} | {before.cpu_s:.2f} | {after.cpu_s:.2f} | {ratio:.2f} | {before.wall_s:.2f} | {after.wall_s:.2f} |"
    )


def shape(against: str) -> str:
    """The table of sizes and shapes."""
    script = [sys.executable, str(ROOT / "tools" / "house.py"), against]
    return subprocess.run(script, capture_output=True, text=True, check=True, cwd=ROOT).stdout.strip()


def main() -> None:
    """Measure and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.house", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--against", default="97b8ed9", metavar="COMMIT", help="what to compare with (%(default)s)")
    parser.add_argument("--times", type=int, default=3, metavar="N", help="runs of each command (%(default)s)")
    chosen = parser.parse_args()
    load = os.getloadavg()[0]
    with checked_out(chosen.against) as before:
        lines = list(costs(before, ROOT, chosen.times))
    first_s, later_s = (float(line.split("|")[-2]) for line in lines[2:4])
    sizes = installed_mb()
    PAGE.write_text(
        TEMPLATE.read_text(encoding="utf-8").format(
            against=chosen.against,
            measured=f"{measured_on()} Load {load:.1f} when it began.",
            shape=shape(chosen.against),
            costs="\n".join(lines),
            first_s=f"{first_s - later_s:.1f}",
            rest_mb=f"{sum(sizes.values()) - sizes['llvmlite'] - sizes['numba'] - sizes['pyarrow']:.0f}",
            total_mb=f"{sum(sizes.values()):.0f}",
            trial=TRIAL.read_text(encoding="utf-8").strip(),
            largest=", ".join(f"{name} {mb:.0f}" for name, mb in list(sizes.items())[:8]),
        ),
        encoding="utf-8",
    )
    print("\n".join([*lines, "", str(PAGE.relative_to(ROOT))]))


if __name__ == "__main__":
    main()
