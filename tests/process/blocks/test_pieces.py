"""A body that is cut into functions does what it did."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.process.blocks.code.pieces import cut

BODY = (
    "a = x[0] + p",
    "b = a * 2.0",
    "if b > 3.0:",
    "    x[1] = b",
    "else:",
    "    x[1] = -b",
    "count = 0",
    "for j in range(3):",
    "    count += j",
    "a += count",
    "if x[0] > 90.0:",
    "    broken = True",
    "    break",
    "c = a + b",
    "x[2] = c",
    "b = c - x[1]",
    "x[3] = b",
)
SIMPLE = st.sampled_from(["a", "b", "c", "d"])


def run(functions: list[str], body: list[str], x: list[float]) -> tuple[list[float], dict[str, Any]]:
    """What a loop of two rounds over ``body`` leaves, with what was set in it."""
    room: dict[str, Any] = {"x": x, "p": 1.5, "broken": False}
    inside = "\n".join(f"    {line}" for line in body)
    exec("\n".join(functions) + f"\nfor k in range(2):\n{inside}\n", room)
    return x, {name: value for name, value in room.items() if not name.startswith(("__", "body_"))}


@pytest.mark.parametrize("most", [1, 2, 3, 5, 8, 16])
@pytest.mark.parametrize("first", [1.0, -4.0, 95.0])
def test_pieces_of_any_length_leave_the_same_columns(most: int, first: float) -> None:
    functions, calls = cut("body", BODY, ("x", "p", "k"), wanted=("a", "b", "c"), most=most)
    assert run([], list(BODY), [first, 0.0, 0.0, 0.0])[0] == run(functions, calls, [first, 0.0, 0.0, 0.0])[0]


def test_what_leaves_the_loop_stays_in_it() -> None:
    functions, calls = cut("body", BODY, ("x", "p"), most=4)
    assert "    break" in calls and not any("break" in line for line in functions)
    assert max(len(line) for line in calls) < 60


def test_a_function_takes_what_it_reads_and_gives_what_is_read_later() -> None:
    functions, calls = cut("body", BODY[:6], ("x", "p", "never"), wanted=("b",), most=2)
    assert functions[0] == "def body_0(p, x):" and functions[3] == "    return (b,)"
    assert calls == ["b, = body_0(p, x)", "body_1(b, x)"]


def test_a_short_body_stays_as_it_is() -> None:
    assert cut("body", BODY, ("x", "p")) == ([], list(BODY))


FORMS = st.sampled_from(["{0} += {1} * 0.5", "{0} = {1} - {2}", "if {1} > {2}:\n    {0} = 2.0"])


@given(st.lists(st.tuples(SIMPLE, SIMPLE, SIMPLE, FORMS), min_size=1, max_size=30), st.integers(1, 9))
def test_any_sums_are_the_same_in_pieces(sums: list[tuple[str, str, str, str]], most: int) -> None:
    lines = [line for *names, form in sums for line in form.format(*names).split("\n")]
    functions, calls = cut("body", lines, ("a", "b", "c", "d"), wanted=("a", "b", "c", "d"), most=most)
    starts = {"a": 1.0, "b": 2.0, "c": -3.0, "d": 0.25}
    whole, pieces = dict(starts), dict(starts)
    exec("\n".join(lines), whole)
    exec("\n".join([*functions, *calls]), pieces)
    assert [whole[name] for name in starts] == [pieces[name] for name in starts]
