"""Undecided is NaN: what is not known may have any value, and a verdict stands only where no value could change it."""

from __future__ import annotations

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.stl.formula import FormulaError, parse, parse_expression
from tests.stl.formula_oracle import ARITHMETIC, TAGS, TEMPORAL, Draw, Rows, Tree, margin_of, text_of

pytestmark = pytest.mark.quick

NAN = math.nan
SEEDS = st.integers(0, 2**32 - 1)


def with_gaps(draw: Draw, signals: dict[str, np.ndarray], share: float = 0.25) -> dict[str, np.ndarray]:
    """The signals with some values unknown."""
    return {tag: np.where(draw.rng.random(s.shape) < share, NAN, s) for tag, s in signals.items()}


@pytest.mark.parametrize(
    ("text", "margin"),
    [
        ("x <= 1", NAN), ("not (x <= 1)", NAN), ("x == 1", NAN), ("absent <= 1", NAN), ("abs(-x) >= 0", NAN),
        ("min(x, y) <= 9", NAN), ("min(y, x) <= 9", NAN), ("max(x, y) >= 0", NAN), ("max(y, x) >= 0", NAN),
        ("0 * x <= 1", NAN), ("y / 0 <= 1", NAN), ("0 / 0 <= 1", NAN), ("inf - inf <= 1", NAN), ("inf <= inf", NAN),
        ("0 * inf <= 1", NAN), ("y / (y - y) >= 0", NAN), ("x <= 1 and y <= 1", -1.0), ("y <= 1 and x <= 1", -1.0),
        ("x <= 1 and y <= 9", NAN), ("y <= 9 and x <= 1", NAN), ("x <= 1 or y <= 9", 7.0), ("y <= 9 or x <= 1", 7.0),
        ("x <= 1 or y <= 1", NAN), ("y <= 1 or x <= 1", NAN), ("x <= 1 implies y <= 9", 7.0),
        ("x <= 1 implies y <= 1", NAN), ("y <= 1 implies x <= 1", 1.0), ("y <= 9 implies x <= 1", NAN),
        ("not (x <= 1 and y <= 1)", 1.0), ("not (x <= 1 or y <= 9)", -7.0), ("x <= 1 and y <= 1 or y <= 0", -1.0),
        ("(x <= 1 or y <= 9) and y >= 1", 1.0), ("y <= 3 and x <= 1 and y <= 0", -2.0), ("x <= 1 or true", math.inf),
        ("false and x <= 1", -math.inf), ("x <= 1 or not (x <= 1)", NAN),
    ],
)  # fmt: skip
def test_worked_examples(text: str, margin: float) -> None:
    values = {"x": NAN, "y": 2.0, "inf": math.inf}
    formula = parse(text)
    np.testing.assert_equal(formula.margin_at(values), margin)
    assert formula.holds(values) is (margin >= 0.0)
    assert bool(formula.holds_each({**values, "absent": NAN})) is (margin >= 0.0)  # type: ignore[dict-item]
    np.testing.assert_equal(formula.evaluate({**values, "absent": NAN}, 1.0).value[0], margin)


@pytest.mark.parametrize(
    ("text", "value", "at"),
    [
        ("always(x <= 3)", -2.0, 3.0),
        ("always[0,2](x <= 3)", NAN, NAN),
        ("always[0,0](x <= 3)", 2.0, 0.0),
        ("eventually(x >= 3)", 2.0, 3.0),
        ("eventually[0,2](x >= 3)", NAN, NAN),
        ("eventually[1,2] always[0,1](x <= 3)", NAN, NAN),
        ("eventually[2,2] always[0,1](x <= 3)", -2.0, 3.0),
        ("(x <= 3) until (x >= 5)", NAN, NAN),
        ("(x <= 0) until (x >= 5)", -1.0, 0.0),
        ("(x <= 0) until (x <= 2)", 1.0, 0.0),
        ("(x <= 3) until[1,1] (x >= 5)", NAN, NAN),
        ("always[4,9](x <= 3)", math.inf, NAN),
    ],
)
def test_windows_with_an_unknown_sample(text: str, value: float, at: float) -> None:
    """x is 1, unknown, 2, 5."""
    margin = parse(text).evaluate({"x": np.array([1.0, NAN, 2.0, 5.0])}, 1.0)
    np.testing.assert_array_equal(margin.value, [value])
    np.testing.assert_array_equal(margin.worst_at_s, [at])


