"""Deciding and widest: whose margin it is where units mix, and how large one can be, against the evaluator itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.stl.deciding import amount, deciding
from homeostat.stl.formula import Formula, parse
from homeostat.stl.widest import widest


@dataclass(frozen=True)
class Known:
    """A tag as a unit check needs it."""

    unit: str
    scale: float


TAGS = {"L": Known("L", 0.2), "F": Known("L/s", 0.001), "T": Known("K", 2.0), "V": Known("1", 0.05)}
RULES = (
    "L >= 2 or F <= 0.0005",
    "L <= 11 and T <= 313",
    "not (T > 300 and V < 0.02)",
    "V < 0.02 implies T <= 300",
    "abs(T - 300) <= 2 or F <= 0.0005",
    "V == 0.5 or T <= 280",
    "always[0,3] (L >= 2 or F <= 0.0005)",
    "eventually (T <= 290 and V >= 0.5)",
)
VALUES = st.fixed_dictionaries(
    {"L": st.floats(-2, 14), "F": st.floats(0, 0.05), "T": st.floats(270, 380), "V": st.floats(0, 1)}
)
RANGES = {"L": (-2.0, 14.0), "F": (0.0, 0.05), "T": (270.0, 380.0), "V": (0.0, 1.0)}


@pytest.mark.parametrize("rule", RULES)
@given(samples=st.lists(VALUES, min_size=4, max_size=4))
def test_what_decides_has_the_margin_of_the_whole_in_its_own_unit(rule: str, samples: list[dict[str, float]]) -> None:
    formula = parse(rule, TAGS)
    assert formula.unit == "1", "or there is nothing to find out"
    told = formula.evaluate({tag: np.array([s[tag] for s in samples]) for tag in TAGS}, dt_s=1.0)
    margin, at = float(told.value[0]), int(told.worst_at_s[0])
    found = deciding(formula, samples[at], margin)
    assert found is not None and found.unit in {known.unit for known in TAGS.values()}
    alone = parse(found.comparison, TAGS)  # one comparison, in one unit: nothing is scaled
    assert alone.unit == found.unit
    assert alone.margin_at(samples[at]) == pytest.approx(found.margin, abs=1e-6)
    scale = max(TAGS[tag].scale for tag in alone.tags)
    assert found.margin / scale == pytest.approx(margin, abs=1e-5)


def test_the_numbers_are_those_of_an_instrument() -> None:
    formula = parse("L1 >= 2 or F1 <= 0.0005", {"L1": TAGS["L"], "F1": TAGS["F"]})
    fed = {"L1": 1.5, "F1": 0.02}
    found = deciding(formula, fed, formula.margin_at(fed))
    assert found is not None and (found.comparison, found.unit) == ("L1 >= 2", "L")
    assert found.margin == pytest.approx(-0.5)


def test_a_product_whose_unit_nobody_wrote_down_has_none() -> None:
    formula = parse("2 * F * T <= 5 or L <= 1", TAGS)
    values = {"F": 0.01, "T": 300.0, "L": 3.0}
    found = deciding(formula, values, formula.margin_at(values))
    assert formula.unit == "1" and found is not None and found.margin == pytest.approx(-1.0)


def test_nothing_decides_what_no_comparison_says() -> None:
    assert deciding(parse("true or L <= 1", TAGS), {"L": 0.0}, math.inf) is None
    assert deciding(parse("L <= 1 or T <= 1", TAGS), {"L": 0.0, "T": 0.0}, math.nan) is None
    assert deciding(parse("L <= 1 or T <= 1", TAGS), {"L": 0.0}, 123.0) is None, "no comparison has that margin"


@pytest.mark.parametrize(
    "rule", [*RULES, "min(L, 3) * 2 >= max(L, 1) / 4", "(L <= 2) until (L >= 3)", "-L <= L - 2 * L"]
)
@given(samples=st.lists(VALUES, min_size=4, max_size=4))
def test_no_margin_is_larger_than_the_widest(rule: str, samples: list[dict[str, float]]) -> None:
    formula = parse(rule, TAGS)
    told = formula.evaluate({tag: np.array([s[tag] for s in samples]) for tag in TAGS}, dt_s=1.0)
    assert told.value[0] <= widest(formula, RANGES) + 1e-9


def test_the_widest_is_reached_where_every_tag_stands_once() -> None:
    def most(rule: str) -> float:
        return widest(parse(rule), RANGES | {"S": (0.0, 1000.0)})

    assert most("always (S <= 0.001)") == 0.001 and most("S >= 0") == 1000.0
    assert most("abs(T - 300) <= 2") == 2.0 and most("not (T <= 300)") == 80.0
    assert most("S <= 0.3 and T <= 280") == pytest.approx(0.3) and most("S <= 0.3 or T <= 280") == 10.0
    assert most("nowhere <= 1") == math.inf and most("L / V <= 1") == math.inf
    assert widest(Formula("x", parse("S <= 0.25").root, "L"), {"S": (0.1, 1.0)}) == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("rule", "values", "said"),
    [
        ("L >= 2 or F <= 0.0005", {"L": 1.5, "F": 0.05}, "0.5 L"),
        ("L <= 11 and T <= 313", {"L": 9.0, "T": 331.9}, "18.9 K"),
        ("V < 0.02 implies T <= 300", {"V": 0.01, "T": 305.0}, "0.01"),
        ("L <= 11", {"L": 12.5}, "1.5 L"),
        ("V <= 0.5", {"V": 0.75}, "0.25"),
    ],
)
def test_an_amount_has_the_unit_of_what_decides(rule: str, values: dict[str, float], said: str) -> None:
    formula = parse(rule, TAGS)
    assert amount(formula, values, formula.margin_at(values)) == said


def test_a_margin_that_nothing_decides_is_said_to_be_in_scales() -> None:
    formula = parse("L >= 2 or F <= 0.0005", TAGS)
    assert amount(formula, {"L": 1.5, "F": 0.05}, -9.43) == "9.43 scales of its tags"
