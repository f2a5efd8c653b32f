"""A loop whose instrument alone judges a limit is a remark, until something else checks the instrument."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.alone import alone
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Severity
from homeostat.plants.files.folder import INSTALLED
from tests.evaluate.two_tanks import TANKS, change, tanks

SECOND = "LT3,L3,L,-10,220,B1,0.2,,0.5,1,Content of the feed tank by another transmitter\n"
FEATURES = """id,description,expression,accumulation,window_s,filter_s,unit,component
F-LEVELS,Both transmitters show the same,L1 - L3,,0,10,L,B1
"""
SYMPTOMS = """id,description,feature,direction,sigma,threshold,on_delay_s
S-LEVELS,The transmitters of the feed tank differ,F-LEVELS,both,8,4,10
"""


def with_second(folder: Path) -> Path:
    """The two tanks with a second transmitter of the first level."""
    made = tanks(folder)
    change(made, "engineering/instruments.csv", "LT2,L2,", f"{SECOND}LT2,L2,")
    change(made, "process.py", '{"L1": b1.volume,', '{"L1": b1.volume, "L3": b1.volume,')
    return made


def test_each_loop_is_named_with_instrument_and_limits_in_one_note() -> None:
    (only,) = alone(Bench(TANKS))
    assert only.severity is Severity.NOTE and only.where.file == "engineering/loops.csv" and only.where.key == "LIC1"
    assert "'LIC1' controls by 'LT1' alone, which judges LIM-L1-HIGH and LIM-L1-LOW as well" in only.what
    assert "'TIC2' controls by 'TT2' alone, which judges LIM-T2-HIGH as well" in only.what and "FIC1" not in only.what


def test_a_limit_with_a_second_instrument_is_judged_by_both(tmp_path: Path) -> None:
    folder = with_second(tmp_path)
    change(folder, "engineering/limits.csv", "L1 <= 180", "L1 <= 180 or L3 <= 180")
    (only,) = alone(Bench(folder))
    assert "LIM-L1-LOW" in only.what and "LIM-L1-HIGH" not in only.what


def test_a_symptom_that_compares_it_with_another_shows_it(tmp_path: Path) -> None:
    folder = with_second(tmp_path)
    (folder / "engineering" / "features.csv").write_text(FEATURES, "utf-8")
    (folder / "engineering" / "symptoms.csv").write_text(SYMPTOMS, "utf-8")
    (folder / "engineering" / "symptom_faults.csv").write_text("symptom,fault\nS-LEVELS,V1_weak\n", "utf-8")
    (only,) = alone(Bench(folder))
    assert "LIC1" not in only.what and "LIC2" in only.what


@pytest.mark.parametrize("name", ["cstr", "mixing_module"])
def test_balances_of_the_plants_that_ship_show_it(name: str) -> None:
    assert list(alone(Bench(INSTALLED / name))) == []
