"""Interval analysis of formulas is sound: what it calls impossible never happens; and sharp where it matters."""

from __future__ import annotations

import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.knowledge.checks.intervals import bounds, can_fail, can_hold
from homeostat.stl.formula import parse
from homeostat.stl.tree import FormulaError

RANGES = {"x": (-2.0, 3.0), "y": (0.0, 5.0), "z.sp": (1.0, 1.5)}
TERM = st.recursive(
    st.sampled_from(["x", "y", "z.sp", "0", "1", "2.5"]),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(lambda t: f"({t[0]} {t[1]} {t[2]})"),
        inner.map(lambda text: f"abs({text})"),
        inner.map(lambda text: f"-({text})"),
        st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(lambda t: f"{t[0]}({t[1]}, {t[2]})"),
    ),
    max_leaves=4,
)
COMPARISON = st.tuples(TERM, st.sampled_from(["<=", "<", ">=", ">", "=="]), TERM).map(" ".join)
CONDITION = st.recursive(
    COMPARISON | st.sampled_from(["true", "false"]),
    lambda inner: st.one_of(
        inner.map(lambda text: f"not ({text})"),
        st.tuples(inner, st.sampled_from(["and", "or", "implies"]), inner).map(lambda t: f"({t[0]}) {t[1]} ({t[2]})"),
    ),
    max_leaves=5,
)


@given(CONDITION, st.integers(0, 2**32))
@settings(max_examples=400)
def test_what_is_said_to_be_impossible_never_happens(text: str, seed: int) -> None:
    rng = random.Random(seed)
    try:
        formula = parse(text)
    except FormulaError:
        return  # a negated equality is no rule
    hold, fail = can_hold(formula.root, RANGES), can_fail(formula.root, RANGES)
    assert hold or fail
    # A tag that is added and taken away again is nothing, but for the rounding of the evaluation.
    least = 1e-9 if any(len(re.findall(rf"(?<![\w.]){tag}(?![\w.])", text)) > 1 for tag in RANGES) else 0.0
    for _ in range(30):
        # Ends, small integers and anything between: that is where comparisons turn.
        point = {
            tag: rng.choice([low, high, float(min(max(rng.randint(-2, 5), low), high)), rng.uniform(low, high)])
            for tag, (low, high) in RANGES.items()
        }
        try:
            margin = formula.margin_at(point)
        except ValueError:
            continue  # division by zero decides nothing
        if margin >= least:
            assert hold, f"{text!r} holds at {point}"
        if margin < -least:
            assert fail, f"{text!r} fails at {point}"


@pytest.mark.parametrize(
    ("text", "hold", "fail"),
    [
        ("x <= 3", True, False),
        ("x <= 2.999", True, True),
        ("x >= 3", True, True),
        ("x >= 3.001", False, True),
        ("x + y <= -2.001", False, True),
        ("x >= 1 and x <= 0.5", False, True),
        ("not (x <= 1) and x <= 0.5", False, True),
        ("1 <= x and 0.5 >= x", False, True),
        ("x <= 1 or x >= 0.5", True, False),
        ("x <= 0.5 implies x <= 1", True, False),
        ("always[0,10] (x >= 4)", False, True),
        ("eventually[0,10] (x <= 3)", True, False),
        ("x <= 1 until[0,5] y >= 6", False, True),
        ("x == 9", False, True),
        ("x / z.sp <= 3", True, False),
        ("1 / x <= 0", True, True),
        ("0 * (1 / x) <= 1", True, False),
        ("x >= 1 and x <= 1", True, True),
        ("x <= 0.5 and x * 2 >= 2", False, True),
        ("x >= 2 and x * 2 <= 2", False, True),
        ("x == 1 and x * 2 <= 1", False, True),
        ("x == 1 and x * 2 >= 3", False, True),
        ("not (x >= 0.5) and x * 2 >= 2", False, True),
        ("abs(x) >= 0", True, False),
        ("abs(x) <= 3", True, False),
        ("abs(z.sp) >= 1", True, False),
        ("abs(-(z.sp)) >= 1.001", True, True),
        ("x <= x", True, False),
        ("x - x <= 1", True, False),
        ("x - x >= 1", False, True),
        ("2 * x - x <= 3", True, False),
        ("(x + y) / 2 - y / 2 <= 1.5", True, False),
        ("x + 1 - (x - y) <= 6", True, False),
        ("x + y <= y + 2.9", True, True),
        ("abs(x) - abs(x) <= 0", True, False),
        ("(x - x) * y <= 0", True, False),
        ("0 * x + y <= 5", True, False),
        ("-(x) + x >= 0", True, False),
        ("z.sp / z.sp <= 1", True, False),
        ("x == x", True, False),
        ("x / 0 <= x", True, True),
    ],
)
def test_what_can_be_proven_is(text: str, hold: bool, fail: bool) -> None:
    root = parse(text).root
    assert (can_hold(root, RANGES), can_fail(root, RANGES)) == (hold, fail)


def test_bounds_are_found_on_either_side() -> None:
    found = [
        (bound.tag, bound.operator, bound.value) for bound in bounds(parse("x <= 1 + 1 and -3 < y and x <= y").root)
    ]
    assert found == [("x", "<=", 2.0), ("y", ">", -3.0)]
