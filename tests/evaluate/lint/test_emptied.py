"""A vessel that a fault empties has a limit with a lower end, or the check says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.emptied import emptied
from homeostat.evaluate.lint.finding import Severity
from tests.evaluate.two_tanks import TANKS, change, tanks

LOW = {
    "L1": "LIM-L1-LOW,envelope,L1 >= 10,Datasheet of P1,The transfer pump does not run dry\n",
    "L2": "LIM-L2-LOW,envelope,L2 >= 20 or H1.pos <= 0.05,Datasheet of H1,The heater is covered while it heats\n",
}


@pytest.mark.slow
@pytest.mark.parametrize(("tag", "fault"), [("L1", "P1_stuck_open"), ("L2", "P2_stuck_open")])
def test_a_vessel_without_a_low_limit_is_told_with_the_fault(tag: str, fault: str, tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/limits.csv", LOW[tag], "")
    (only,) = emptied(Bench(folder))
    assert only.severity is Severity.WARNING and only.where.file == "engineering/instruments.csv"
    assert f"{fault!r} empties what {tag!r} shows" in only.what and f"'{tag} >= 20'" in only.remedy


def test_one_with_a_low_limit_is_not() -> None:
    assert [*emptied(Bench(TANKS))] == []
