"""What a healthy plant shows of its tables: criteria that it never meets, times in another unit, a start that fails."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.fault_free import fault_free, missed_criteria
from homeostat.evaluate.lint.deep.numbers import at_once
from homeostat.evaluate.lint.finding import Severity, amount

TANKS = Path(__file__).parents[3] / "examples" / "two_tanks"


def tanks(folder: Path, table: str, stated: str, other: str) -> Bench:
    """The two tanks with something else in a table."""
    made = Path(shutil.copytree(TANKS, folder / "two_tanks", ignore=shutil.ignore_patterns("plant.ttl", "__pycache__")))
    file = made / "engineering" / f"{table}.csv"
    text = file.read_text("utf-8")
    assert stated in text
    file.write_text(text.replace(stated, other), "utf-8")
    return Bench(made)


@pytest.mark.slow
def test_a_criterion_that_the_design_misses_is_told(tmp_path: Path) -> None:
    bench = tanks(tmp_path, "criteria", "abs(T2.err) <= 2", "T2 >= 55 and L2 >= 20")
    (found,) = missed_criteria(bench, bench.quiet)
    assert found.severity is Severity.ERROR and str(found.where) == "engineering/criteria.csv row 2 (ACC-T2)"
    assert "'T2 >= 55 and L2 >= 20' for 100% of the time in 'normal'" in found.what and "every run pays" in found.what


@pytest.mark.parametrize("formula", ["abs(T2.err) <= 2", "T2 >= 48", "always[0,60] (T2 <= 60)"])
def test_one_that_the_design_meets_is_not(formula: str, tmp_path: Path) -> None:
    bench = tanks(tmp_path, "criteria", "abs(T2.err) <= 2", f'"{formula}"')
    assert list(missed_criteria(bench, bench.quiet)) == []


def test_a_time_constant_in_another_unit_is_told(tmp_path: Path) -> None:
    (found,) = at_once(tanks(tmp_path, "parameters", "tau_P1,1,s", "tau_P1,0.001,s"))
    assert found.severity is Severity.WARNING and str(found.where).endswith("(tau_P1)")
    assert "tau_P1 = 0.001 s is less than 2% of a tick of 1 s" in found.what


@pytest.mark.slow
def test_a_plant_that_never_starts_is_a_finding(tmp_path: Path) -> None:
    bench = tanks(tmp_path, "guards", "T2 >= 48 and T2 <= 52", "T2 >= 60 and T2 <= 62")
    (found,) = fault_free(bench)
    assert str(found.where) == "engineering/transitions.csv row 2 (t_started)" and "never holds" in found.what


@pytest.mark.parametrize(("value", "unit", "told"), [(0.98765, "1", "0.9877"), (-33.471, "L", "-33.47 L")])
def test_a_share_is_told_without_a_unit(value: float, unit: str, told: str) -> None:
    assert amount(value, unit) == told
