"""What is approved is what is released: the digest covers everything, and every command is a number."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from homeostat.domain.recovery import ActionSet, Command

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
VALUES = st.floats(allow_nan=False, allow_infinity=False)
RATES = st.none() | st.floats(min_value=5e-324, allow_nan=False, allow_infinity=False)
COMMANDS = st.builds(Command, NAMES, st.none() | VALUES, RATES)
ACTION_SETS = st.builds(
    ActionSet, st.lists(COMMANDS, max_size=5, unique_by=lambda c: c.tag).map(tuple), NAMES
)  # fmt: skip


@given(ACTION_SETS, ACTION_SETS)
def test_equal_digests_mean_equal_sets(one: ActionSet, other: ActionSet) -> None:
    assert (one.digest == other.digest) == (one == other) or _differ_by_sign_of_zero(one, other)


def _differ_by_sign_of_zero(one: ActionSet, other: ActionSet) -> bool:
    """0.0 == -0.0 in Python, but the digest tells them apart, which is the safe side."""
    return one == other and repr(one) != repr(other)


@given(ACTION_SETS)
def test_the_digest_is_the_same_whenever_it_is_asked_for(actions: ActionSet) -> None:
    copy = ActionSet(tuple(Command(c.tag, c.value, c.rate) for c in actions.commands), actions.target)
    assert copy.digest == actions.digest == actions.digest
    assert len(actions.digest) == 64 and set(actions.digest) <= set("0123456789abcdef")


@given(ACTION_SETS, st.data())
def test_any_change_changes_the_digest(actions: ActionSet, data: st.DataObject) -> None:
    assume(actions.commands)
    k = data.draw(st.integers(0, len(actions.commands) - 1), label="which command")
    old = actions.commands[k]
    new = data.draw(COMMANDS, label="new command")
    others = actions.commands[:k] + actions.commands[k + 1 :]
    assume(repr(new) != repr(old) and new.tag not in {c.tag for c in others})
    changed = ActionSet((*actions.commands[:k], new, *actions.commands[k + 1 :]), actions.target)
    removed = ActionSet(others, actions.target)
    assert len({actions.digest, changed.digest, removed.digest}) == 3


@given(ACTION_SETS, st.data())
def test_the_order_and_the_target_count(actions: ActionSet, data: st.DataObject) -> None:
    order = data.draw(st.permutations(actions.commands))
    assert (ActionSet(tuple(order), actions.target).digest == actions.digest) == (tuple(order) == actions.commands)
    target = data.draw(NAMES)
    assert (ActionSet(actions.commands, target).digest == actions.digest) == (target == actions.target)


@given(VALUES)
def test_the_next_number_is_another_command(value: float) -> None:
    following = math.nextafter(value, math.inf)
    assume(math.isfinite(following))
    one, other = (ActionSet((Command("T.sp", v, None),), "running") for v in (value, following))
    assert one.digest != other.digest


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_command_is_a_number(value: float) -> None:
    with pytest.raises(ValueError, match=r"'T.sp': value .* must be finite"):
        Command("T.sp", value, None)
    with pytest.raises(ValueError, match=r"'T.sp': rate .* must be finite and > 0"):
        Command("T.sp", 1.0, value)


@pytest.mark.parametrize("rate", [0.0, -0.0, -5e-324, -1.0])
def test_a_rate_is_positive(rate: float) -> None:
    with pytest.raises(ValueError, match="must be finite and > 0 per second"):
        Command("T.sp", 1.0, rate)


@pytest.mark.parametrize("value", [0.0, -0.0, 5e-324, -5e-324, 1.7976931348623157e308, -1.7976931348623157e308])
def test_every_finite_number_is_a_command(value: float) -> None:
    assert Command("T.sp", value, 5e-324).value == value


@given(st.lists(COMMANDS, min_size=1, max_size=4), st.data())
def test_a_tag_is_commanded_once(commands: list[Command], data: st.DataObject) -> None:
    twice = data.draw(st.sampled_from(commands))
    again = Command(twice.tag, data.draw(VALUES), None)
    with pytest.raises(ValueError, match="more than once; one command per tag"):
        ActionSet((*commands, again), "running")


@given(ACTION_SETS)
def test_a_command_is_found_by_its_tag(actions: ActionSet) -> None:
    for c in actions.commands:
        assert actions.command(c.tag) == c
    assert actions.command("\x00 no such tag") is None
