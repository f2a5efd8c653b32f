"""A permissive with a comparison the wrong way round is told as such, with the comparison."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.fault_free import fault_free
from homeostat.evaluate.lint.deep.inverted import inverted
from homeostat.evaluate.lint.deep.rules import rules
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.plants.files.folder import INSTALLED
from tests.evaluate.lint.copied import copied
from tests.evaluate.two_tanks import TANKS, change, tanks


def of_permissive(folder: Path, name: str) -> list[Finding]:
    bench = Bench(folder)
    found = [*fault_free(bench), *rules(bench)]
    return [each for each in found if each.where.key == name]


@pytest.mark.slow
def test_one_that_forbids_the_design_is_told_with_its_comparison(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/limits.csv", "L2 >= 30", "L2 <= 30")
    (only,) = of_permissive(folder, "PRM-HEAT")
    assert only.severity is Severity.ERROR and only.where.file == "engineering/limits.csv"
    assert "'L2 <= 30' is the wrong way round: LIM-L2-LOW, 'L2 >= 20 or H1.pos <= 0.05'" in only.what
    assert "with 'L2 >= 30' it would hold" in only.what and "turn the comparison" in only.remedy


def test_one_that_asks_for_what_violates_a_limit_is_told_although_the_design_keeps_it(tmp_path: Path) -> None:
    folder = copied("cstr", tmp_path)
    change(folder, "engineering/limits.csv", "or T1 <= 300", "or T1 >= 313.5")
    (only,) = inverted(Bench(folder))
    assert only.severity is Severity.ERROR and only.where.key == "PRM-COOL"
    assert "permits by 'T1 >= 313.5' exactly what violates LIM-T-HIGH, 'T1 <= 313'" in only.what


@pytest.mark.slow
def test_one_at_the_weir_is_told_with_the_limit_there(tmp_path: Path) -> None:
    folder = copied("cstr", tmp_path)
    change(folder, "engineering/limits.csv", "F1.sp <= 0.0005 or L1 <= V_brim", "F1.sp <= 0.0005 or L1 >= V_brim")
    (only,) = of_permissive(folder, "PRM-FEED")
    assert "'L1 >= " in only.what and "is the wrong way round: LIM-L-HIGH" in only.what


@pytest.mark.parametrize("folder", [TANKS, INSTALLED / "cstr", INSTALLED / "mixing_module"], ids=lambda f: f.name)
def test_those_of_the_plants_that_ship_are_not(folder: Path) -> None:
    assert list(inverted(Bench(folder))) == []
