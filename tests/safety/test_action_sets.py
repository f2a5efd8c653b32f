"""What is approved is what is released: the digest covers everything, and every command is a number."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from homeostat.domain.plant.state_machine import Transition
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.stl.formula import parse

NAMES = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
VALUES = st.floats(allow_nan=False, allow_infinity=False)
RATES = st.none() | st.floats(min_value=5e-324, allow_nan=False, allow_infinity=False)
COMMANDS = st.builds(Command, NAMES, st.none() | VALUES, RATES)
SENT = st.lists(COMMANDS, max_size=5, unique_by=lambda c: c.tag).map(tuple)
GUARDS = st.sampled_from(["true", "x >= 1", "x >= 2"]).map(parse)
TRANSITIONS = st.builds(Transition, NAMES, NAMES, NAMES, st.just("fault"), GUARDS, st.just(False))
STEPS = st.builds(Step, TRANSITIONS, st.lists(COMMANDS, max_size=2, unique_by=lambda c: c.tag).map(tuple))
ACTION_SETS = st.builds(ActionSet, SENT, NAMES, st.lists(STEPS, max_size=2).map(tuple))


@given(ACTION_SETS, ACTION_SETS)
def test_equal_digests_mean_equal_sets(one: ActionSet, other: ActionSet) -> None:
    assert (one.digest == other.digest) == (covered(one) == covered(other)) or _differ_by_sign_of_zero(one, other)


def covered(actions: ActionSet) -> tuple[object, ...]:
    """What the digest covers: all of it but the source and the event of a transition, which its name stands for."""
    steps = tuple((s.transition.name, str(s.transition.guard), s.target, s.commands) for s in actions.then)
    return (actions.commands, actions.target, steps)


def _differ_by_sign_of_zero(one: ActionSet, other: ActionSet) -> bool:
    """0.0 == -0.0 in Python, but the digest tells them apart, which is the safe side."""
    return covered(one) == covered(other) and repr(covered(one)) != repr(covered(other))


@given(ACTION_SETS)
def test_the_digest_is_the_same_whenever_it_is_asked_for(actions: ActionSet) -> None:
    copy = replace(actions, commands=tuple(Command(c.tag, c.value, c.rate) for c in actions.commands))
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
    changed = replace(actions, commands=(*actions.commands[:k], new, *actions.commands[k + 1 :]))
    removed = replace(actions, commands=others)
    assert len({actions.digest, changed.digest, removed.digest}) == 3


@given(ACTION_SETS, st.data())
def test_the_order_and_the_target_count(actions: ActionSet, data: st.DataObject) -> None:
    order = data.draw(st.permutations(actions.commands))
    assert (replace(actions, commands=tuple(order)).digest == actions.digest) == (tuple(order) == actions.commands)
    target = data.draw(NAMES)
    assert (replace(actions, target=target).digest == actions.digest) == (target == actions.target)


STEP = Step(Transition("t", "a", "b", "", parse("x >= 1"), False), (Command("p", 1.0, 0.5), Command("q", 2.0, None)))
ROUTE = ActionSet((Command("p", 0.0, None),), "a", (STEP, replace(STEP, commands=())))
ALTERED = {
    "value by one unit in the last place": replace(
        STEP, commands=(Command("p", math.nextafter(1.0, 2.0), 0.5), STEP.commands[1])
    ),
    "rate": replace(STEP, commands=(Command("p", 1.0, 0.25), STEP.commands[1])),
    "order of commands": replace(STEP, commands=STEP.commands[::-1]),
    "one command less": replace(STEP, commands=STEP.commands[:1]),
    "guard": replace(STEP, transition=replace(STEP.transition, guard=parse("x >= 0.999"))),
    "name": replace(STEP, transition=replace(STEP.transition, name="u")),
    "state": replace(STEP, transition=replace(STEP.transition, target="c")),
}


@pytest.mark.parametrize("change", ALTERED)
def test_the_digest_covers_every_later_step(change: str) -> None:
    first, second = (replace(ROUTE, then=then) for then in ((ALTERED[change], ROUTE.then[1]), (STEP, ALTERED[change])))
    assert len({ROUTE.digest, first.digest, second.digest}) == 3


def test_the_digest_covers_how_many_steps_there_are_and_their_order() -> None:
    steps = (ROUTE.then, ROUTE.then[:1], ROUTE.then[1:], ROUTE.then[::-1], (), (*ROUTE.then, STEP))
    assert len({replace(ROUTE, then=then).digest for then in steps}) == len(steps)


def test_a_command_cannot_move_from_one_step_to_another_unnoticed() -> None:
    """The last command of one step and the first of the next are different things to approve."""
    p, q = STEP.commands
    late = replace(ROUTE, then=(replace(STEP, commands=()), replace(STEP, commands=(p, q))))
    early = replace(ROUTE, then=(replace(STEP, commands=(p, q)), replace(STEP, commands=())))
    split = replace(ROUTE, then=(replace(STEP, commands=(p,)), replace(STEP, commands=(q,))))
    assert len({late.digest, early.digest, split.digest}) == 3


def test_a_step_commands_a_tag_once_but_the_next_one_may_command_it_again() -> None:
    twice = replace(STEP, commands=(Command("p", 1.0, None), Command("p", 2.0, None)))
    for then in ((twice,), (STEP, twice)):
        with pytest.raises(ValueError, match=r"action set commands 'p' more than once; one command per tag"):
            ActionSet((), "a", then)
    assert ActionSet((Command("p", 0.0, None),), "a", (STEP, STEP)).then == (STEP, STEP)


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
