"""Print how much of each package the tests reach, and write it to docs/coverage.md: ``make coverage``."""

from __future__ import annotations

import json
import sys
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "coverage.md"
COUNTS = ("num_statements", "missing_lines", "num_branches", "missing_branches")
HEAD = """# What the tests reach

Lines and branches of each package that `make coverage` reaches: the tests of `make test`, without what they start in
processes of their own. A figure to look at, no bar to pass.

"""


def by_package(report: Path) -> dict[str, Counter[str]]:
    """The counts of each package from coverage's own report; the package's own files count as ``homeostat``."""
    found: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for file, content in json.loads(report.read_text("utf-8"))["files"].items():
        inside = Path(file).parts[Path(file).parts.index("homeostat") + 1 :]
        name = inside[0] if len(inside) > 1 else "homeostat"
        found[name].update({count: content["summary"][count] for count in COUNTS})
    return dict(sorted(found.items()))


def row(name: str, counts: Counter[str]) -> str:
    """One line of the table."""
    statements, missing, branches, untaken = (counts[count] for count in COUNTS)
    reached = 100.0 * (1 - (missing + untaken) / max(statements + branches, 1))
    return f"| {name} | {statements} | {missing} | {branches} | {untaken} | {reached:.1f} % |"


def main(report: Path) -> None:
    """Print the table and keep it."""
    found = by_package(report)
    lines = ["| package | statements | not reached | branches | not taken | reached |", "|---|---|---|---|---|---|"]
    lines += [row(name, counts) for name, counts in found.items()]
    lines.append(row("all", sum(found.values(), Counter())))
    text = "\n".join(lines) + "\n"
    PAGE.write_text(HEAD + text, "utf-8")
    print(text)
    print(f"wrote {PAGE.relative_to(ROOT)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
