"""A fallback after which nobody can start again is said where there is a way back after another one."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.safe_states import after_fallbacks
from homeostat.evaluate.lint.deep.way_back import ways_back
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.plants.files.folder import INSTALLED
from tests.evaluate.lint.copied import copied
from tests.evaluate.two_tanks import TANKS, change, tanks


def said(folder: Path) -> list[Finding]:
    bench = Bench(folder)
    return [*ways_back(bench, after_fallbacks(bench))]


def test_one_whose_state_leaves_nothing_open_that_helps_is_told(tmp_path: Path) -> None:
    folder = copied("cstr", tmp_path)
    change(folder, "engineering/setpoints.csv", "shutdown,L1.sp,2.5,10,2.5", "shutdown,L1.sp,,,2.5")
    (only,) = said(folder)
    assert only.severity is Severity.WARNING
    assert only.where.file == "engineering/fallbacks.csv" and only.where.key == "isolate"
    assert "after 'isolate' nobody can start again, unlike after 'drain'" in only.what
    assert "'T1 <= 310 and L1 <= 4.5' (t_restart) holds at no moment" in only.what
    assert "what 'shutdown' leaves open, 'V2.man' (0 to 1)" in only.what and "setpoints.csv" in only.remedy


def test_one_after_which_a_person_may_move_a_setpoint_is_not() -> None:
    assert said(INSTALLED / "cstr") == []


def test_a_state_that_no_decision_leads_out_of_is_told(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/transitions.csv", "t_restart,shutdown|flushing", "t_restart,shutdown")
    (only,) = said(folder)
    assert only.where.key == "flush" and "no decision leads out of 'flushing'" in only.what


@pytest.mark.slow
def test_a_start_that_a_permissive_forbids_is_no_way_back(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    rule = "PRM-FEED,permissive,F1.sp <= 0.01 or T1 <= 0,Cause and effect CE-2,Nothing is fed that is not ice"
    change(folder, "engineering/limits.csv", "LIM-L1-LOW,", f"{rule}\nLIM-L1-LOW,")
    found = said(folder)
    assert found and all("a permissive forbids what 'starting' is by design" in each.what for each in found)


@pytest.mark.slow
def test_where_nobody_can_start_again_at_all_the_guard_is_told_and_no_fallback(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/transitions.csv", "starting,true,Start again", "starting,L1 >= 150,Start again")
    found = said(folder)
    assert {each.severity for each in found} == {Severity.ERROR}
    assert {each.where.file for each in found} == {"engineering/transitions.csv"}


def test_the_fallbacks_of_the_example_are_left_again() -> None:
    assert said(TANKS) == []
