"""A feature that takes the name of one that follows is told, where it looks at something else."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.check import check
from homeostat.evaluate.lint.finding import Severity
from tests.evaluate.two_tanks import tanks

HEADER = "id,description,expression,accumulation,window_s,filter_s,unit,component\n"


def told(folder: Path, name: str, expression: str, unit: str) -> list[str]:
    made = tanks(folder)
    row = f"{name},What the feed valve does,{expression},,0,60,{unit},V1\n"
    (made / "engineering" / "features.csv").write_text(HEADER + row, "utf-8")
    found = check(str(made)).findings
    assert not any(f.severity is Severity.ERROR for f in found), [*map(str, found)]
    return [str(f) for f in found if "replaces the feature" in f.what]


def test_a_name_that_is_taken_by_something_else_is_told_with_row_and_symptoms(tmp_path: Path) -> None:
    (line,) = told(tmp_path, "F-V1", "F1 - flow_V1 * V1.pos", "L/s")
    assert line.startswith("engineering/features.csv row 2 (F-V1): warning: replaces the feature of that name")
    assert "which S-V1-OFF reads: nothing looks at V1.cmd there any more; give it another id" in line


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "expression", "unit"),
    [("F-FEED", "F1 - flow_V1 * V1.pos", "L/s"), ("F-V1", "2 * (V1.pos - V1.cmd)", "1")],
)
def test_another_name_and_another_form_of_the_same_are_no_mistake(
    name: str, expression: str, unit: str, tmp_path: Path
) -> None:
    assert told(tmp_path, name, expression, unit) == []
