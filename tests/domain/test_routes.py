"""Routes: which part of a path is released, which part is awaited, and the action set that takes it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step, open_setpoints
from homeostat.stl.formula import parse

pytestmark = pytest.mark.quick

STATES = tuple(State(f"s{k}", f"s{k}", 0, k == 0, True, parse("true"), frozenset(), ()) for k in range(6))
"""A chain of states; the machine can stay in s0, too."""


def chain(*decided: bool) -> RecoveryPath:
    """The path s0 > s1 > ..., of which ``decided`` says what somebody decides on."""
    steps = tuple(
        Transition(f"t{k}", f"s{k}", f"s{k + 1}", "fault" if d else "", parse(f"x >= {k}"), d)
        for k, d in enumerate(decided)
    )
    return RecoveryPath(StateMachine("chain", STATES, steps), steps)


def sent(state: State) -> tuple[Command, ...]:
    """Each state has a command of its own."""
    return (Command("x.sp", float(state.name[1:]), None),)


@pytest.mark.parametrize(
    ("decided", "now", "commanded"),
    [
        ((True,), "s1", ("s1",)),
        ((True, True), "s2", ("s2",)),
        ((True, False), "s1", ("s1", "s2")),
        ((True, True, False, False), "s2", ("s2", "s3", "s4")),
        ((False,), "s0", ("s0", "s1")),
        ((False, False), "s0", ("s0", "s1", "s2")),
    ],
)
def test_a_path_is_released_up_to_where_it_waits(
    decided: tuple[bool, ...], now: str, commanded: tuple[str, ...]
) -> None:
    path = chain(*decided)
    assert path.decisions == path.transitions[: sum(decided)]
    assert path.awaited == path.transitions[sum(decided) :]
    assert (path.now, path.commanded) == (now, commanded)


@given(st.integers(0, 3), st.integers(0, 2))
def test_an_action_set_along_a_path_commands_every_state_in_which_the_plant_will_be(decisions: int, waits: int) -> None:
    if decisions + waits == 0:
        return
    path = chain(*[True] * decisions, *[False] * waits)
    actions = ActionSet.along(path, sent)
    assert actions.states == path.commanded and actions.end == path.target
    assert actions.target == path.now and actions.commands == sent(path.machine.state(path.now))
    assert actions.then == tuple(Step(t, sent(path.machine.state(t.target))) for t in path.awaited)


def test_states_that_are_only_passed_through_are_not_commanded() -> None:
    """Two decisions at once: the plant goes to the second state right away."""
    actions = ActionSet.along(chain(True, True), sent)
    assert actions.commands == (Command("x.sp", 2.0, None),) and actions.then == () and actions.end == "s2"


def test_without_later_steps_the_end_is_the_target() -> None:
    actions = ActionSet((), "s3")
    assert actions.end == actions.target == "s3" and actions.states == ("s3",)


def test_a_step_leads_where_its_transition_does() -> None:
    (transition,) = chain(False).transitions
    assert Step(transition, ()).target == "s1"
    assert ActionSet((), "s0", (Step(transition, ()),)).states == ("s0", "s1")


def test_an_action_set_finds_only_what_it_sends_at_once() -> None:
    actions = ActionSet.along(chain(True, False), sent)
    assert actions.command("x.sp") == Command("x.sp", 1.0, None)
    assert ActionSet((), "s0", actions.then).command("x.sp") is None


def chosen_in(*ranges: tuple[float, float, float | None]) -> tuple[SetpointRange, ...]:
    """What is chosen once for states that leave the speed of a pump open in these ranges."""
    return open_setpoints([
        State(f"s{k}", "", 0, False, True, parse("true"), frozenset(), (SetpointRange("P.cmd", *r),))
        for k, r in enumerate(ranges)
    ])  # fmt: skip


def test_what_is_chosen_for_a_whole_route_is_what_all_its_states_admit() -> None:
    assert chosen_in((0.6, 1.0, 0.9), (0.0, 0.0, 0.0), (0.5, 0.8, 0.7)) == (SetpointRange("P.cmd", 0.6, 0.8, 0.8),)
    assert chosen_in((0.6, 0.95, 0.7), (0.85, 1.0, 0.9)) == (SetpointRange("P.cmd", 0.85, 0.95, 0.85),)
    assert chosen_in((0.0, 0.0, 0.0)) == () and chosen_in((0.0, 1.0, None))[0].design is None


@pytest.mark.parametrize("second", [(0.85, 1.0, 0.9), (0.8, 1.0, 0.9)])
def test_states_that_admit_nothing_in_common_leave_no_choice(second: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match=r"'P.cmd' is open in state 's1' from .* nothing can be chosen"):
        chosen_in((0.6, 0.8, 0.7), second)
