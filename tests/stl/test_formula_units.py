"""The unit of a margin and the normalisation where units mix."""

from __future__ import annotations

import re

import numpy as np
import pytest

from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.stl.formula import FormulaError, parse, parse_expression
from homeostat.stl.units import is_rate

pytestmark = pytest.mark.quick

TAGS = {
    tag.name: tag
    for tag in (
        Tag("T1", Role.PV, "K", Range(273.0, 373.0), 2.0),
        Tag("T1.sp", Role.SP, "K", Range(273.0, 373.0), 4.0),
        Tag("F1", Role.PV, "L/s", Range(0.0, 10.0), 0.5),
        Tag("F2", Role.PV, "L/s", Range(0.0, 10.0), 0.25),
        Tag("V1.pos", Role.STATUS, "1", Range(0.0, 1.0), 0.1),
    )
}
POINT = {"T1": 300.0, "T1.sp": 304.0, "F1": 6.0, "F2": 2.0, "V1.pos": 0.5}


@pytest.mark.parametrize(
    ("text", "unit", "margin"),
    [
        ("T1 <= 313", "K", 13.0),
        ("abs(T1 - T1.sp) <= 1", "K", -3.0),
        ("T1 <= 313 and T1.sp >= 273", "K", 13.0),
        ("2 * T1 <= T1.sp / 2 + 500", "K", 52.0),
        ("-max(T1, 310) <= min(T1.sp, 0)", "K", 310.0),
        ("T1 * 2 >= 0.5 and true", "K", 599.5),
        ("V1.pos >= 0.2", "1", 0.3),
        ("1 <= 3 and T1 <= 313", "K", 2.0),
        ("1 <= 3", "1", 2.0),
        # two units: each comparison is divided by the largest scale of its own tags
        ("T1 <= 313 and F1 >= 1", "1", 6.5),
        ("T1 <= T1.sp and F1 >= 1", "1", 1.0),
        ("not (V1.pos >= 0.4 -> F1 >= 9)", "1", 1.0),
        ("1 <= 3 or F1 <= 6 and T1 <= 0", "1", 2.0),
        # two units in one comparison
        ("F1 - 4 * V1.pos <= 5", "1", 2.0),
        ("T1 <= 50 * F1", "1", 0.0),
        # a product or quotient of tags has no unit of its own
        ("F1 * F2 <= 13", "1", 2.0),
        ("F1 / F2 <= 5", "1", 4.0),
        ("6 / F1 <= 2", "1", 2.0),
        ("F1 * F2 <= 13 and F1 <= 9", "1", 2.0),
    ],
)
def test_unit_and_margin(text: str, unit: str, margin: float) -> None:
    formula = parse(text, TAGS)
    assert formula.unit == unit
    assert formula.margin_at(POINT) == pytest.approx(margin, abs=1e-12)
    signals = {name: np.array([value, value]) for name, value in POINT.items()}
    assert formula.margins(signals, 1.0).tolist() == [[formula.margin_at(POINT)] * 2]


@pytest.mark.parametrize(
    ("text", "margin"),
    [
        ("always[0,1](T1 <= 313) and F1 >= 7", -3.0),
        ("eventually(T1 >= 320) or F1 >= 9", -0.5),
        ("not (T1 <= 313) and F1 >= 5", 2.0),
        ("T1 <= 319 implies F1 >= 7", 0.0),
        ("T1 >= 313 implies F1 >= 7", -2.0),
        ("(F1 >= 7) until[1,1] (T1 >= 313)", -2.0),
        ("(F1 >= 4) until[1,1] (T1 >= 316)", 1.5),
    ],
)
def test_scales_reach_every_operator(text: str, margin: float) -> None:
    formula = parse(text, TAGS)
    signals = {"T1": np.array([319.0, 319.0]), "F1": np.array([6.0, 6.0])}
    assert formula.unit == "1"
    assert formula.evaluate(signals, 1.0).value.tolist() == [margin]


def test_without_tags_margins_are_raw_and_the_unit_is_unknown() -> None:
    formula = parse("T1 <= 313 and F1 >= 1")
    assert formula.unit == ""
    assert formula.margin_at(POINT) == 5.0


def test_scales_survive_a_round_trip() -> None:
    formula = parse("T1 <= 313 and F1 >= 1", TAGS)
    assert parse(str(formula), TAGS).root == formula.root
    assert parse(str(formula)).root != formula.root


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        ("T1 <= F1", 7, "'T1' is in K and 'F1' in L/s"),
        ("T1 + F1 <= 300", 6, "'T1' is in K and 'F1' in L/s"),
        ("F1 >= 1 and always(T1 - V1.pos <= 3)", 25, "'T1' is in K and 'V1.pos' in 1"),
        ("max(T1, F1) <= 3", 9, "'T1' is in K and 'F1' in L/s"),
        ("T1 + 2 * V1.pos + F1 <= 3", 19, "'T1 + 2 * V1.pos' is in K and 'F1' in L/s"),
        ("abs(-T1) <= T1.sp * V1.pos + F1", 30, "'T1.sp * V1.pos' is in K and 'F1' in L/s"),
        ("F1 * F2 <= F1", 12, "'F1 * F2' is in L/s * L/s and 'F1' in L/s"),
        ("F1 / F2 + T1 <= 1", 11, "'F1 / F2' is in L/s / L/s and 'T1' in K"),
        ("T1 <= 3 until (2 * (T1 + F1) <= 3)", 26, "'T1' is in K and 'F1' in L/s"),
    ],
)
def test_different_units_are_not_added_or_compared(text: str, column: int, message: str) -> None:
    with pytest.raises(FormulaError, match=re.escape(f"column {column}: {message}; convert one of them")):
        parse(text, TAGS)
    assert parse(text).text == text, "nobody knows units without tags"


