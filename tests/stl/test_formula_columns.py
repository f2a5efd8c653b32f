"""Guards of an ensemble: each member's answer is the one that the member alone would get."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.stl.formula import FormulaError, parse
from tests.stl.formula_oracle import ARITHMETIC, TAGS, Draw, margin_of, text_of

pytestmark = pytest.mark.quick

ALL = (*ARITHMETIC, "/")


@given(st.integers(0, 2**32 - 1), st.integers(1, 9))
@settings(max_examples=300)
def test_every_member_is_answered_as_if_it_were_alone(seed: int, members: int) -> None:
    draw = Draw(np.random.default_rng(seed), ALL)
    formula = parse(text_of(draw.logic(depth=3, temporal=False)))
    columns = {tag: values[:, 0] for tag, values in draw.signals(members, 1).items()}
    found = np.broadcast_to(formula.holds_each(columns), (members,))
    assert found.dtype == np.bool_
    for member in range(members):
        alone = {tag: float(values[member]) for tag, values in columns.items()}
        assert bool(found[member]) is formula.holds(alone), formula.text


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=100)
def test_the_answers_agree_with_the_definition(seed: int) -> None:
    draw = Draw(np.random.default_rng(seed))
    tree, signals = draw.logic(depth=3, temporal=False), draw.signals(5, 1)
    found = np.broadcast_to(parse(text_of(tree)).holds_each({t: v[:, 0] for t, v in signals.items()}), (5,))
    for member in range(5):
        rows = {tag: [float(v[member, 0])] for tag, v in signals.items()}
        assert bool(found[member]) is (margin_of(tree, rows, 1, 0)[0] >= 0.0)


@pytest.mark.parametrize(
    "text",
    [
        "x <= 1", "x >= 1", "x < 1", "x > 1", "x == 1", "not (x <= 1)", "not (x >= 1)", "x <= 1 and y <= 9",
        "x <= 1 or y <= 1", "y <= 1 or x <= 1", "x <= 1 implies y <= 1", "y <= 9 implies x >= 1", "abs(x) >= 0",
        "min(x, y) <= 9", "max(x, y) >= -9", "max(y, x) >= -9", "-x <= 9", "x + y <= 9", "x - y <= 9", "x * y <= 9",
        "x / 2 <= 9", "true and x <= 1", "false or x <= 1", "x <= 1 or false",
    ],
)  # fmt: skip
def test_a_member_that_is_undecided_has_not_come_so_far(text: str) -> None:
    columns = {"x": np.array([math.nan, 1.0]), "y": np.array([2.0, 2.0])}
    found = parse(text).holds_each(columns)
    assert not found[0]
    assert bool(found[1]) is parse(text).holds({"x": 1.0, "y": 2.0}), "its neighbour is not concerned"


@pytest.mark.parametrize("text", ["x <= 1 or y <= 9", "y <= 9 or x <= 1", "x <= 1 implies y <= 9", "true or x <= 1"])
def test_a_member_for_which_the_missing_reading_decides_nothing_goes_on(text: str) -> None:
    assert parse(text).holds_each({"x": np.array([math.nan, 1.0]), "y": np.array([2.0, 2.0])}).all()


def test_zero_divides_only_for_the_member_that_has_it() -> None:
    formula = parse("y / x >= 1")
    assert formula.holds_each({"x": np.array([0.0, 2.0, -0.0]), "y": np.array([2.0, 2.0, 2.0])}).tolist() == [
        False, True, False,
    ]  # fmt: skip


def test_a_limit_that_is_met_exactly_holds_for_many_as_for_one() -> None:
    column = {"x": np.array([math.nextafter(1.0, 0.0), 1.0, math.nextafter(1.0, 2.0)])}
    for text, expected in (("x >= 1", [False, True, True]), ("x <= 1", [True, True, False])):
        assert parse(text).holds_each(column).tolist() == expected
    assert parse("x == 1").holds_each(column).tolist() == [False, True, False]


def test_a_tag_that_is_missing_is_named() -> None:
    with pytest.raises(FormulaError, match=r"no value for tag 'x'"):
        parse("x <= 1").holds_each({"x1": np.array([1.0])})


@pytest.mark.parametrize("text", ["always(x <= 1)", "eventually[0,5](x <= 1)", "(x <= 1) until (x >= 2)"])
def test_what_looks_ahead_cannot_be_a_guard(text: str) -> None:
    with pytest.raises(FormulaError, match="looks ahead, one point cannot decide it"):
        parse(text).holds_each({"x": np.array([1.0])})


def test_nothing_to_read_is_answered_for_all() -> None:
    assert parse("true").holds_each({}).all() and not parse("false").holds_each({}).any()


def test_the_columns_stay_what_they_were() -> None:
    columns = {tag: np.array([1.0, 2.0]) for tag in TAGS}
    parse("abs(x - y) + max(x, y) >= 1 and not (y <= x)").holds_each(columns)
    assert all(values.tolist() == [1.0, 2.0] for values in columns.values())
