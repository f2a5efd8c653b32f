"""A square root in a rule: a flow by its pressure drop, 0 against it, with the unit that half the powers have."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from homeostat.stl.formula import FormulaError, parse, parse_expression
from homeostat.stl.widest import widest

pytestmark = pytest.mark.quick


@dataclass(frozen=True)
class Tag:
    unit: str
    scale: float = 1.0


TAGS = {"p": Tag("bar"), "q": Tag("bar"), "A": Tag("m2"), "d": Tag("m"), "h": Tag("s")}


@pytest.mark.parametrize(("p", "q", "flow"), [(5.0, 1.0, 4.0), (1.0, 5.0, 0.0), (math.nan, 1.0, math.nan)])
def test_its_value_at_a_point_and_over_time(p: float, q: float, flow: float) -> None:
    expression = parse_expression("2 * sqrt(p - q)", TAGS)
    found = expression.evaluate({"p": np.array([[p]]), "q": np.array([[q]])})
    assert np.array_equal(np.ravel(found), [flow], equal_nan=True)
    assert expression.text == "2 * sqrt(p - q)"


def test_its_unit_is_checked_where_there_is_one() -> None:
    parse("sqrt(A) <= d", TAGS)
    with pytest.raises(FormulaError, match="'sqrt\\(A\\)' is in sqrt\\(A\\) and 'h' in s"):
        parse("sqrt(A) <= h", TAGS)
    parse("sqrt(p) <= d", TAGS)
    assert parse("sqrt(p) <= 2", TAGS).margin_at({"p": 9.0}) == -1.0


def test_its_widest_margin_follows_from_the_range() -> None:
    assert widest(parse("sqrt(p) <= 5", TAGS), {"p": (4.0, 9.0)}) == 3.0
