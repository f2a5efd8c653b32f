"""A permissive that no command can meet forbids what would help; the check says so before that happens."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.rules import refused_fallbacks, uncommanded
from homeostat.evaluate.lint.finding import Severity

TANKS = Path(__file__).parents[3] / "examples" / "two_tanks"
RULE = "T2.sp <= 25 or L2 >= 30"


def tanks(folder: Path, rule: str, *waivers: str) -> Bench:
    """The two tanks with another permissive, which fallbacks set aside as ``waivers`` say."""
    made = Path(shutil.copytree(TANKS, folder / "two_tanks", ignore=shutil.ignore_patterns("plant.ttl", "__pycache__")))
    limits = made / "engineering" / "limits.csv"
    text = limits.read_text("utf-8")
    assert RULE in text
    limits.write_text(text.replace(RULE, rule), "utf-8")
    if waivers:
        rows = "\n".join(("strategy,permissive,reason", *waivers))
        (made / "engineering" / "fallback_waivers.csv").write_text(f"{rows}\n", "utf-8")
    return Bench(made)


def test_one_that_reads_measured_values_alone_is_told(tmp_path: Path) -> None:
    bench = tanks(tmp_path, "H1.pos <= 0.01 or L2 >= 30")
    (found,) = uncommanded(bench)
    assert found.severity is Severity.WARNING and str(found.where) == "engineering/limits.csv row 5 (PRM-HEAT)"
    assert "reads 'H1.pos', 'L2', which nobody commands" in found.what
    refused = list(refused_fallbacks(bench))
    rows = ["engineering/fallbacks.csv row 2 (stop)", "engineering/fallbacks.csv row 5 (flush)"]
    assert sorted(str(each.where) for each in refused) == rows
    assert all(each.severity is Severity.WARNING and "so may be every other one" in each.what for each in refused)


def test_that_of_the_example_is_met_by_every_fallback(tmp_path: Path) -> None:
    bench = tanks(tmp_path, RULE)
    assert [*uncommanded(bench), *refused_fallbacks(bench)] == []


@pytest.mark.slow
def test_one_that_reads_the_command_is_met_by_a_fallback_that_moves_it_by_hand(tmp_path: Path) -> None:
    bench = tanks(tmp_path, "H1.cmd <= 0.05 or L2 >= 30")
    assert [*uncommanded(bench), *refused_fallbacks(bench)] == []


def test_a_fallback_that_is_never_refused_makes_the_other_a_note(tmp_path: Path) -> None:
    bench = tanks(tmp_path, "H1.pos <= 0.01 or L2 >= 30", "stop,PRM-HEAT,It stops the heater")
    (found,) = refused_fallbacks(bench)
    assert found.severity is Severity.NOTE and "'flush'" in found.what and "another one acts" in found.what


@pytest.mark.slow
def test_one_that_a_stuck_actuator_never_meets_is_told_with_the_fault(tmp_path: Path) -> None:
    bench = tanks(tmp_path, "V1.pos <= 0.9 and T2.sp <= 70")
    (found,) = uncommanded(bench)
    assert "cannot hold with 'V1.pos' at 1, where 'V1_stuck_open' leaves it" in found.what
    assert "read the command in place of the position" in found.remedy