@pytest.mark.parametrize(
    "text",
    [
        "T1 <= T1.sp", "T1 + 3 <= 300", "0.5 <= F1 - F2", "T1 * V1.pos <= T1.sp", "F1 / F2 <= V1.pos",
        "F1 * T1 <= T1.sp * F2", "0.064 + 0.225 * T1 <= F1", "F1 - 4 * V1.pos <= 5", "F1 <= 0.06 * V1.pos * T1",
        "T1 / 9.787 <= F1", "min(1, 1.2 * F1) <= V1.pos", "max(0, min(F1, T1 / 9.8) - 0.2) <= F2",
    ],
)  # fmt: skip
def test_equal_units_and_units_that_a_coefficient_hides_go_together(text: str) -> None:
    assert parse(text, TAGS).text == text


@pytest.mark.parametrize(
    ("left", "right", "same"),
    [
        ("L/s", "L/s", True), ("L/s", "L / s", True), ("kJ/(kg K)", "kJ/(K kg)", True), ("m2", "m m", True),
        ("1/s", "s-1", True), ("kg.m/s2", "kg*m/s/s", True), ("°C", "°C", True), ("K", "°C", False), ("%", "1", False),
        ("L/s", "L/min", False), ("m3", "m2", False), ("", "K", True), ("5 apples", "5 apples", True),
    ],
)  # fmt: skip
def test_a_unit_is_known_by_its_factors(left: str, right: str, same: bool) -> None:
    tags = {n: Tag(n, Role.PV, u, Range(0.0, 1.0), 1.0) for n, u in (("a", left), ("b", right))}
    if same:
        assert parse("a <= b", tags).tags == {"a", "b"}
    else:
        with pytest.raises(FormulaError, match="convert one of them"):
            parse("a <= b", tags)


def test_an_expression_is_checked_as_well() -> None:
    with pytest.raises(FormulaError, match=re.escape("expression 'T1 - F1', column 6: 'T1' is in K")):
        parse_expression("T1 - F1", TAGS)


HEAT = {
    tag.name: tag
    for tag in (
        Tag("Q", Role.PV, "kW", Range(0.0, 100.0), 1.0),
        Tag("F", Role.PV, "L/s", Range(0.0, 10.0), 0.1),
        Tag("cp", Role.PV, "kJ/(L K)", Range(1.0, 10.0), 0.1),
        Tag("warm", Role.PV, "degC", Range(0.0, 100.0), 1.0),
        Tag("cold", Role.PV, "degC", Range(0.0, 100.0), 1.0),
        Tag("hot", Role.PV, "K", Range(273.0, 373.0), 1.0),
        Tag("turns", Role.PV, "Hz", Range(0.0, 50.0), 1.0),
        Tag("rate", Role.PV, "1/s", Range(0.0, 50.0), 1.0),
        Tag("small", Role.PV, "W", Range(0.0, 50.0), 1.0),
    )
}


@pytest.mark.parametrize(
    "text",
    [
        "Q - cp * F * (warm - cold) >= -1",
        "cp * F * (warm - cold) <= Q",
        "Q / F >= cp * (warm - cold)",
        "turns - rate <= 1",
        "warm * F <= F * hot",  # differences are the same in degC and K
    ],
)
def test_what_is_the_same_to_the_digit_goes_together(text: str) -> None:
    assert parse(text, HEAT).tags


@pytest.mark.parametrize(
    "text", ["warm <= hot", "Q <= small", "Q <= cp * F", "Q - F >= 0", "turns * turns <= rate", "abs(warm) - hot <= 1"]
)
def test_what_has_another_factor_or_another_zero_does_not(text: str) -> None:
    with pytest.raises(FormulaError, match="convert one of them with a coefficient"):
        parse(text, HEAT)


@pytest.mark.parametrize("unit", ["L/s", "m3/h", "kg/min", "kW", "t/d", "1/s", "mol/(L s)"])
def test_what_is_per_time_is_a_rate(unit: str) -> None:
    assert is_rate(unit)


@pytest.mark.parametrize("unit", ["L", "1", "%", "kg/m3", "s", "m s", "kJ/(kg K)", "kscmh"])
def test_anything_else_is_an_amount(unit: str) -> None:
    assert not is_rate(unit)
