"""A limit that a shutdown violates by itself is told with its row, and criteria that it is charged for are a note."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.domain.lasting import lasting
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.safe_states import after_fallbacks
from homeostat.evaluate.lint.deep.standing import standing
from homeostat.evaluate.lint.finding import Severity
from tests.evaluate.two_tanks import TANKS, change, tanks


def test_a_limit_that_the_fallback_lets_fall_is_told_with_when_why_and_what_to_do(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    row = "LIM-L1-LOW,envelope,"
    change(folder, "engineering/limits.csv", row, f"LIM-T2-LOW,envelope,T2 >= 25,Datasheet,It does not set\n{row}")
    bench = Bench(folder)
    found = {each.where.key: each for each in standing(bench, after_fallbacks(bench))}
    limit = found["LIM-T2-LOW"]
    assert limit.severity is Severity.WARNING and limit.where.file == "engineering/limits.csv" and limit.where.row
    assert "violated by 'flush' itself" in limit.what and "with nothing wrong but the shutdown" in limit.what
    assert "T2.sp = 20 degC" in limit.what and "fallbacks.csv row 5 (flush)" in limit.remedy


def test_an_example_has_only_a_note_of_what_a_shutdown_costs() -> None:
    bench = Bench(TANKS)
    (only,) = standing(bench, after_fallbacks(bench))
    assert only.severity is Severity.NOTE and only.where.key == "ACC-T2" and "after 'stop'" in only.what


@pytest.mark.parametrize(
    ("seconds", "told"),
    [(0.25, "0.25 s"), (119.0, "119 s"), (120.0, "2 min"), (7199.0, "120 min"), (86400.0, "24 h"), (864000.0, "10 d")],
)
def test_a_time_is_told_in_the_unit_of_its_size(seconds: float, told: str) -> None:
    assert lasting(seconds) == told
