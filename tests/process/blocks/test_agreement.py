"""Units of equations: what is added, what a rate is, what an instrument shows; and flowsheets that cannot be."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from homeostat.process.blocks import Flowsheet, FlowsheetError, Vessel, exp, heater, linear_valve
from homeostat.process.blocks.agreement import StatedUnits, disagreements
from homeostat.process.blocks.units import UnitError, read
from tests.process.blocks.sheets import composed, two_tanks

PARAMETERS = {
    "T_feed": "K", "sd_T_feed": "K", "tau_feed": "s", "F_V1": "L/s", "V_start": "L", "cp": "kJ/(L K)",
    "Kv_12": "L/(s dm^0.5)", "A_B1": "dm2", "F_P1": "L/s", "P_H1": "kW", "tau_V1": "s", "tau_P1": "s", "tau_H1": "s",
    "Kp_FIC1": "s/L", "Ki_FIC1": "1/L", "Kp_LIC2": "1/L", "Ki_LIC2": "1/(L s)", "Kp_TIC2": "1/K", "Ki_TIC2": "1/(K s)",
}  # fmt: skip
VARIABLES = {
    "T0": "K", "T1": "K", "T2": "K", "L1": "L", "L2": "L", "F1": "L/s", "F2": "L/s", "V1_zt": "1", "P1_zt": "1",
    "H1_zt": "1", "F1_sp": "L/s", "L2_sp": "L", "T2_sp": "K",
}  # fmt: skip


def stated(**other: str) -> StatedUnits:
    """Units of the two tanks' tables, some of them other ones."""
    relative = {"F1", "F2"}
    instruments = {
        f"{what}_{name}": "1" if name in relative else unit
        for name, unit in VARIABLES.items()
        for what in ("bias", "sd")
    }
    return StatedUnits({**instruments, **PARAMETERS, **other}, VARIABLES, {"B1_leak": "1/s"})


def test_the_two_tanks_agree() -> None:
    assert disagreements(two_tanks(), stated()) == ()


@pytest.mark.parametrize(
    ("symbol", "unit", "told"),
    [
        ("F_V1", "kg/s", "B1_V"),
        ("cp", "kJ/(kg K)", "B2_T"),
        ("P_H1", "W", "B2_T"),
        ("cp", "kJ/L", "B2_T"),
        ("A_B1", "dm", "B1_V"),
        ("T_feed", "L", "T_feed"),
        ("tau_V1", "min", "time constant of V1"),
        ("Ki_TIC2", "1/K", "Ki_TIC2"),
        ("Kp_LIC2", "1/K", "Kp_LIC2"),
        ("V_start", "m3", "start of B1_V"),
        ("sd_T_feed", "1", "noise of T_feed"),
        ("bias_L1", "K", "calibration error of L1"),
        ("P_H1", "kWh/flurb", "P_H1"),
    ],
)
def test_a_wrong_unit_is_found_where_it_matters(symbol: str, unit: str, told: str) -> None:
    found = disagreements(two_tanks(), stated(**{symbol: unit}))
    assert found and any(told in each for each in found), found


def test_units_that_do_not_agree_are_said() -> None:
    found = disagreements(two_tanks(), stated(cp="kJ/(kg K)"))
    assert any("cp [kJ/(kg K)]" in each and "P_H1 [kW]" in each for each in found), found


def test_a_factor_may_convert_and_what_stands_in_a_sum_may_not() -> None:
    s = Flowsheet()
    b = Vessel(s, "B", "L", 10.0)
    b.heated(300.0, "cp")
    b.heat(0.001 * heater("P", s.actuator("H").opening))
    s.sensor("L", b.volume)
    units = {"cp": "kJ/(L K)", "P": "W", "tau_H": "s", "bias_L": "L", "sd_L": "L"}
    assert disagreements(s, StatedUnits(units, {"L": "L"}, {})) == ()
    s.quantity("odd", b.volume)
    s.rate(s.state("x", "L", 0.0), exp(b.volume))
    found = disagreements(s, StatedUnits(units, {"L": "L"}, {}))
    assert any("exp is taken of it" in each for each in found)


