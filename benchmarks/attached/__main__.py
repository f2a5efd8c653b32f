"""Make ``docs/results/attached.md``: ``python -m benchmarks.attached [--minutes M]``.

Each study goes on for ``M`` minutes, from where it stopped; with 0 the page is made of what there is.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any, Final

from benchmarks.attached.page import claims, disturbed, killed, many, recovered, table
from benchmarks.attached.rows import Rows
from benchmarks.host import measured_on

ROOT: Final = Path(__file__).parents[2]
PAGE: Final = ROOT / "docs" / "results" / "attached.md"
STUDIES: Final = ("disturbed", "killed", "recovered", "many")
UNTIMED: Final = ("recovered",)
"""Studies that end by themselves."""


def go_on(study: str, folder: Path, minutes: float) -> None:
    """Let a study go on for so long, in a process of its own."""
    timed = [] if study in UNTIMED else ["--minutes", str(minutes)]
    out = ["--out", str(folder / f"{study}.jsonl")]
    subprocess.run([sys.executable, "-m", f"benchmarks.attached.{study}", *timed, *out], check=True)


def text(found: Mapping[str, Sequence[Mapping[str, Any]]], history: str) -> str:
    """The page; ``history``: what the benchmark of the history printed."""
    told = list(claims(found))
    rows = [row for name in STUDIES for row in found[name]]
    commits = Counter(row["commit"] for row in rows)
    loads = sorted(row["load"] for row in rows if "load" in row)
    return Template((Path(__file__).with_name("attached.md")).read_text("utf-8")).substitute(
        measured=measured_on(),
        claims=table(
            ("claim", "bar", "measured", "met"),
            ((c.what, c.bar, c.measured, "yes" if c.met else f"**no**: {c.why}") for c in told),
        ),
        disturbed=disturbed(found["disturbed"]),
        killed=killed(found["killed"]),
        recovered=recovered(found["recovered"]),
        many=many(found["many"]),
        history=history or "not measured",
        commits=", ".join(f"`{name}` ({count} rows)" for name, count in commits.items()),
        load=f"{loads[0]:g} to {loads[-1]:g}, {loads[len(loads) // 2]:g} in the middle" if loads else "unknown",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.add_argument("--rows", type=Path, default=Path("runs/attached"))
    options = parser.parse_args()
    if options.minutes:
        for study in STUDIES:
            go_on(study, options.rows, options.minutes)
    found = {study: Rows(options.rows / f"{study}.jsonl").all() for study in STUDIES}
    history = options.rows / "history.txt"
    if options.minutes:
        command = [sys.executable, "-m", "benchmarks.history", "--tags", "400", "--hours", "24"]
        history.write_text(subprocess.run(command, check=True, capture_output=True, text=True).stdout, "utf-8")
    PAGE.write_text(text(found, history.read_text("utf-8").strip() if history.exists() else ""), "utf-8")


if __name__ == "__main__":
    main()
