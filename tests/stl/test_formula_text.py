"""Reading and writing formulas: grouping, round trips, and what a parsed formula says about itself."""

from __future__ import annotations

import math
import pickle

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.stl.formula import parse, parse_expression
from homeostat.stl.text import render
from homeostat.stl.tree import (
    Always,
    And,
    Arithmetic,
    Binary,
    Call,
    Comparison,
    Eventually,
    Implies,
    Logic,
    Negate,
    Not,
    Number,
    Or,
    TagValue,
    Truth,
    Until,
    negated_equalities,
)

pytestmark = pytest.mark.quick

KEYWORDS = {
    "and",
    "or",
    "not",
    "implies",
    "always",
    "eventually",
    "until",
    "true",
    "false",
    "abs",
    "sqrt",
    "min",
    "max",
}
NAMES = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,4}(\.[a-z]{1,3})?", fullmatch=True).filter(lambda n: n not in KEYWORDS)
BOUNDS = st.tuples(st.floats(0, 1e6), st.floats(0, 1e6)).map(sorted) | st.just([0.0, math.inf])


def _arithmetic() -> st.SearchStrategy[Arithmetic]:
    leaves = st.floats(0, allow_infinity=False).map(Number) | NAMES.map(TagValue)
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            inner.map(Negate),
            st.builds(Binary, st.sampled_from("+-*/"), inner, inner),
            st.builds(lambda f, a: Call(f, (a,)), st.sampled_from(["abs", "sqrt"]), inner),
            st.builds(lambda f, a, b: Call(f, (a, b)), st.sampled_from(["min", "max"]), inner, inner),
        ),
        max_leaves=6,
    )


def _logic() -> st.SearchStrategy[Logic]:
    comparators = st.sampled_from(["<=", "<", ">=", ">", "=="])
    leaves = st.builds(Comparison, comparators, _arithmetic(), _arithmetic()) | st.booleans().map(Truth)
    return st.recursive(
        leaves,
        lambda inner: st.one_of(
            inner.map(Not),
            st.builds(And, st.lists(inner, min_size=2, max_size=3).map(tuple)),
            st.builds(Or, st.lists(inner, min_size=2, max_size=3).map(tuple)),
            st.builds(Implies, inner, inner),
            st.builds(lambda f, b: Always(f, *b), inner, BOUNDS),
            st.builds(lambda f, b: Eventually(f, *b), inner, BOUNDS),
            st.builds(lambda f, g, b: Until(f, g, *b), inner, inner, BOUNDS),
        ),
        max_leaves=6,
    )


@given(_logic().filter(lambda root: not any(negated_equalities(root))))
@settings(max_examples=300)
def test_a_formula_reads_back_as_itself(root: Logic) -> None:
    formula = parse(render(root))
    assert formula.root == root
    assert parse(str(formula)).root == root
    assert str(parse(str(formula))) == str(formula)


@given(_arithmetic())
@settings(max_examples=200)
def test_an_expression_reads_back_as_itself(root: Arithmetic) -> None:
    expression = parse_expression(render(root))
    assert expression.root == root
    assert parse_expression(str(expression)).root == root


@pytest.mark.parametrize(
    ("text", "grouped"),
    [
        ("a<=1 or b<=1 and c<=1", "(a<=1) or ((b<=1) and (c<=1))"),
        ("a<=1 and b<=1 implies c<=1", "((a<=1) and (b<=1)) implies (c<=1)"),
        ("a<=1 implies b<=1 implies c<=1", "(a<=1) implies ((b<=1) implies (c<=1))"),
        ("a<=1 -> b<=1", "a<=1 implies b<=1"),
        ("not a<=1 and b<=1", "(not (a<=1)) and (b<=1)"),
        ("always[0,9] a<=1 and b<=1", "(always[0,9](a<=1)) and (b<=1)"),
        ("always[0,9] not eventually a<=1", "always[0,9](not(eventually(a<=1)))"),
        ("a<=1 until[0,9] b<=1 and c<=1", "((a<=1) until[0,9] (b<=1)) and (c<=1)"),
        ("not a<=1 until b<=1", "(not (a<=1)) until (b<=1)"),
        ("a-b-c <= 1", "(a-b)-c <= 1"),
        ("a/b*c <= 1", "(a/b)*c <= 1"),
        ("a+b*c <= 1", "a+(b*c) <= 1"),
        ("-a*b <= 1", "(-a)*b <= 1"),
        ("a - -b <= 1", "a-(-b) <= 1"),
        ("((a)) <= (1)", "a <= 1"),
        ("always\n  [ 0 , 1.50 ]\t(a<=1)", "always[0,1.5](a<=1)"),
    ],
)
def test_grouping(text: str, grouped: str) -> None:
    assert parse(text).root == parse(grouped).root


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("always[0,600]T1<=313.0", "always[0,600](T1 <= 313)"),
        ("eventually[0,600] always[0,60] (abs(T1-T1.sp)<=1)", "eventually[0,600](always[0,60](abs(T1 - T1.sp) <= 1))"),
        ("not(P101.speed>0 and V204.open<.5)", "not (P101.speed > 0 and V204.open < 0.5)"),
        ("x-(y-z) <= --3*(2/x)", "x - (y - z) <= --3 * (2 / x)"),
        ("(x<=1 or y<=1) and true", "(x <= 1 or y <= 1) and true"),
        ("(x<=1 -> y<=1) -> true -> false", "(x <= 1 implies y <= 1) implies true implies false"),
        ("(x<=1 and (y<=1 and true)) or (false or true)", "x <= 1 and (y <= 1 and true) or (false or true)"),
        ("x <= 1e-7 until false", "(x <= 1e-07) until (false)"),
    ],
)
def test_canonical_text(text: str, canonical: str) -> None:
    assert str(parse(text)) == canonical
    assert parse(text).text == text


@pytest.mark.parametrize(
    "name", ["T1", "T1.sp", "B203.level", "_x", "android", "minimum", "not_open", "T1.and", "trueish"]
)
def test_names_that_begin_like_keywords_are_tags(name: str) -> None:
    assert parse(f"{name}<=1").tags == {name}


@pytest.mark.parametrize(
    ("text", "horizon_s"),
    [
        ("x <= 1", 0.0),
        ("always[0,600](x <= 1)", 600.0),
        ("eventually[0,600] always[10,60] (x <= 1)", 660.0),
        ("always[0,5](x <= 1) and eventually[2,7](x <= 1)", 7.0),
        ("(always[0,5](x <= 1)) until[1,3] (x <= 1)", 8.0),
        ("not always(x <= 1)", math.inf),
        ("always[0,9.5](x <= 1) -> true", 9.5),
    ],
)
def test_horizon(text: str, horizon_s: float) -> None:
    assert parse(text).horizon_s == horizon_s


def test_formulas_are_values() -> None:
    formula = parse("always[0,5](x <= 1) and y.sp == 2")
    assert formula.tags == {"x", "y.sp"}
    assert formula == parse("always[0,5](x <= 1) and y.sp == 2")
    assert hash(formula) == hash(parse(formula.text))
    assert formula != parse("always[0,6](x <= 1) and y.sp == 2")
    assert pickle.loads(pickle.dumps(formula)) == formula
