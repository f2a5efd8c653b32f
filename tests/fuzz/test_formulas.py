"""Any text is a formula that reads back as itself, or one line that says where it is none; any reading is judged."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.stl.formula import Expression, Formula, FormulaError, parse, parse_expression

TOKENS = st.sampled_from([
    "T1", "F1.sp", "1", "0.5", "1e9", "1e-300", "1e308", "9" * 400, "(", ")", "[", "]", ",", "<=", ">=", "<", ">", "==",
    "!=", "=", "+", "-", "*", "/", "and", "or", "not", "implies", "->", "always", "eventually", "until", "[0,10]",
    "[5,1]", "[0,1e400]", "abs(", "min(", "max(", "true", "false", "nan", "inf", "\n", "\u00b5", "\u202e", "\x00",
])  # fmt: skip
TEXTS = st.one_of(st.lists(TOKENS, max_size=14).map(" ".join), st.text(max_size=40))
READINGS = st.one_of(
    st.floats(), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0, 5e-324, 1.7e308, -1.7e308])
)


def said(error: FormulaError) -> None:
    text = str(error)
    assert text.isprintable() and len(text) < 600, text


@settings(max_examples=400)
@given(TEXTS)
def test_a_condition_reads_back_as_itself_or_is_refused_in_one_line(text: str) -> None:
    try:
        formula = parse(text)
    except FormulaError as error:
        said(error)
        return
    again = parse(str(formula))
    assert again.root == formula.root and str(again) == str(formula)


@settings(max_examples=300)
@given(TEXTS)
def test_a_term_reads_back_as_itself_or_is_refused_in_one_line(text: str) -> None:
    try:
        term = parse_expression(text)
    except FormulaError as error:
        said(error)
        return
    assert parse_expression(str(term)).root == term.root


@settings(max_examples=60)
@given(
    st.sampled_from(["(", "not ", "-", "abs(", "always ", "T1 + ", "T1 <= 1 and ", "[", "true -> "]),
    st.integers(1, 3000),
)
def test_nesting_without_end_ends(opening: str, depth: int) -> None:
    for closing in ("T1", "T1 <= 1", "T1 <= 1" + ")" * depth):
        for read in (parse, parse_expression):
            try:
                formula: Formula | Expression = read(opening * depth + closing)
                assert str(formula)
            except FormulaError as error:
                said(error)


CONDITIONS = [
    "T1 <= 313", "not (T1 <= 313)", "T1 <= 313 and F1 >= 2", "T1 <= 313 or F1 >= 2", "T1 <= 313 implies F1 >= 2",
    "abs(T1 - F1) <= 2", "T1 / F1 <= 2", "T1 * F1 <= 2", "min(T1, F1) <= 2", "max(T1, F1) >= 2", "T1 - F1 <= T1 + F1",
]  # fmt: skip


@settings(max_examples=400)
@given(st.sampled_from(CONDITIONS), READINGS, READINGS)
def test_whatever_is_read_is_judged_and_undecided_is_no_verdict(text: str, t1: float, f1: float) -> None:
    """A verdict on two readings is what their comparison says; what needs an unknown one is undecided."""
    margin = float(parse(text).evaluate({"T1": t1, "F1": f1}, 1.0).value[0])
    cold, fed, known = t1 <= 313, f1 >= 2, not (math.isnan(t1) or math.isnan(f1))
    if text == "T1 <= 313":
        assert math.isnan(margin) == math.isnan(t1) and (margin >= 0.0) == cold
    elif text == "not (T1 <= 313)":
        assert math.isnan(margin) == math.isnan(t1) and (margin >= 0.0) == (t1 >= 313)
    elif text == "T1 <= 313 and F1 >= 2":
        assert (margin >= 0.0) == (cold and fed) and (known <= (not math.isnan(margin)))
    elif text == "T1 <= 313 or F1 >= 2":
        assert (margin >= 0.0) == (cold or fed) and (known <= (not math.isnan(margin)))
    if math.isnan(t1) and math.isnan(f1):
        assert math.isnan(margin)
