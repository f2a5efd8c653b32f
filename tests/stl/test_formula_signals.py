"""Signals and snapshots: shapes, sampling, and arithmetic without a result."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.stl.formula import FormulaError, parse, parse_expression
from tests.stl.formula_oracle import TAGS, Draw, text_of

pytestmark = pytest.mark.quick

FORMULA = parse("always[0,2](x - y <= 3)")


@pytest.mark.parametrize(
    ("x", "y", "shape"),
    [
        (np.zeros((4, 5)), np.zeros((4, 5)), (4, 5)),
        (np.zeros((4, 5)), np.zeros(5), (4, 5)),
        (np.zeros((4, 5)), 1.0, (4, 5)),
        (np.zeros(5), 1, (1, 5)),
        (np.zeros((4, 1)), np.zeros((1, 5)), (4, 5)),
        (np.zeros((4, 1)), 0.0, (4, 1)),
        (0.0, 0.0, (1, 1)),
        (np.zeros((4, 5), dtype=np.float32), np.zeros(5, dtype=np.int64), (4, 5)),
        (np.zeros((4, 5), dtype=bool), np.float64(1.0), (4, 5)),
        (np.asfortranarray(np.zeros((4, 5))), np.zeros((8, 10))[::2, ::2], (4, 5)),
    ],
)
def test_signals_are_broadcast_together(x: Any, y: Any, shape: tuple[int, int]) -> None:
    margins = FORMULA.margins({"x": x, "y": y}, 1.0)
    full = FORMULA.margins({"x": np.broadcast_to(x, shape), "y": np.broadcast_to(y, shape)}, 1.0)
    assert margins.shape == shape
    assert margins.dtype == np.float64
    assert margins.tolist() == full.tolist()
    assert FORMULA.evaluate({"x": x, "y": y}, 1.0).value.shape == (shape[0],)
    margins += 1.0  # the result is the caller's own


def test_a_constant_takes_the_length_of_the_trace_it_is_given_with() -> None:
    formula = parse("always[2,3](x.sp <= 1)")
    assert formula.margins({"x.sp": 0.0}, 1.0).tolist() == [[math.inf]]
    assert formula.margins({"x.sp": 0.0, "x": np.zeros((2, 4))}, 1.0).tolist() == [[1.0, 1.0, math.inf, math.inf]] * 2
    assert parse("eventually[1,2] true").margins({"x": np.zeros(2)}, 1.0).tolist() == [[math.inf, -math.inf]]


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        ({"x": np.zeros(5)}, "no signal for tag 'y'"),
        ({"x": np.zeros(5), "y.sp": 1.0, "yy": 2.0}, "no signal for tag 'y'; did you mean 'yy'"),
        ({"x": np.zeros(5), "y": np.zeros(4)}, "signal 'y' has 4 samples but 'x' has 5"),
        ({"x": np.zeros((3, 5)), "y": np.zeros((2, 5))}, "signal 'y' has 2 members but 'x' has 3"),
        ({"x": np.zeros((1, 1, 5)), "y": 0.0}, "signal 'x' has shape (1, 1, 5)"),
        ({"x": np.zeros(0), "y": 0.0}, "signal 'x' has 0 samples; give at least one"),
        ({"x": np.zeros((0, 5)), "y": 0.0}, "signal 'x' has 0 members; give at least one"),
        ({"x": "high", "y": 0.0}, "signal 'x' does not hold numbers"),
    ],
)
def test_signals_that_do_not_fit_are_refused(signals: dict[str, Any], message: str) -> None:
    with pytest.raises(FormulaError, match=re.escape(message)):
        FORMULA.evaluate(signals, 1.0)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("always[1,2](1 / x <= 3)", [2.0, math.nan]),
        ("always(inf - inf2 <= 3)", [math.nan, math.nan]),
        ("inf <= inf2", [math.nan, math.nan]),
        ("always(x * inf <= 3)", [-math.inf, -math.inf]),
        ("eventually[2,2](x * inf <= 3)", [-math.inf, math.nan]),
        ("always(3 / (2 - 2) <= x)", [math.nan, math.nan]),
    ],
)
def test_arithmetic_without_a_result_leaves_the_member_undecided(text: str, expected: list[float]) -> None:
    signals = {"x": np.ones((2, 3)), "inf": np.full(3, np.inf), "inf2": math.inf}
    signals["x"][1, 2] = 0.0
    np.testing.assert_array_equal(parse(text).evaluate(signals, 1.0).value, expected)


@pytest.mark.parametrize(
    "text",
    ["always[1,2](1 / x <= 3)", "eventually[0,1] always[0,1] (1 / x <= 3)", "(1 / x <= 3) until[0,2] (1 / x >= 3)"],
)
def test_only_what_the_window_reaches_is_computed(text: str) -> None:
    signals = {"x": np.array([1.0, 1.0, 1.0, 0.0])}
    assert math.isfinite(parse(text).evaluate(signals, 1.0).value[0])
    assert np.isnan(parse(text).margins(signals, 1.0)).any()


def test_infinite_values_have_infinite_margins() -> None:
    margin = parse("always(x <= 3)").evaluate({"x": np.array([[1.0, np.inf], [-np.inf, 1.0]])}, 1.0)
    assert margin.value.tolist() == [-math.inf, 2.0]
    assert margin.worst_at_s.tolist() == [1.0, 1.0]
    assert parse("x * 1e300 >= 3").margins({"x": np.array([1e300])}, 1.0).tolist() == [[math.inf]]


@pytest.mark.parametrize("dt_s", [0.0, -1.0, math.nan, math.inf])
def test_the_sampling_period_is_positive(dt_s: float) -> None:
    with pytest.raises(FormulaError, match="sampling period"):
        FORMULA.evaluate({"x": 0.0, "y": 0.0}, dt_s)


@pytest.mark.parametrize(
    ("text", "dt_s", "legal"),
    [
        ("always[0,600](x <= 1)", 0.1, True),
        ("always[0.3,0.7](x <= 1)", 0.1, True),
        ("always[0,1](x <= 1)", 1 / 3, True),
        ("always[0,1e300](x <= 1)", 1e-10, True),
        ("always[0,1](x <= 1)", 0.3, False),
        ("always[0.5,1](x <= 1)", 1.0, False),
        ("x <= 2 until[0,1.5] x <= 1", 1.0, False),
        ("eventually[0,0.9](x <= 1)", 1.0, False),
        ("always(x <= 1)", 0.7, True),
    ],
)
def test_bounds_are_multiples_of_the_sampling_period(text: str, dt_s: float, legal: bool) -> None:
    signals = {"x": np.zeros(10)}
    if legal:
        assert parse(text).evaluate(signals, dt_s).value.tolist() == [1.0]
    else:
        with pytest.raises(FormulaError, match=r"bound .* s of .* is no multiple of the sampling period"):
            parse(text).evaluate(signals, dt_s)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=300)
def test_a_snapshot_is_a_trace_of_one_sample(seed: int) -> None:
    draw = Draw(np.random.default_rng(seed))
    formula = parse(text_of(draw.logic(depth=3, temporal=False)))
    values = {tag: float(draw.rng.integers(-6, 7)) / 2 for tag in TAGS}
    margin = formula.evaluate(values, 1.0).value[0]
    assert formula.margin_at(values) == margin
    assert formula.holds(values) == (margin >= 0.0)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=200)
def test_an_expression_has_one_value_at_a_point_and_in_a_signal(seed: int) -> None:
    draw = Draw(np.random.default_rng(seed))
    expression = parse_expression(text_of(draw.number(4)))
    signals = draw.signals(2, 3)
    values = expression.evaluate(signals)
    assert values.shape == (2, 3)
    for member, index in np.ndindex(2, 3):
        point = {tag: float(signal[member, index]) for tag, signal in signals.items()}
        assert expression.value(point) == values[member, index]


@pytest.mark.parametrize(
    ("text", "values", "holds"),
    [
        ("x <= 1", {"x": 1.0}, True),
        ("x <= 1", {"x": math.nextafter(1.0, 2.0)}, False),
        ("x < 1", {"x": 1.0}, True),
        ("x > 1", {"x": 1.0}, True),
        ("x == 1", {"x": 1.0}, True),
        ("x == 1", {"x": 1.5}, False),
        ("abs(x - 1) >= 0.5", {"x": 1.0}, False),
        ("not (x > 1 and y < 0.5)", {"x": 2.0, "y": 0.0}, False),
        ("x > 1 -> y > 1", {"x": 0.0, "y": 0.0}, True),
        ("true", {}, True),
        ("false or x >= 0", {"x": -1}, False),
        ("x >= 0", {"x": math.inf}, True),
    ],
)
def test_guards_on_a_snapshot(text: str, values: dict[str, float], holds: bool) -> None:
    assert parse(text).holds(values) is holds


@pytest.mark.parametrize("text", ["always[0,0](x <= 1)", "x <= 1 or eventually(x <= 1)", "(x <= 1) until (x <= 1)"])
def test_what_looks_ahead_is_refused_at_a_point(text: str) -> None:
    for _ in range(2):
        with pytest.raises(FormulaError, match="looks ahead, one point cannot decide it"):
            parse(text).holds({"x": 0.0})
