"""One mistake in a plant's folder is one finding, at the row or line that has to be corrected."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from homeostat.evaluate.lint.deep.actions import actions
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding
from homeostat.evaluate.lint.fits import fits
from homeostat.evaluate.lint.stated import stated
from homeostat.plants.files.folder import read_files
from tests.evaluate.two_tanks import TANKS, change, tanks


class Slip(NamedTuple):
    """One mistake, and what its finding says."""

    file: str
    before: str
    """What is there before; empty where the file is none of the example's."""
    after: str
    where: str
    says: tuple[str, ...]


FAULT = """id,label,component,severity_unit,nominal,low,high,prior,disables,description
B2_scale,Scale,B2,1,0.5,0.1,0.9,0.05,,Scale on the heater
"""
SLIPS = {
    "a flow in L/h": Slip(
        "engineering/parameters.csv", "flow_V1,0.4,L/s", "flow_V1,1440,L/h", "parameters.csv row 5 (flow_V1)",
        ("'L/h' does not fit, 'L/s' would", "F1"),
    ),
    "a power in W": Slip(
        "engineering/parameters.csv", "power_H1,60,kW", "power_H1,60000,W", "parameters.csv row 8 (power_H1)",
        ("'W' does not fit, 'kW' would",),
    ),
    "an instrument in m3/s": Slip(
        "engineering/instruments.csv", "FT3,F3,L/s,0,1,", "FT3,F3,m3/s,0,0.001,", "instruments.csv row 6 (F3)",
        ("'m3/s' does not fit, 'L/s' would", "what F3 measures"),
    ),
    "an instrument of a loop in m3/s": Slip(
        "engineering/instruments.csv", "FT1,F1,L/s,0,1,", "FT1,F1,m3/s,0,1,", "instruments.csv row 4 (F1)",
        ("'m3/s' does not fit, 'L/s' would", "what F1 measures"),
    ),
    "a symbol in the code": Slip(
        "process.py", 'linear_valve("flow_V1"', 'linear_valve("flow_v1"', "process.py line 8 (flow_v1)",
        ("stated in no table", "write 'flow_V1'", "parameters.csv row 5"),
    ),
    "a symbol in the table": Slip(
        "engineering/parameters.csv", "tau_V1,", "Tau_V1,", "parameters.csv row 11 (Tau_V1)",
        ("needs 'tau_V1'", "give the row the name 'tau_V1'"),
    ),
    "another name for a symbol": Slip(
        "process.py", '"flow_P2"', '"rate_of_the_last_pump"', "process.py line 10 (rate_of_the_last_pump)",
        ("stated in no table", "write 'flow_P2'", "parameters.csv row 7"),
    ),
    "a sensor that is not there": Slip(
        "process.py", '"F1": feed, ', "", "process.py line 8 (F1)",
        ("controller FIC1 reads 'F1'", 'add FLOWSHEET.sensor("F1", ...)'),
    ),
    "a sensor that no loop reads": Slip(
        "process.py", '"T1": t1, ', "", "instruments.csv row 7 (T1)",
        ("no variable 'T1'", 'add FLOWSHEET.sensor("T1", ...) to process.py'),
    ),
    "gains of two signs": Slip(
        "engineering/parameters.csv", "Kp_TIC2,0.05", "Kp_TIC2,-0.05", "parameters.csv row 21 (Kp_TIC2)",
        ("Kp_TIC2 = -0.05", "Ki_TIC2 = 0.0002", "different signs"),
    ),
    "a limit below the setpoint": Slip(
        "engineering/limits.csv", "L1 <= 180", "L1 <= 90", "limits.csv row 2 (LIM-L1-HIGH)",
        ("holds 'L1' at 100 L", "setpoints.csv row 2"),
    ),
    "a limit beyond the instrument": Slip(
        "engineering/limits.csv", "L1 <= 180", "L1 <= 300", "limits.csv row 2 (LIM-L1-HIGH)",
        ("with 300, outside its range [-10, 220] L",),
    ),
    "a command that a loop writes": Slip(
        "engineering/fallbacks.csv", "stop,,H1.man,0", "stop,,H1.cmd,0", "fallbacks.csv row 3 (stop H1.cmd)",
        ("loop 'TIC2' writes it",),
    ),
    "a tag of a loop": Slip(
        "engineering/loops.csv", "LIC2,L2,", "LIC2,LL2,", "loops.csv row 4 (LIC2)", ("no tag 'LL2'", "mean 'L2'"),
    ),
    "a kind of equipment": Slip(
        "engineering/equipment.csv", "P2,Actuator", "P2,Pump", "equipment.csv row 7 (P2)", ("'Pump' is none of",),
    ),
    "a permissive on a manual output": Slip(
        "engineering/limits.csv", "T2.sp <= 25 or", "H1.man <= 0.05 or", "limits.csv row 5 (PRM-HEAT)",
        ("has no value on automatic", "read 'H1.cmd'"),
    ),
    "a stream that enters nothing": Slip(
        "engineering/streams.csv", "feed,,,V1,\n", "", "streams.csv row 2 (V1)", ("leaves 'V1'", "none enters it"),
    ),
    "a symbol that no table states": Slip(
        "process.py", "b1.feed(feed, ", 'b1.feed(feed * "share", ', "process.py line 11 (share)",
        ("add its row to engineering/parameters.csv",),
    ),
    "a fault without an equation": Slip(
        "engineering/faults.csv", "", FAULT, "faults.csv row 2 (B2_scale)",
        ('FLOWSHEET.fault("B2_scale")', "process.py"),
    ),
}  # fmt: skip
"""Mistake -> what is changed, and the one finding."""


