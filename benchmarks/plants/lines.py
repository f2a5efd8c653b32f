"""Lines of the shipped plants before there were building blocks, and now: ``python -m benchmarks.plants.lines``.

Counted is what somebody writes: tables, settings and code, comments included; not what is made of them.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

ROOT = Path(__file__).parents[2]
PLANTS = "src/homeostat/plants"
SHIPPED = ("cstr", "mixing_module")
BEFORE = "8fb684de"
"""The last commit in which every equation of both plants was written by hand."""
WRITTEN, MADE = (".csv", ".py", ".toml"), ("baseline.csv",)
KINDS = {".csv": "tables", ".toml": "settings", ".py": "code"}


@dataclass(frozen=True)
class Lines:
    """Lines of one plant."""

    before: dict[str, int]
    """Tables, settings and code -> lines at :data:`BEFORE`."""
    now: dict[str, int]
    """The same in the tree."""

    @property
    def share(self) -> float:
        """How many of the lines there are still [1]."""
        return sum(self.now.values()) / sum(self.before.values())


def counted(names: Iterable[str], text: Callable[[str], str]) -> dict[str, int]:
    """Kind -> lines of the files ``names``, of which ``text`` gives what is in them."""
    found = dict.fromkeys(KINDS.values(), 0)
    for name in names:
        path = PurePosixPath(name)
        if path.suffix in WRITTEN and path.name not in MADE:
            found[KINDS[path.suffix]] += len(text(name).splitlines())
    return found


def lines(plant: str) -> Lines:
    """Lines of a shipped plant; subprocess.CalledProcessError where git does not have :data:`BEFORE`."""
    folder = f"{PLANTS}/{plant}"
    now = [path.relative_to(ROOT).as_posix() for path in (ROOT / folder).rglob("*") if path.is_file()]
    before = _git("ls-tree", "-r", "--name-only", BEFORE, "--", folder).splitlines()
    return Lines(
        counted(before, lambda name: _git("show", f"{BEFORE}:{name}")),
        counted(now, lambda name: (ROOT / name).read_text("utf-8")),
    )


def table() -> str:
    """Both plants as a Markdown table."""
    rows = ["| plant | tables | settings | code | in all | of before |", "|---|---|---|---|---|---|"]
    for plant in SHIPPED:
        found = lines(plant)
        cells = [f"{found.before[kind]} -> {found.now[kind]}" for kind in KINDS.values()]
        cells.append(f"{sum(found.before.values())} -> {sum(found.now.values())}")
        rows.append(f"| {plant} | {' | '.join(cells)} | {found.share:.0%} |")
    return "\n".join(rows) + "\n"


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True).stdout


if __name__ == "__main__":
    print(table(), end="")
