"""The table of what tests reach: counts are added up by package, and the page is part of the documentation."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tools.coverage_table import COUNTS, main


def counted(statements: int, missing: int, branches: int, untaken: int) -> dict[str, object]:
    """What coverage's report says of one file."""
    counts = zip(COUNTS, (statements, missing, branches, untaken), strict=True)
    return {"summary": dict(counts)}


@pytest.mark.quick
def test_files_are_added_up_by_package(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report, page = tmp_path / "report.json", tmp_path / "page.md"
    report.write_text(json.dumps({"files": {
        "src/homeostat/__init__.py": counted(10, 0, 2, 0),
        "/elsewhere/src/homeostat/guard/writing/lane.py": counted(60, 6, 20, 2),
        "src/homeostat/guard/guard.py": counted(20, 0, 0, 0),
        "src/homeostat/stl/empty.py": counted(0, 0, 0, 0),
    }}))  # fmt: skip
    main(report, page)
    rows = [line for line in page.read_text("utf-8").splitlines() if line.startswith("| ")]
    assert rows[1:] == [
        "| guard | 80 | 6 | 20 | 2 | 92.0 % |",
        "| homeostat | 10 | 0 | 2 | 0 | 100.0 % |",
        "| stl | 0 | 0 | 0 | 0 | 100.0 % |",
        "| all | 90 | 6 | 22 | 2 | 92.9 % |",
    ]
    shown = capsys.readouterr().out
    assert all(row in shown for row in rows) and shown.endswith(f"wrote {page}\n")