def found(folder: Path) -> list[Finding]:
    """What the plain check finds that counts."""
    first = stated(read_files(folder))
    if not first.sound:
        return [finding for finding in first.findings if finding.counts]
    return [finding for finding in fits(folder) if finding.counts]


COMMON = (
    "a flow in L/h", "an instrument of a loop in m3/s", "a symbol in the code", "a sensor that is not there",
    "a sensor that no loop reads", "gains of two signs", "a limit below the setpoint", "a limit beyond the instrument",
    "a command that a loop writes", "a tag of a loop", "a kind of equipment", "a stream that enters nothing",
    "a symbol that no table states", "a fault without an equation",
)  # fmt: skip


@pytest.mark.parametrize(
    "slip", [pytest.param(s, id=name, marks=[] if name in COMMON else pytest.mark.wide) for name, s in SLIPS.items()]
)
def test_a_mistake_is_one_finding_where_it_is(slip: Slip, tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    if slip.before:
        change(folder, slip.file, slip.before, slip.after)
    else:
        (folder / slip.file).write_text(slip.after, "utf-8")
    (only,) = found(folder)
    assert str(only.where).removeprefix("engineering/") == slip.where
    assert all(text in str(only) for text in slip.says), str(only)


def test_two_mistakes_are_two_findings(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    for name in ("a flow in L/h", "an instrument in m3/s"):
        change(folder, *SLIPS[name][:3])
    assert sorted(finding.where.key for finding in found(folder)) == ["F3", "flow_V1"]


@pytest.mark.parametrize(("value", "sound"), [("0", True), ("0.05", True), ("-0.1", True), ("0.001", False)])
def test_what_lies_around_0_may_have_an_absolute_deviation(value: str, sound: bool, tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/parameters.csv", "T_feed,20,degC,0.2,", f"T_feed,{value},degC,0.2,")
    said = [str(finding) for finding in stated(read_files(folder)).findings if finding.counts]
    assert not said if sound else len(said) == 1 and "state the value as 0" in said[0]


@pytest.mark.slow
def test_a_loop_that_acts_the_wrong_way_is_told_with_its_line(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "process.py", 'drives="H1", acts=-1', 'drives="H1", acts=1')
    (only,) = actions(Bench(folder))
    assert only.where.file == "process.py" and only.where.key == "TIC2" and only.where.row
    assert "'TIC2' acts the wrong way" in only.what and "turn acts round" in only.remedy


def test_no_loop_of_the_example_acts_the_wrong_way() -> None:
    assert [*actions(Bench(TANKS))] == []


def test_a_fault_of_an_equation_without_a_row_is_told_with_its_line_and_no_unit(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    text = (folder / "process.py").read_text("utf-8")
    (folder / "process.py").write_text(f'{text}b2.heat(-tanks.fault("B2_cooled"))\n', "utf-8")
    (only,) = [each for each in fits(folder) if each.counts]
    assert str(only.where) == f"process.py line {text.count(chr(10)) + 1} (B2_cooled)"
    assert "faults.csv has no row of it: it is never there" in only.what and "severity_unit" in only.remedy


def test_a_heat_capacity_per_mass_is_told_with_the_unit_that_fits_and_few_symbols(tmp_path: Path) -> None:
    folder = tanks(tmp_path)
    change(folder, "engineering/parameters.csv", "kJ/(L K)", "kJ/(kg K)")
    (only,) = [each for each in fits(folder) if each.counts]
    assert only.where.key == "cp" and "unit 'kJ/(kg K)' does not fit, 'kJ/(L K)' would" in only.what
    assert only.what.partition("are added")[0].count(",") < 9
