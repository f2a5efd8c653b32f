"""What is refused, and that the message names the place and the remedy."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.plant.tag import Range, Role, Tag
from homeostat.stl.formula import FormulaError, parse, parse_expression
from homeostat.stl.parser import MAX_DEPTH

TAGS = {name: Tag(name, Role.PV, "K", Range(0.0, 500.0), 1.0) for name in ("T1", "T1.sp", "T2", "flow")}


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        ("", 1, "unexpected end"),
        ("  ", 1, "unexpected end"),
        ("T1", 3, "expected a comparison"),
        ("T1 <=", 6, "unexpected end; expected a tag or a number"),
        ("T1 <= and", 7, "unexpected 'and'"),
        ("T1 <= 3 and", 12, "unexpected end"),
        ("T1 and T2 <= 3", 4, "unexpected 'and'; expected a comparison"),
        ("T1 <= 2 3", 9, "unexpected '3'"),
        ("1 <= T1 <= 2", 9, "cannot be chained; write 'a <= x and x <= b'"),
        ("T1<=1 until T1<=2 until T1<=3", 19, "'until' cannot be chained"),
        ("T1 = 3", 4, "write '=='"),
        ("T1 <= 3 & T2 <= 3", 9, "write 'and'"),
        ("T1 <= 3 || T2 <= 3", 9, "write 'or'"),
        ("!(T1 <= 3)", 1, "write 'not'"),
        ("T1 ? 3", 4, "unexpected character '?'"),
        ("T1..sp <= 3", 3, "unexpected character '.'"),
        ("2T1 <= 3", 2, "unexpected 'T1'"),
        ("(T1 <= 3", 1, "this '(' is never closed"),
        ("T1 <= 3 and (abs(T2) <= 1", 13, "this '(' is never closed"),
        ("(T1 + (2 <= 3", 10, "unexpected '<='"),
        ("T1 <= 3)", 8, "this ')' closes nothing"),
        ("(T1 <= 3) + 1 <= 2", 11, "unexpected '+'"),
        ("abs(T1 <= 3) <= 1", 8, "unexpected '<='"),
        ("min(T1) <= 3", 7, "expected an operator or ','"),
        ("max(T1, T2, 3) <= 3", 11, "expected an operator or ')'"),
        ("T1 <= 1e999", 7, "number '1e999' is too large"),
        ("T1 >= 2 and T1 != 3", 16, "'!=' can never be violated; write a distance, as in abs(a - b) >= 0.5"),
        ("not T1 == 3", 8, "a negated '==' can never be violated; write a distance, as in abs(a - b) >= 0.5"),
        ("T2 <= 1 and not (T1 <= 3 or 3 == T1)", 31, "a negated '==' can never be violated"),
        ("not always[0,9](T2 >= 1 and T1 == 3)", 32, "a negated '==' can never be violated"),
        ("not ((T1 <= 1) until (T1 + 1 == 3))", 30, "a negated '==' can never be violated"),
        ("not not not (T1 == 3)", 17, "a negated '==' can never be violated"),
        ("not (T2 <= 1 implies T1 == 3)", 25, "a negated '==' can never be violated"),
        ("T1 == 3 implies T2 <= 1", 4, "a negated '==' can never be violated"),
        ("T2 <= 1 -> eventually (T1 == 3) -> T2 <= 1", 27, "a negated '==' can never be violated"),
        ("not (2 == 3 or T1 <= 3)", 8, "a negated '==' can never be violated"),
        ("always[5,1](T1 <= 3)", 8, "bounds [5,1] s are reversed"),
        ("always[-1,2](T1 <= 3)", 8, "bound -1 s is negative"),
        ("eventually[-3,-1](T1 <= 3)", 12, "bound -3 s is negative"),
        ("T1<=1 until[0,-2] T1<=2", 15, "bound -2 s is negative"),
        ("always[0](T1 <= 3)", 9, "expected ','"),
        ("always[0,T1](T1 <= 3)", 10, "unexpected 'T1'"),
        ("always[0,1e999](T1 <= 3)", 10, "too large"),
        ("always[0,5]", 12, "unexpected end"),
    ],
)
def test_text_that_is_no_formula(text: str, column: int, message: str) -> None:
    with pytest.raises(FormulaError) as caught:
        parse(text)
    assert f"formula {text!r}, column {column}: " in str(caught.value)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [("T1 <= 3", 4, "unexpected '<='"), ("F2 -", 5, "unexpected end"), ("always(x <= 1)", 1, "unexpected 'always'")],
)
def test_text_that_is_no_expression(text: str, column: int, message: str) -> None:
    with pytest.raises(FormulaError, match=re.escape(f"expression {text!r}, column {column}: {message}")):
        parse_expression(text)


def test_a_position_in_several_lines_names_the_line() -> None:
    with pytest.raises(FormulaError, match=re.escape("line 2, column 6: unexpected '<='")):
        parse("T1 <= 3\n and <= 2")


@pytest.mark.parametrize(
    ("text", "column", "tag", "near"),
    [
        ("T1 <= 3 and T11 <= 3", 13, "T11", "'T1'"),
        ("abs(T1 - T1.spp) <= 1", 10, "T1.spp", "'T1.sp'"),
        ("always[0,5](flwo > 0)", 13, "flwo", "'flow'"),
    ],
)
def test_an_unknown_tag_is_named_with_its_column_and_near_matches(text: str, column: int, tag: str, near: str) -> None:
    with pytest.raises(FormulaError) as caught:
        parse(text, TAGS)
    assert f"formula {text!r}, column {column}: unknown tag {tag!r}; did you mean " in str(caught.value)
    assert near in str(caught.value)


@pytest.mark.parametrize(
    "text", ["T1 == 3", "not not T1 == 3", "T2 <= 1 implies T1 == 3", "not (T1 == 3 implies T2 <= 1)"]
)
def test_an_equality_that_is_asked_for_is_read(text: str) -> None:
    assert not parse(text).holds({"T1": 2.5, "T2": 0.5})


def test_an_unknown_tag_of_an_expression_is_named() -> None:
    with pytest.raises(FormulaError, match=re.escape("column 10: unknown tag 'T1.spp'; did you mean 'T1.sp'")):
        parse_expression("abs(T1 - T1.spp)", TAGS)
    assert parse_expression("abs(T1 - T1.sp)", TAGS).tags == {"T1", "T1.sp"}


def test_the_first_unknown_tag_is_reported_and_nothing_is_guessed() -> None:
    with pytest.raises(FormulaError, match=re.escape("column 1: unknown tag 'qqq'") + "$"):
        parse("qqq <= zzz", TAGS)
    assert parse("qqq <= zzz").tags == {"qqq", "zzz"}


@pytest.mark.parametrize(
    "text",
    ["not " * 50_000 + "true", "-" * 50_000 + "x <= 1", "true implies " * 50_000 + "true", "x" + "+x" * 50_000 + "<=1"],
    ids=["not", "minus", "implies", "sum"],
)
def test_nesting_without_end_is_refused_and_does_not_exhaust_the_stack(text: str) -> None:
    with pytest.raises(FormulaError, match=f"nested deeper than {MAX_DEPTH} operators") as caught:
        parse(text)
    assert len(str(caught.value)) < 300


def test_one_level_too_deep_is_refused() -> None:
    with pytest.raises(FormulaError, match="nested deeper"):
        parse("not " * (MAX_DEPTH - 1) + "x <= 1")


@pytest.mark.parametrize("text", ["(" * 5_000, "(" * 5_000 + "x <= 1", "always(" * 5_000, "x <= 1" + ")" * 5_000])
def test_parentheses_without_end_are_refused(text: str) -> None:
    with pytest.raises(FormulaError):
        parse(text)


@pytest.mark.parametrize(
    "text",
    [
        "not " * (MAX_DEPTH - 2) + "x <= 1",
        "always[0,1] " * (MAX_DEPTH - 2) + "x <= 1",
        "x" + "+x" * (MAX_DEPTH - 2) + " <= 1",
        "(" * 3_000 + "x <= 1" + ")" * 3_000,
        " and ".join(["x <= 1"] * 3_000),
    ],
    ids=["not", "always", "sum", "parentheses", "and"],
)
def test_the_deepest_formula_allowed_can_be_used(text: str) -> None:
    formula = parse(text)
    assert formula.evaluate({"x": np.zeros(3)}, 1.0).value.shape == (1,)
    assert parse(str(formula)) == parse(str(parse(str(formula))))
    assert formula.horizon_s >= 0.0
    assert hash(formula) == hash(parse(text))


@given(st.text(alphabet="Tx1.09 ()[],<>=!+-*/abandorlwsuntiefmx\n", max_size=40))
@settings(max_examples=500)
def test_any_text_is_a_formula_or_a_formula_error(text: str) -> None:
    try:
        formula = parse(text)
    except FormulaError as error:
        assert "column" in str(error)
    else:
        assert parse(str(formula)).root == formula.root
