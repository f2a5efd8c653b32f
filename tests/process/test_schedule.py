"""Ramps of the inputs: never too fast, never too far, and the same in advance as in the event."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.recovery import Command
from homeostat.process.schedule import InputRamp

INPUTS = ("T1_sp", "F1_sp", "V2_man")
VARIABLES = {"T1.sp": "T1_sp", "F1.sp": "F1_sp", "V2.man": "V2_man", "T1": "T1"}
PRESENT = {"V2_man": 0.5}
VALUES = st.floats(-1e3, 1e3)
RATES = st.none() | st.floats(1e-4, 1e3)
SETPOINT = st.builds(Command, st.sampled_from(["T1.sp", "F1.sp"]), VALUES, RATES)
MANUAL = st.builds(Command, st.just("V2.man"), st.none() | VALUES, RATES)
HISTORY = st.lists(st.tuples(SETPOINT | MANUAL, st.integers(0, 30)), max_size=6)


def ramp(*current: float) -> InputRamp:
    return InputRamp(INPUTS, np.array(current or (310.0, 0.03, math.nan)))


def after(history: list[tuple[Command, int]]) -> InputRamp:
    """A ramp that took commands and ran for a while after each."""
    moving = ramp()
    for command, seconds in history:
        moving.command((command,), VARIABLES, PRESENT)
        for _ in range(seconds):
            moving.advance()
    return moving


@given(HISTORY)
def test_the_schedule_has_the_bits_of_what_follows(history: list[tuple[Command, int]]) -> None:
    moving = after(history)
    planned = moving.schedule(40)
    followed = np.stack([moving.advance() for _ in range(40)])
    assert planned.tobytes() == followed.tobytes()


@given(HISTORY, st.integers(1, 30))
def test_a_schedule_does_not_advance(history: list[tuple[Command, int]], steps: int) -> None:
    moving = after(history)
    before = moving.current.tobytes()
    assert moving.schedule(steps).tobytes() == moving.schedule(steps).tobytes()
    assert moving.current.tobytes() == before


@given(VALUES, VALUES, st.floats(1e-3, 1e3))
def test_a_ramp_keeps_its_rate_and_stops_at_its_target(start: float, target: float, rate: float) -> None:
    moving = ramp(start, 0.0, math.nan)
    moving.command((Command("T1.sp", target, rate),), VARIABLES, PRESENT)
    path = np.concatenate([[start], moving.schedule(60)[:, 0]])
    steps = np.diff(path)
    rounding = 1e-12 * max(abs(start), abs(target), 1.0)
    assert np.all(np.abs(steps) <= rate + rounding)
    assert np.all(steps >= 0.0) or np.all(steps <= 0.0)
    assert min(start, target) <= path.min() and path.max() <= max(start, target)
    needed = math.ceil(abs(target - start) / rate)
    if needed < 60:
        assert np.all(path[needed + 1 :] == target)
    else:
        moved = min(60 * rate, abs(target - start))
        assert path[-1] == pytest.approx(start + math.copysign(moved, target - start), abs=rounding)


def test_by_hand() -> None:
    moving = ramp(310.0, 0.03, math.nan)
    moving.command((Command("T1.sp", 308.2, 0.5), Command("F1.sp", 0.02, None)), VARIABLES, PRESENT)
    assert moving.current.tolist()[:2] == [310.0, 0.03]
    assert moving.schedule(5)[:, 0].tolist() == [309.5, 309.0, 308.5, 308.2, 308.2]
    assert moving.schedule(5)[:, 1].tolist() == [0.02] * 5
    moving.advance()
    moving.command((Command("T1.sp", 310.0, 1.0),), VARIABLES, PRESENT)
    assert moving.schedule(3)[:, 0].tolist() == [310.0, 310.0, 310.0]


def test_a_manual_output_starts_from_the_present_output_and_can_be_handed_back() -> None:
    moving = ramp()
    assert np.isnan(moving.schedule(3)[:, 2]).all()
    moving.command((Command("V2.man", 0.9, 0.2),), VARIABLES, PRESENT)
    assert moving.schedule(4)[:, 2] == pytest.approx([0.7, 0.9, 0.9, 0.9])
    moving.advance()
    moving.command((Command("V2.man", 0.0, None),), VARIABLES, {"V2_man": 0.123})
    assert moving.advance()[2] == 0.0
    moving.command((Command("V2.man", None, None),), VARIABLES, PRESENT)
    assert math.isnan(moving.current[2]) and np.isnan(moving.schedule(3)[:, 2]).all()
    assert math.isnan(moving.advance()[2])


def test_without_commands_nothing_moves() -> None:
    moving = ramp()
    start = moving.current.tobytes()
    assert all(moving.advance().tobytes() == start for _ in range(5))


@given(HISTORY)
def test_a_command_sent_twice_is_a_command_sent_once(history: list[tuple[Command, int]]) -> None:
    once, twice = after(history), after(history)
    command = (Command("T1.sp", 305.0, 0.25),)
    once.command(command, VARIABLES, PRESENT)
    twice.command(command, VARIABLES, PRESENT)
    twice.command(command, VARIABLES, PRESENT)
    assert once.schedule(30).tobytes() == twice.schedule(30).tobytes()


def test_rows_that_were_handed_out_never_change() -> None:
    """The plant keeps them as its record."""
    moving = ramp()
    row = moving.advance()
    before = row.tobytes()
    moving.command((Command("V2.man", 0.9, None), Command("T1.sp", 300.0, None)), VARIABLES, PRESENT)
    moving.advance()
    moving.command((Command("V2.man", None, None),), VARIABLES, PRESENT)
    assert row.tobytes() == before


def test_the_ramp_keeps_its_own_copy_of_the_start() -> None:
    start = np.array([310.0, 0.03, math.nan])
    moving = InputRamp(INPUTS, start)
    start[:] = 0.0
    assert moving.advance()[0] == 310.0


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (Command("T1", 300.0, None), "'T1' cannot be commanded; these can: 'T1.sp', 'F1.sp', 'V2.man'"),
        (Command("T9", 300.0, None), "'T9' cannot be commanded"),
        (Command("T1.sp", None, None), "'T1.sp' has no automatic mode; command a value"),
    ],
)
def test_commands_are_taken_all_or_not_at_all(command: Command, message: str) -> None:
    moving = ramp()
    before = moving.schedule(10).tobytes()
    with pytest.raises(ValueError) as refused:
        moving.command((Command("F1.sp", 0.01, None), command), VARIABLES, PRESENT)
    assert message in str(refused.value)
    assert moving.schedule(10).tobytes() == before