def test_one_undecided_sample_leaves_the_others_alone() -> None:
    signals = {"x": np.array([[1.0, NAN, 5.0], [1.0, 2.0, 2.0]]), "y": 4.0}
    np.testing.assert_array_equal(parse("x <= 3").margins(signals, 1.0), [[2.0, NAN, -2.0], [2.0, 1.0, 1.0]])
    np.testing.assert_array_equal(parse_expression("x + y").evaluate(signals), [[5.0, NAN, 9.0], [5.0, 6.0, 6.0]])
    assert parse_expression("x + y").value({"x": 1.0, "y": 4.0}) == 5.0
    for values in ({"x": 1.0}, {"x": NAN, "y": 4.0}):
        assert math.isnan(parse_expression("x + y").value(values))


def test_a_forgotten_signal_is_a_mistake_and_a_forgotten_reading_is_not() -> None:
    formula = parse("x <= 1 and y <= 1")
    assert math.isnan(formula.margin_at({"x": 0.0}))
    assert formula.margin_at({"x": 2.0}) == -1.0
    for use in (formula.margins, formula.evaluate):
        with pytest.raises(FormulaError, match="no signal for tag 'y'"):
            use({"x": np.zeros(3)}, 1.0)
    with pytest.raises(FormulaError, match="no value for tag 'y'"):
        formula.holds_each({"x": np.zeros(3)})


@given(SEEDS)
@settings(max_examples=300)
def test_a_point_is_a_signal_of_one_sample(seed: int) -> None:
    draw = Draw(np.random.default_rng(seed), (*ARITHMETIC, "/"))
    formula = parse(text_of(draw.logic(depth=3, temporal=False)))
    signals = with_gaps(draw, draw.signals(4, 1))
    margin = formula.evaluate(signals, 1.0).value
    each = np.broadcast_to(formula.holds_each({tag: s[:, 0] for tag, s in signals.items()}), (4,))
    for member in range(4):
        point = {tag: float(s[member, 0]) for tag, s in signals.items()}
        given = {tag: value for tag, value in point.items() if not math.isnan(value)}
        np.testing.assert_equal(formula.margin_at(point) + 0.0, float(margin[member]) + 0.0, err_msg=formula.text)
        np.testing.assert_equal(formula.margin_at(given) + 0.0, float(margin[member]) + 0.0, err_msg=formula.text)
        assert formula.holds(point) is bool(each[member]) is bool(margin[member] >= 0.0)


@given(SEEDS, st.sampled_from([0.0, 0.5, 1.0]))
@settings(max_examples=300)
def test_no_value_in_the_place_of_an_unknown_one_turns_a_verdict(seed: int, filled: float) -> None:
    draw = Draw(np.random.default_rng(seed), (*ARITHMETIC, "/"))
    formula, signals = parse(text_of(draw.logic(depth=3))), with_gaps(draw, draw.signals(3, 8))
    margins = formula.margins(signals, 1.0)
    for _ in range(5):
        others = draw.rng.choice([-math.inf, -1e9, -3.0, -1.0, 0.0, 0.5, 2.0, 1e9, math.inf], (3, 8))
        holes = draw.rng.random((3, 8)) < filled
        told = {tag: np.where(np.isnan(s) & holes, others, s) for tag, s in signals.items()}
        known = formula.margins(told, 1.0)
        assert (known[margins >= 0.0] >= margins[margins >= 0.0]).all(), "it holds by so much at least"
        assert (known[margins < 0.0] <= margins[margins < 0.0]).all(), "it is violated by so much at least"


