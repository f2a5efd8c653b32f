"""Loops of the tables are the controllers of the flowsheet: where the two differ, row, line and remedy are told."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.check import check
from homeostat.evaluate.lint.finding import Finding, Severity
from tests.evaluate.lint.copied import copied

EXAMPLES = Path(__file__).parents[3] / "examples"
GENERATED = shutil.ignore_patterns("plant.ttl", "__pycache__")
LOOPS, CODE = "engineering/loops.csv", "process.py"
Change = tuple[str, str, str]
"""File, what stands there, and what takes its place."""


def found(made: Path, *changes: Change) -> list[Finding]:
    """What counts of what is found once all ``changes`` are made."""
    for name, before, after in changes:
        text = (made / name).read_text("utf-8")
        assert before in text
        (made / name).write_text(text.replace(before, after), "utf-8")
    return [each for each in check(str(made)).findings if each.counts]


def example(name: str, folder: Path, *changes: Change) -> list[Finding]:
    return found(Path(shutil.copytree(EXAMPLES / name, folder / name, ignore=GENERATED)), *changes)


def test_a_controller_that_reads_something_else_is_one_finding(tmp_path: Path) -> None:
    (told,) = example("buffer_pumps", tmp_path, (CODE, '"FIC2", measured="F2"', '"FIC2", measured="F1"'))
    assert (told.where.file, told.where.row, told.where.key) == (LOOPS, 4, "FIC2")
    assert told.severity is Severity.ERROR and "holds 'F2' here" in told.what
    assert "process.py line 24 (FIC2) its controller reads 'F1'" in told.what
    assert told.remedy == "write pv 'F1' here, or measured=\"F2\" there"


@pytest.mark.slow
def test_two_controllers_that_read_each_others_level_are_both_told(tmp_path: Path) -> None:
    swapped = (
        (CODE, '"LIC1", measured="L1"', '"LIC1", measured="none"'),
        (CODE, '"LIC2", measured="L2"', '"LIC2", measured="L1"'),
        (CODE, 'measured="none"', 'measured="L2"'),
    )
    told = example("two_tanks", tmp_path, *swapped)
    assert [each.where.key for each in told] == ["LIC1", "LIC2"] and all("reads" in each.what for each in told)


@pytest.mark.slow
def test_two_controllers_that_drive_each_others_pump_are_both_told(tmp_path: Path) -> None:
    swapped = (
        (CODE, 'drives="P1"', 'drives="none"'), (CODE, 'drives="P2"', 'drives="P1"'),
        (CODE, 'drives="none"', 'drives="P2"'),
    )  # fmt: skip
    told = example("two_tanks", tmp_path, *swapped)
    assert [(each.where.row, each.where.key) for each in told] == [(3, "LIC1"), (4, "LIC2")]
    assert "moves 'P1.cmd' here" in told[0].what and "controller goes to 'P2.cmd'" in told[0].what
    assert told[0].remedy.startswith("write mv P2.cmd here, or ")


@pytest.mark.slow
@pytest.mark.parametrize("mv", ["V5.cmd", "P2.sp"])
def test_the_outer_loop_of_a_cascade_moves_the_setpoint_of_the_inner_one(mv: str, tmp_path: Path) -> None:
    told = example("instrument_air", tmp_path, (LOOPS, "A1,F5.sp", f"A1,{mv}"))[0]
    assert told.where.key == "AIC1" and f"moves '{mv}' here" in told.what and "goes to 'F5.sp'" in told.what


@pytest.mark.slow
def test_an_inner_loop_that_the_tables_leave_out_lies_between(tmp_path: Path) -> None:
    left_out = ((LOOPS, "FIC5,F5,V5.cmd\n", ""), (LOOPS, "A1,F5.sp", "A1,V5.cmd"))
    assert example("instrument_air", tmp_path, *left_out) == []


@pytest.mark.slow
def test_an_output_that_moves_more_than_its_row_says_is_told(tmp_path: Path) -> None:
    one_pump = (
        (LOOPS, "P1.cmd|P2.cmd", "P1.cmd"), ("engineering/fallbacks.csv", "stop,,P2.man,0\n", ""),
        ("engineering/setpoints.csv", "holding|shutdown,P2.man,,,0\n", ""),
        ("engineering/setpoints.csv", "relieving|draining,P2.man,0,0,\n", ""),
    )  # fmt: skip
    (told,) = example("buffer_pumps", tmp_path, *one_pump)
    assert told.where.key == "PIC1" and told.severity is Severity.WARNING and "'P2.cmd' as well" in told.what


@pytest.mark.slow
def test_controllers_with_names_of_their_own_are_known_by_their_gains(tmp_path: Path) -> None:
    swapped = (
        (LOOPS, "T1.sp,V2.cmd", "T1.sp,none"), (LOOPS, "F1.sp,V1.cmd", "F1.sp,V2.cmd"),
        (LOOPS, "T1.sp,none", "T1.sp,V1.cmd"),
    )  # fmt: skip
    told = [each for each in found(copied("cstr", tmp_path), *swapped) if each.check == "loops"]
    assert [each.where.key for each in told] == ["FIC1-loop", "TIC1-loop"]
    assert "in the model (flow) the output of its controller goes to 'V1.cmd'" in told[0].what


@pytest.mark.slow
def test_a_setpoint_of_another_controller_is_told(tmp_path: Path) -> None:
    swapped = (
        (LOOPS, "T1,T1.sp", "T1,none"), (LOOPS, "L1,L1.sp", "L1,T1.sp"), (LOOPS, "T1,none", "T1,L1.sp"),
    )  # fmt: skip
    told = [each for each in found(copied("cstr", tmp_path), *swapped) if each.check == "loops"]
    assert [each.where.key for each in told] == ["LIC1-loop", "TIC1-loop"]
    assert "in the model (level) its controller follows 'L1.sp'" in told[0].what


@pytest.mark.slow
def test_a_controller_without_a_row_has_no_setpoint(tmp_path: Path) -> None:
    gains = "Kp_TIC1,0.05,1/K,0,,H1,Proportional gain\nKi_TIC1,0.0002,1/(K s),0,,H1,Integral gain\n"
    added = (
        (CODE, "tanks.total(", 'tanks.controller("TIC1", measured="T1", acts=-1)\ntanks.total('),
        ("engineering/parameters.csv", "Kp_TIC2,", f"{gains}Kp_TIC2,"),
    )
    (told,) = example("two_tanks", tmp_path, *added)
    assert told.where.file == LOOPS and "no row has the controller 'TIC1' of process.py line 21 (TIC1)" in told.what


@pytest.mark.slow
@pytest.mark.parametrize("name", ["exchanger_train", "instrument_air"])
def test_split_ranges_overrides_and_cascades_are_not_told(name: str, tmp_path: Path) -> None:
    assert example(name, tmp_path) == []


@pytest.mark.slow
def test_ratios_trims_and_stand_ins_are_not_told(tmp_path: Path) -> None:
    assert found(copied("tennessee_eastman", tmp_path)) == []


@pytest.mark.slow
def test_a_row_without_a_controller_is_one_finding(tmp_path: Path) -> None:
    by_hand = (CODE, 'tanks.loop("LIC2", measured="L2", drives="P2", acts=1)', 'tanks.actuator("P2")')
    (told,) = example("two_tanks", tmp_path, by_hand)
    assert told.where.key == "LIC2" and "loop 'LIC2' has no controller in process.py" in told.what
    assert 'add FLOWSHEET.controller("LIC2", measured="L2", acts=...)' in told.remedy


def test_a_controller_with_another_name_is_told_by_its_parameters(tmp_path: Path) -> None:
    told = example("two_tanks", tmp_path, (CODE, '"LIC2"', '"LICX"'))
    assert [each.where.key for each in told] == ["Ki_LIC2", "Kp_LIC2"]