@pytest.mark.parametrize(
    ("symbol", "size"), [("1", 1.0), ("%", 0.01), ("L/s", 1e-3), ("m3/h", 1.0 / 3600.0), ("degC", 1.0)]
)
def test_units_as_tables_write_them(symbol: str, size: float) -> None:
    assert read(symbol).size == pytest.approx(size)


@pytest.mark.parametrize("symbol", [" ", "flurb", "L per", "1/0", "K K K(", "import os"])
def test_what_is_no_unit_is_refused(symbol: str) -> None:
    with pytest.raises(UnitError, match="no unit"):
        read(symbol)


def broken(of: Callable[[Flowsheet, Vessel], object]) -> Callable[[], object]:
    """A flowsheet of a tank, with a mistake, that is completed."""

    def made() -> object:
        s = Flowsheet()
        b = Vessel(s, "B", "L", 10.0)
        s.sensor("L", b.volume)
        of(s, b)
        return composed(s, {})

    return made


@pytest.mark.parametrize(
    ("of", "told"),
    [
        (lambda s, b: s.state("x", "L", 0.0), "state x has no rate"),
        (lambda s, b: s.rate(b.volume, b.volume), "stated twice"),
        (lambda s, b: s.sensor("L", b.volume), "there already as a sensor"),
        (lambda s, b: s.sensor("V_position", s.actuator("V").position), "column of two parts"),
        (lambda s, b: s.sensor("L 2", b.volume), "no name"),
        (lambda s, b: s.loop("LIC", measured="M", drives="V", acts=1), "no sensor shows"),
        (lambda s, b: s.controller("LIC", "L", acts=2), "acts = 2"),
        (lambda s, b: s.actuator("V", b.volume), "true 'B_V'"),
        (lambda s, b: s.controller("LIC", "L", acts=1, forward=b.volume), "true 'B_V'"),
        (lambda s, b: s.delay("d", b.volume, 0), "more than 0 s"),
        (lambda s, b: s.delay("d", b.volume, 601), "more than 600 ticks of 1 s"),
        (lambda s, b: s.actuator("V", start=2.0), "within 0 and 1"),
        (lambda s, b: s.actuator("B_V"), "'B_V' is there already as a state; give each part a name of its own"),
        (lambda s, b: (s.actuator("P"), s.sensor("P", b.volume)), "'P' is there already as an actuator"),
        (lambda s, b: s.actuator("V", lags=("a", "b", "c")), "one or two"),
        (lambda s, b: b.feed(linear_valve("F", 1.0), A=1.0), "holds no 'A'"),
        (lambda s, b: b.react(b.volume, A=-1.0), "holds no 'A'"),
        (lambda s, b: s.sensor("A", b.volume, every_s=-1.0), "at least 0"),
        (lambda s, b: s.rate(Flowsheet().state("y", "L", 0.0), b.volume), "no state of this flowsheet"),
        (lambda s, b: s.equations(lambda B_V: 0.0), "return a dictionary"),
        (lambda s, b: s.equations(lambda B_V: {"z": B_V}), "which is no state"),
        (lambda s, b: (b.heated(300.0, "cp"), b.feed(linear_valve("F", 1.0))), "no temperature"),
    ],
)
def test_a_mistake_is_told_in_one_line(of: Callable[[Flowsheet, Vessel], object], told: str) -> None:
    with pytest.raises(FlowsheetError, match=told) as raised:
        broken(of)()
    assert "\n" not in str(raised.value)


def test_own_equations_are_a_function_of_states_and_parameters() -> None:
    s = Flowsheet()
    x, v = s.state("x", "m", 1.0), s.state("v", "m/s", 0.0)

    def spring(x: float, v: float, stiffness: float, mass: float) -> dict[str, float]:
        return {"x": v, "v": -stiffness * x / mass}

    s.equations(spring)
    s.sensor("X", x)
    s.sensor("W", v)
    model = composed(s, {"stiffness": 1.0, "mass": 1.0})
    assert {"stiffness", "mass"} <= set(model.parameters)
    units = {"stiffness": "N/m", "mass": "kg", "bias_X": "m", "sd_X": "m", "bias_W": "m/s", "sd_W": "m/s"}
    assert disagreements(s, StatedUnits(units, {"X": "m", "W": "m/s"}, {})) == ()
    assert disagreements(s, StatedUnits({**units, "mass": "g"}, {"X": "m", "W": "m/s"}, {}))
