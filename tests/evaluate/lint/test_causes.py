"""A number that makes a plant restless, or break, is named with its row; what only follows from it is not blamed."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.checks import CHECKS
from homeostat.evaluate.lint.child import findings_of
from homeostat.evaluate.lint.deep.actions import actions
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.causes import causes
from homeostat.evaluate.lint.finding import Finding, Severity
from tests.evaluate.two_tanks import TANKS, change, tanks

PARAMETERS = "engineering/parameters.csv"
EXAMPLES = TANKS.parent


def example(name: str, folder: Path, *changes: tuple[str, str]) -> Path:
    ignored = shutil.ignore_patterns("plant.ttl", "__pycache__")
    made = Path(shutil.copytree(EXAMPLES / name, folder / name, ignore=ignored))
    for before, after in changes:
        change(made, PARAMETERS, before, after)
    return made


@pytest.mark.slow
@pytest.mark.parametrize("name", ["two_tanks", "instrument_air"])
def test_a_plant_in_order_has_none(name: str) -> None:
    assert [*causes(Bench(EXAMPLES / name))] == []


@pytest.mark.slow
def test_the_outer_loop_of_a_cascade_is_blamed_for_what_the_inner_one_makes_of_it(tmp_path: Path) -> None:
    (only,) = causes(Bench(example("instrument_air", tmp_path, ("Ki_AIC1,0.02,", "Ki_AIC1,2,"))))
    assert only.where.key == "Ki_AIC1" and only.where.row and only.severity is Severity.ERROR
    assert "loop 'AIC1' is the cause, and 'FIC5'" in only.what and "only follow" in only.what
    assert "Ki_AIC1" in only.remedy and "FIC5" not in only.remedy


@pytest.mark.slow
def test_the_inner_one_is_blamed_for_its_own_gain(tmp_path: Path) -> None:
    first, tick = causes(Bench(example("instrument_air", tmp_path, ("Ki_FIC5,0.05,", "Ki_FIC5,5,"))))
    assert first.where.key == "Ki_FIC5" and "loop 'FIC5' is the cause" in first.what
    assert tick.severity is Severity.WARNING and "Kp_FIC5" in tick.what, "which a shorter tick would bear"


@pytest.mark.slow
def test_the_sign_of_an_outer_loop_is_told_at_its_row(tmp_path: Path) -> None:
    folder = example("instrument_air", tmp_path, ("Kp_AIC1,1,", "Kp_AIC1,-1,"), ("Ki_AIC1,0.02,", "Ki_AIC1,-0.02,"))
    (only,) = causes(Bench(folder))
    assert only.where.key == "Kp_AIC1" and "turn acts of 'AIC1' round" in only.remedy


def test_a_loop_that_another_takes_along_does_not_act_the_wrong_way(tmp_path: Path) -> None:
    folder = example("instrument_air", tmp_path, ("Kp_PIC2,0.2,", "Kp_PIC2,-0.2,"), ("Ki_PIC2,0.01,", "Ki_PIC2,-0.01,"))
    (only,) = actions(Bench(folder))
    assert only.where.key == "Kp_PIC2", (
        "the row whose number is negative, and not the compressor that has nothing to do"
    )


def test_an_actuator_that_is_slower_than_its_loop_is_told_before_the_gains(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, PARAMETERS, "tau_H1,10,", "tau_H1,600,")
    (only,) = causes(Bench(folder))
    assert only.where.key == "tau_H1" and "too slow" in only.what
    assert only.remedy.index("tau_H1") < only.remedy.index("Ki_TIC2")


@pytest.mark.slow
def test_one_that_its_loop_only_waits_for_is_a_warning(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, PARAMETERS, "tau_V1,2,", "tau_V1,120,")
    (only,) = causes(Bench(folder))
    assert only.severity is Severity.WARNING and only.where.key == "tau_V1"
    assert "tau_V1 = 120 s is 120 times the reset time of loop 'FIC1'" in only.what


@pytest.mark.slow
def test_a_tick_that_is_long_for_a_loop_is_told_with_row_value_and_remedy(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "case.toml", "[run]", "[time]\ntick_s = 5.0\n\n[run]")
    change(folder, PARAMETERS, "Kp_FIC1,0.5,", "Kp_FIC1,1,")
    (only,) = causes(Bench(folder))
    assert only.severity is Severity.WARNING and str(only.where) == "case.toml (time, tick_s)"
    assert "a tick of 5 s" in only.what and "Kp_FIC1" in only.what and "tick_s of at most 0." in only.remedy


@pytest.mark.parametrize("check", ["interface", "causes"])
def test_a_plant_that_breaks_is_told_with_the_number_that_is_mistyped(check: str, tmp_path: Path) -> None:
    folder = example("exchanger_train", tmp_path, ("flow_V1,1,", "flow_V1,36000,"))
    (only,) = findings_of(CHECKS[check], Bench(folder))
    assert isinstance(only, Finding) and only.where.key == "flow_V1" and only.where.row
    assert "a number per hour typed as one per second" in only.what and "Traceback" not in str(only)


@pytest.mark.slow
def test_a_rate_that_is_mistyped_is_told_where_nothing_breaks(tmp_path: Path) -> None:
    (only,) = causes(Bench(example("exchanger_train", tmp_path, ("flow_V1,1,", "flow_V1,3600,"))))
    assert only.where.key == "flow_V1" and only.severity is Severity.ERROR
    assert "every loop does if flow_V1 = 1 kg/s: a number per hour typed as one per second" in only.what
