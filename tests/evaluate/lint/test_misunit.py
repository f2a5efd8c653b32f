"""A rule whose units do not agree names the row of the unit that would let it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.check import check
from homeostat.evaluate.lint.finding import Finding

TANKS = Path(__file__).parents[3] / "examples" / "two_tanks"
FEATURES = """id,description,expression,accumulation,window_s,filter_s,unit,component
F-FEED,Feed that the valve does not explain,{expression},,0,60,L/s,FT1
"""


def found(folder: Path, unit: str, expression: str) -> list[Finding]:
    """What is found where the flow through the open valve is stated in ``unit``."""
    made = Path(shutil.copytree(TANKS, folder / "two_tanks", ignore=shutil.ignore_patterns("plant.ttl", "__pycache__")))
    tables = made / "engineering"
    parameters = (tables / "parameters.csv").read_text("utf-8")
    assert "flow_V1,0.4,L/s" in parameters
    (tables / "parameters.csv").write_text(parameters.replace("flow_V1,0.4,L/s", f"flow_V1,0.4,{unit}"), "utf-8")
    (tables / "features.csv").write_text(FEATURES.format(expression=expression), "utf-8")
    return [each for each in check(str(made)).findings if each.counts]


def test_the_row_of_the_unit_is_named_beside_the_rule(tmp_path: Path) -> None:
    (told,) = found(tmp_path, "kg/s", "F1 - flow_V1 * V1.pos")
    assert told.where.file == "engineering/features.csv" and told.where.key == "F-FEED"
    assert "they would agree if engineering/parameters.csv row 5 (flow_V1) were in 'L/s'" in told.what
    assert told.remedy.startswith("correct value and unit there, or convert")


@pytest.mark.parametrize("expression", ["F1 - T1", "F1 * T1 - flow_V1 * L1 * L2"])
def test_no_row_is_named_where_no_other_unit_would_do(expression: str, tmp_path: Path) -> None:
    (told,) = found(tmp_path, "L/s", expression)
    assert "convert" in told.remedy and "parameters.csv" not in told.what
