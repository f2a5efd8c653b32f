"""Terms say what Python's arithmetic says of numbers, and refuse what cannot be an equation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.process.blocks.code.writing import Scope, function
from homeostat.process.blocks.term import (
    MEMBER,
    STAGE,
    Leaf,
    Term,
    evaluate,
    exp,
    leaves,
    limited,
    log,
    maximum,
    minimum,
    sqrt,
    term,
    where,
)

X, P = Term(Leaf.STATE, value="x"), Term(Leaf.PARAMETER, value="p")
NUMBERS = st.floats(-100.0, 100.0).map(lambda v: round(v, 3))


@st.composite
def equations(draw: st.DrawFn, depth: int = 4) -> Term:
    """A term over ``x`` and ``p`` that has a value wherever they have."""
    if depth == 0 or draw(st.booleans()):
        return draw(st.sampled_from([X, P, term(draw(NUMBERS))]))
    a, b = draw(equations(depth - 1)), draw(equations(depth - 1))
    kind = draw(st.sampled_from(["+", "-", "*", "min", "max", "where", "sqrt", "limited", "abs"]))
    made = {
        "+": lambda: a + b, "-": lambda: a - b, "*": lambda: a * b, "min": lambda: minimum(a, b),
        "max": lambda: maximum(a, b), "where": lambda: where(a < b, a, b), "sqrt": lambda: sqrt(a),
        "limited": lambda: limited(a, -50.0, 50.0), "abs": lambda: abs(a),
    }  # fmt: skip
    return made[kind]()


@given(of=equations(), x=NUMBERS, p=NUMBERS)
def test_the_source_of_a_term_and_its_value_are_the_same(of: Term, x: float, p: float) -> None:
    lines, given_terms = function("f", [X], [of])
    room: dict[str, object] = {"math": math}
    exec("\n".join(lines), room)
    held = [evaluate(each, {P: p}) for each in given_terms]
    found = room["f"](x, *held)  # type: ignore[operator]
    assert found[0] == pytest.approx(float(evaluate(of, {X: x, P: p})), rel=1e-12, abs=1e-9)


@given(of=equations(), x=st.lists(NUMBERS, min_size=2, max_size=5), p=NUMBERS)
def test_arrays_have_the_values_of_their_elements(of: Term, x: list[float], p: float) -> None:
    whole = np.broadcast_to(evaluate(of, {X: np.array(x), P: p}), (len(x),))
    each = [float(evaluate(of, {X: value, P: p})) for value in x]
    np.testing.assert_allclose(whole, each, rtol=1e-12)


def test_what_is_the_same_is_worked_out_once() -> None:
    lines, _ = function("f", [X], [sqrt(X * P) + 1.0, sqrt(X * P) + 2.0])
    assert sum("math.sqrt" in line for line in lines) == 1


def test_a_term_of_parameters_alone_is_worked_out_once_per_member() -> None:
    member = Scope({P: "p0"}, MEMBER, "w")
    second = Scope({X: "x0"}, STAGE, "s", member)
    second.name(X * exp(P))
    assert member.lines == ["w0 = math.exp(p0)"] and second.lines == ["s0 = x0 * w0"]
    assert exp(P).often == MEMBER and (X * exp(P)).often == STAGE


def test_equal_trees_are_one_term() -> None:
    assert X + P == X + P and hash(X + P) == hash(X + P) and X + P != P + X
    assert leaves(exp(X) * P, log(P)) == {X, P}


def test_what_does_nothing_is_left_out() -> None:
    assert 0.0 + X == X and X - 0.0 == X and X * 1.0 == X and X / 1.0 == X and term(0.0) == X * 0.0 and X**1.0 == X


def test_an_if_in_an_equation_is_told_to_be_a_where() -> None:
    with pytest.raises(TypeError, match="where"):
        bool(X > 0.0)
    with pytest.raises(TypeError, match="comparison"):
        where(X + 1.0, X, P)


@pytest.mark.parametrize("bad", [None, True, [1.0], b"x"])
def test_what_is_no_term_is_refused(bad: object) -> None:
    with pytest.raises(TypeError, match="is no term"):
        term(bad)  # type: ignore[arg-type]


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_number_that_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        X * bad


def test_a_leaf_without_a_value_is_named() -> None:
    with pytest.raises(KeyError, match=r"parameter\(p\)"):
        evaluate(X + P, {X: 1.0})
