"""Print how much of each package the tests reach, and write it to docs/coverage.md: ``make coverage``.

    python tools/coverage_table.py REPORT [PAGE]

REPORT is what ``pytest --cov --cov-report=json:REPORT`` writes; PAGE is another page than the one of the documentation.
"""

from __future__ import annotations

import json
import sys
from collections import Counter, defaultdict
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "coverage.md"
COUNTS = ("num_statements", "missing_lines", "num_branches", "missing_branches")
HEAD = """---
orphan: true
---

# What the tests reach

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


def main(report: Path, page: Path = PAGE) -> None:
    """Print the table and keep it on ``page``."""
    found = by_package(report)
    lines = ["| package | statements | not reached | branches | not taken | reached |", "|---|---|---|---|---|---|"]
    lines += [row(name, counts) for name, counts in found.items()]
    lines.append(row("all", sum(found.values(), Counter())))
    text = "\n".join(lines) + "\n"
    page.write_text(HEAD + text, "utf-8")
    print(text)
    print(f"wrote {page}")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