@given(SEEDS)
@settings(max_examples=200)
def test_nothing_unknown_nothing_undecided_and_unread_gaps_do_not_count(seed: int) -> None:
    draw = Draw(np.random.default_rng(seed))
    tree, signals = draw.logic(depth=3), draw.signals(2, 6)
    formula, read = parse(text_of(tree)), parse(text_of(tree)).tags
    holed = {tag: s if tag in read else np.full_like(s, NAN) for tag, s in signals.items()}
    margins = formula.margins(holed, 1.0)
    for member in range(2):
        rows = {tag: list(map(float, s[member])) for tag, s in signals.items()}
        assert margins[member].tolist() == [margin_of(tree, rows, 6, t)[0] for t in range(6)]


class _Tie(Exception):
    """A margin of exactly zero, which a negation holds, too."""


def _verdict(tree: Tree, rows: Rows, length: int, t: int) -> bool | None:
    """Three-valued logic after Kleene, sample by sample."""
    kind, *rest = tree
    if kind == "not":
        return _not(_verdict(rest[0], rows, length, t))
    if kind == "implies":
        return _any([_not(_verdict(rest[0], rows, length, t)), _verdict(rest[1], rows, length, t)])
    if kind in ("and", "or"):
        return (_all if kind == "and" else _any)([_verdict(operand, rows, length, t) for operand in rest])
    if kind in TEMPORAL:
        low, high, *operands = rest
        window = [s for s in range(length) if t + (low or 0) <= s and (high is None or s <= t + high)]
        if kind == "until":
            held = [[_verdict(operands[0], rows, length, before) for before in range(t, s)] for s in window]
            ends = [_verdict(operands[1], rows, length, s) for s in window]
            return _any([_all([*h, end]) for h, end in zip(held, ends, strict=True)])
        return (_all if kind == "always" else _any)([_verdict(operands[0], rows, length, s) for s in window])
    if any(math.isnan(rows[tag][t]) for tag in _tags(tree)):
        return None
    margin = margin_of(tree, rows, length, t)[0]
    if margin == 0.0:
        raise _Tie
    return margin > 0.0


def _tags(tree: Any) -> set[str]:
    if not isinstance(tree, tuple):
        return set()
    return {tree[1]} if tree[0] == "tag" else set().union(*map(_tags, tree[1:]))


def _not(verdict: bool | None) -> bool | None:
    return None if verdict is None else not verdict


def _all(verdicts: list[bool | None]) -> bool | None:
    return False if False in verdicts else None if None in verdicts else True


def _any(verdicts: list[bool | None]) -> bool | None:
    return True if True in verdicts else None if None in verdicts else False


@pytest.mark.parametrize("seed", range(4))
def test_verdicts_are_those_of_three_valued_logic(seed: int) -> None:
    draw, compared = Draw(np.random.default_rng([31, seed])), set()
    for _ in range(150):
        tree = draw.logic(depth=3)
        signals = with_gaps(draw, {tag: draw.rng.normal(size=(1, 7)) * 2 for tag in TAGS}, share=0.15)
        rows = {tag: list(map(float, s[0])) for tag, s in signals.items()}
        try:
            expected = [_verdict(tree, rows, 7, t) for t in range(7)]
        except _Tie:
            continue
        margins = parse(text_of(tree)).margins(signals, 1.0)[0]
        assert [None if math.isnan(m) else bool(m >= 0.0) for m in margins] == expected, text_of(tree)
        compared.update(expected)
    assert compared == {True, False, None}


def test_a_formula_that_was_used_is_copied_and_pickled() -> None:
    formula, expression = parse("x <= 1"), parse_expression("x + 1")
    assert formula.margin_at({"x": 0.0}) == expression.value({"x": 0.0}) == 1.0
    for clone in (pickle.loads(pickle.dumps(formula)), copy.deepcopy(formula)):
        assert clone == formula and clone.holds({"x": 0.0})
    assert pickle.loads(pickle.dumps(expression)).value({"x": 0.0}) == 1.0
