"""Margins and deciding times against the naive oracle, and the laws they obey."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.stl.formula import parse
from tests.stl.formula_oracle import TEMPORAL, Draw, Tree, margin_of, text_of

BATCHES = 12


def _random_case(draw: Draw) -> tuple[Tree, dict[str, np.ndarray]]:
    members, length = int(draw.rng.integers(1, 4)), int(draw.rng.choice([1, 2, 3, 5, 8, 13]))
    return draw.logic(depth=3), draw.signals(members, length)


@pytest.mark.parametrize("seed", range(BATCHES))
def test_margins_and_deciding_times_agree_with_the_definition(seed: int) -> None:
    draw = Draw(np.random.default_rng([20, seed]))
    for _ in range(100):
        tree, signals = _random_case(draw)
        dt_s = float(draw.rng.choice([0.1, 0.5, 1.0, 30.0]))
        text = text_of(tree, dt_s)
        margins = parse(text).margins(signals, dt_s)
        margin = parse(text).evaluate(signals, dt_s)
        members, length = signals["x"].shape
        for member in range(members):
            rows = {tag: list(map(float, signal[member])) for tag, signal in signals.items()}
            expected = [margin_of(tree, rows, length, t) for t in range(length)]
            assert margins[member].tolist() == [value for value, _ in expected], text
            value, at = expected[0]
            assert margin.value[member] == value, text
            np.testing.assert_equal(margin.worst_at_s[member], math.nan if at is None else at * dt_s, err_msg=text)


def test_the_random_formulas_reach_every_operator() -> None:
    draw = Draw(np.random.default_rng(3))
    texts = " ".join(text_of(draw.logic(3)) for _ in range(300))
    for word in ("not", "and", "or", "implies", "abs", "min", "max", "true", "false", "==", "until(", *TEMPORAL):
        assert word.replace("until(", "until (") in texts


@pytest.mark.parametrize("seed", range(4))
def test_deciding_times_inside_a_signal_of_margins(seed: int) -> None:
    """Prefixing a window moves time 0 into the trace, which reaches the sliding windows with deciding times."""
    draw = Draw(np.random.default_rng([21, seed]))
    for _ in range(100):
        inner = draw.logic(depth=2)
        outer: Tree = (str(draw.rng.choice(["always", "eventually"])), 1, int(draw.rng.integers(1, 9)), inner)
        signals = draw.signals(1, 9)
        rows = {tag: list(map(float, signal[0])) for tag, signal in signals.items()}
        value, at = margin_of(outer, rows, 9, 0)
        margin = parse(text_of(outer)).evaluate(signals, 1.0)
        assert margin.value[0] == value, text_of(outer)
        np.testing.assert_equal(margin.worst_at_s[0], math.nan if at is None else float(at), err_msg=text_of(outer))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=150)
def test_evaluate_is_the_first_margin_and_members_do_not_mix(seed: int) -> None:
    draw = Draw(np.random.default_rng(seed))
    tree, signals = _random_case(draw)
    formula = parse(text_of(tree))
    margin = formula.evaluate(signals, 1.0)
    assert margin.value.tolist() == formula.margins(signals, 1.0)[:, 0].tolist()
    for member in range(len(margin.value)):
        alone = formula.evaluate({tag: signal[member] for tag, signal in signals.items()}, 1.0)
        assert alone.value.tolist() == [margin.value[member]]
        np.testing.assert_array_equal(alone.worst_at_s, margin.worst_at_s[member : member + 1])


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=150)
def test_nothing_beyond_the_horizon_matters(seed: int) -> None:
    draw = Draw(np.random.default_rng(seed))
    formula = parse(text_of(draw.logic(depth=3)))
    signals = draw.signals(2, 40)
    if formula.horizon_s > 38:
        return
    seen = int(formula.horizon_s) + 1
    other = {tag: np.where(np.arange(40) < seen, signal, signal + 100.0) for tag, signal in signals.items()}
    cut = {tag: signal[:, :seen] for tag, signal in signals.items()}
    expected = formula.evaluate(signals, 1.0)
    for changed in (other, cut):
        margin = formula.evaluate(changed, 1.0)
        assert margin.value.tolist() == expected.value.tolist()
        np.testing.assert_array_equal(margin.worst_at_s, expected.worst_at_s)


@pytest.mark.parametrize(
    ("text", "value", "at"),
    [
        ("always(x <= 3)", -2.0, 3.0),
        ("eventually(x <= 3)", 2.0, 0.0),
        ("eventually[2,3](x <= 3)", 0.0, 2.0),
        ("x <= 3 and always[1,2](x >= 0)", 2.0, 0.0),
        ("always(x <= 3) or x >= 1", 0.0, 0.0),
        ("not always(x <= 3)", 2.0, 3.0),
        ("(x <= 4) until (x >= 5)", 0.0, 3.0),
        ("(x <= 2) until (x >= 5)", -1.0, 2.0),
        ("(x <= 4) until[1,2] (x >= 5)", -2.0, 2.0),
        ("eventually[0,2] always[0,1] (abs(x - 3) <= 1)", 0.0, 1.0),
    ],
)
def test_worked_examples(text: str, value: float, at: float) -> None:
    margin = parse(text).evaluate({"x": np.array([1.0, 2.0, 3.0, 5.0])}, 1.0)
    assert (margin.value.tolist(), margin.worst_at_s.tolist()) == ([value], [at])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("always[3,5](x <= 0)", math.inf),
        ("eventually[3,5](x <= 0)", -math.inf),
        ("(x <= 0) until[3,5] (x <= 0)", -math.inf),
        ("true", math.inf),
        ("false", -math.inf),
        ("not true", -math.inf),
    ],
)
def test_no_sample_decides_an_empty_window_or_a_constant(text: str, value: float) -> None:
    margin = parse(text).evaluate({"x": np.zeros((2, 3))}, 1.0)
    assert margin.value.tolist() == [value, value]
    assert np.isnan(margin.worst_at_s).all()


def test_windows_are_clipped_to_the_trace() -> None:
    formula = parse("always[1,3](x >= 0)")
    assert formula.margins({"x": np.array([9.0, 4.0, 7.0])}, 1.0).tolist() == [[4.0, 7.0, math.inf]]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("not always[1,3](x <= y)", "eventually[1,3](not (x <= y))"),
        ("x <= y implies y <= 2", "not (x <= y) or y <= 2"),
        ("true until[1,4] (x <= y)", "eventually[1,4](x <= y)"),
        ("always[1,2] always[2,3] (x <= y)", "always[3,5](x <= y)"),
        ("always[0,3](x <= y and y <= 2)", "always[0,3](x <= y) and always[0,3](y <= 2)"),
    ],
)
def test_laws_of_temporal_logic(first: str, second: str) -> None:
    rng = np.random.default_rng(9)
    signals = {"x": rng.normal(size=(50, 30)), "y": rng.normal(size=(50, 30))}
    np.testing.assert_array_equal(parse(first).margins(signals, 1.0), parse(second).margins(signals, 1.0))


def test_an_ensemble_is_judged_in_milliseconds() -> None:
    signals = {"T1": np.random.default_rng(1).normal(310.0, 1.0, (1600, 300))}
    formula = parse("always[0,600](T1 <= 313)")
    formula.evaluate(signals, 2.0)
    seconds = []
    for _ in range(5):
        start = time.thread_time()
        margin = formula.evaluate(signals, 2.0)
        seconds.append(time.thread_time() - start)
    assert margin.value.tolist() == (313.0 - signals["T1"].max(axis=1)).tolist()
    assert min(seconds) < 0.05
