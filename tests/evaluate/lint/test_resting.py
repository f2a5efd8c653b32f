"""A controller that rests, or that an override keeps from acting, is off its setpoint: it says how to state that.

One that is needed, that acts the wrong way, or that has given all that it has is wrong all the same.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.fault_free import healthy_symptoms
from homeostat.evaluate.lint.deep.loops import loops
from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.plants.scaffold import make_plant

AIR = Path(__file__).parents[3] / "examples" / "instrument_air"
OMITTED = "symptoms,S-JIC1-OFF,"


def air(folder: Path, **shown: str) -> Bench:
    """The example with the symptom of the resting controller, and with one of its rows stated."""
    made = Path(shutil.copytree(AIR, folder / "air", ignore=shutil.ignore_patterns("plant.ttl", "__pycache__")))
    omitted = made / "engineering" / "omitted.csv"
    lines = omitted.read_text("utf-8").splitlines(keepends=True)
    assert any(line.startswith(OMITTED) for line in lines)
    omitted.write_text("".join(line for line in lines if not line.startswith(OMITTED)), "utf-8")
    for table, text in shown.items():
        (made / "engineering" / f"{table}.csv").write_text(text, "utf-8")
    return Bench(made)


@pytest.mark.slow
def test_the_symptom_of_a_resting_controller_may_be_left_out(tmp_path: Path) -> None:
    bench = air(tmp_path, symptoms="id,threshold,sigma,on_delay_s\nS-JIC1-OFF,0.001,0.5,1\nS-FIC4-OFF,0.0001,0.5,1\n")
    told = {rule.what.split("'")[1]: rule.remedy for rule in healthy_symptoms(bench)}
    assert told["S-JIC1-OFF"].endswith(
        "or leave it out where JIC1 and PIC1 override each other and it rests by design (omitted.csv)"
    )
    assert "omitted.csv" not in told["S-FIC4-OFF"]


def test_the_example_leaves_it_out() -> None:
    assert "JIC1" not in {name for rule in Bench(AIR).plant.description.symptom_rules for name in rule.name.split("-")}


def heated(folder: Path, *changes: tuple[str, str, str], needed: bool = False, left_out: bool = False) -> list[Finding]:
    """What is found of the loops of a heated tank that starts warm enough, with ``changes`` to what its files say."""
    make_plant(folder, "tanks")
    ready = ("engineering/guards.csv", "T1 >= 48 and T1 <= 52", "T1 >= 15")
    asked = () if needed else (("engineering/criteria.csv", "abs(T1.err) <= 2", "T1 <= 90"),)
    for file, old, new in (ready, *asked, *changes):
        text = (folder / file).read_text("utf-8")
        assert old in text
        (folder / file).write_text(text.replace(old, new), "utf-8")
    if left_out:
        rows = "table,row,reason\nsymptoms,S-TIC1-OFF,It rests by design\n"
        (folder / "engineering" / "omitted.csv").write_text(rows, "utf-8")
    return [each for each in loops(Bench(folder)) if each.where.key == "TIC1"]


COLD = ("engineering/setpoints.csv", "starting|normal|holding,T1.sp,,,50", "starting|normal|holding,T1.sp,,,10")
"""The heater is there against frost: the feed is warmer than its setpoint."""
WEAK = ("engineering/parameters.csv", "power_H1,60,", "power_H1,20,")
"""The heater gives all that it has."""


def test_a_loop_on_the_safe_side_of_its_setpoint_rests_and_its_symptom_may_be_left_out(tmp_path: Path) -> None:
    (found,) = heated(tmp_path / "frost", COLD)
    assert found.severity is Severity.WARNING
    assert "loop 'TIC1' rests" in found.what and "'H1.cmd' at its lower end, 0" in found.what
    assert "it acts once 'T1' is below it" in found.what
    assert "symptoms,S-TIC1-OFF" in found.remedy and "omitted.csv" in found.remedy


def test_one_whose_symptom_is_left_out_is_a_note(tmp_path: Path) -> None:
    (found,) = heated(tmp_path / "frost", COLD, left_out=True)
    assert found.severity is Severity.NOTE and "rests" in found.what


def test_one_that_a_criterion_needs_does_not_rest(tmp_path: Path) -> None:
    (found,) = heated(tmp_path / "frost", COLD, needed=True, left_out=True)
    assert found.severity is Severity.ERROR and "has no more to give" in found.what


def test_one_that_has_given_all_that_it_has_does_not_rest(tmp_path: Path) -> None:
    (found,) = heated(tmp_path / "weak", WEAK)
    assert found.severity is Severity.ERROR and "'H1.cmd' stands at its upper end, 1" in found.what


def test_at_the_upper_end_one_rests_where_the_tables_say_so(tmp_path: Path) -> None:
    (found,) = heated(tmp_path / "open", WEAK, left_out=True)
    assert found.severity is Severity.NOTE and "'H1.cmd' at its upper end, 1" in found.what


@pytest.mark.slow
def test_one_that_acts_the_wrong_way_does_not_rest(tmp_path: Path) -> None:
    old = 'measured="T1", drives="H1", acts=-1'
    (found,) = heated(tmp_path / "turned", ("process.py", old, old.replace("-1", "1")), left_out=True)
    assert found.severity is Severity.ERROR and "'H1.cmd' stands at its lower end, 0" in found.what
