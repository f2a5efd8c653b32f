"""The phase of start-up by itself: when it begins, what ends it, and what each end is said to be."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import StartUpBegan, StartUpEnded
from homeostat.domain.plant.rules import StartUp
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.start_up import StartUpPhase
from tests.guard.vessel import MACHINE

LOW, READY = Snapshot(1.0, {"L": 4.0}), Snapshot(1.0, {"L": 5.0})
RULES = StartUp(frozenset({"waiting"}), {}, longest_s={"waiting": 20.0})
OVER = "start-up is not over after 20 s; every limit counts from now on"


def phase(rules: StartUp = RULES, machine: Any = MACHINE) -> tuple[StartUpPhase, list[tuple[Any, float]]]:
    noted: list[tuple[Any, float]] = []
    return StartUpPhase(rules, machine, lambda event, at_s: noted.append((event, at_s))), noted


def test_it_begins_with_the_first_look_and_ends_where_it_could_be_left() -> None:
    start_up, noted = phase()
    assert start_up.holds(3.0, LOW, "waiting") and start_up.holds(4.0, None, "waiting")
    assert start_up.holds(5.0, Snapshot(1.0, {}), "waiting") and not start_up.holds(6.0, READY, "waiting")
    assert not start_up.holds(7.0, LOW, "waiting") and start_up.overdue == ""
    ended = StartUpEnded("waiting", "it could be left: 'L >= 5' holds (start)")
    assert noted == [(StartUpBegan("waiting", 3.0), 3.0), (ended, 6.0)]


def test_it_begins_by_entering_its_state_and_nothing_ends_that_has_not_begun() -> None:
    start_up, noted = phase()
    assert start_up.overdue == "" and not start_up.holds(0.0, LOW, "running")
    start_up.enter("running", 1.0)
    assert noted == []
    start_up, noted = phase()
    start_up.enter("waiting", 1.0)
    assert noted == [(StartUpBegan("waiting", 1.0), 1.0)]


def test_its_longest_time_is_allowed_to_the_second_and_is_said_once() -> None:
    start_up, noted = phase()
    assert start_up.holds(3.0, LOW, "waiting") and start_up.holds(23.0, LOW, "waiting") and start_up.overdue == ""
    assert not start_up.holds(23.1, READY, "waiting") and start_up.overdue == OVER
    assert not start_up.holds(24.0, READY, "waiting") and start_up.overdue == OVER
    assert noted[1:] == [(StartUpEnded("waiting", OVER), 23.1)]
    start_up.enter("running", 25.0)
    assert start_up.overdue == "" and len(noted) == 2


def test_without_a_longest_time_it_lasts() -> None:
    start_up, noted = phase(StartUp(frozenset({"waiting"})))
    assert start_up.holds(0.0, LOW, "waiting") and start_up.holds(1e6, LOW, "waiting") and len(noted) == 1


@pytest.mark.parametrize("how", ["enter", "holds"])
def test_a_state_outside_ends_it_once(how: str) -> None:
    start_up, noted = phase()
    start_up.holds(0.0, LOW, "waiting")
    for now_s in (1.0, 2.0):
        if how == "enter":
            start_up.enter("running", now_s)
        else:
            assert not start_up.holds(now_s, LOW, "running")
    assert noted[1:] == [(StartUpEnded("running", "it was left"), 1.0)]
    assert not start_up.holds(3.0, LOW, "waiting"), "nobody has started it"
    start_up.enter("waiting", 4.0)
    assert start_up.holds(5.0, LOW, "waiting") and noted[2:] == [(StartUpBegan("waiting", 4.0), 4.0)]
    start_up.enter("waiting", 6.0)
    assert len(noted) == 3


def test_an_overdue_start_up_that_is_left_or_started_again_is_overdue_no_more() -> None:
    start_up, noted = phase()
    start_up.holds(0.0, LOW, "waiting")
    start_up.holds(21.0, LOW, "waiting")
    assert not start_up.holds(22.0, LOW, "shut") and start_up.overdue == "" and len(noted) == 2
    start_up.enter("waiting", 30.0)
    assert start_up.holds(50.0, LOW, "waiting") and not start_up.holds(50.5, LOW, "waiting")


def test_it_goes_on_after_a_restart_from_when_it_began() -> None:
    start_up, noted = phase()
    start_up.restore(10.0, False, "waiting")
    start_up.enter("waiting", 11.0)
    assert start_up.holds(30.0, LOW, "waiting") and noted == [] and not start_up.holds(30.5, LOW, "waiting")
    over, noted = phase()
    over.restore(10.0, True, "waiting")
    assert not over.holds(11.0, LOW, "waiting") and noted == []
    left, noted = phase()
    left.restore(10.0, False, "running")
    left.enter("waiting", 12.0)
    assert noted == [(StartUpBegan("waiting", 12.0), 12.0)]
    never, noted = phase()
    never.restore(None, False, "waiting")
    never.enter("waiting", 12.0)
    assert noted == [(StartUpBegan("waiting", 12.0), 12.0)]


def test_a_clock_that_was_set_back_before_its_beginning_ends_it() -> None:
    start_up, noted = phase()
    start_up.restore(10.0, False, "waiting")
    assert start_up.holds(10.0, LOW, "waiting") and not start_up.holds(9.9, LOW, "waiting") and len(noted) == 1


def test_only_what_leads_out_by_itself_from_this_very_state_ends_it() -> None:
    start = MACHINE.transitions[0]
    for other in (
        replace(start, on_decision=True),
        replace(start, source="shut"),
        replace(start, target="waiting"),
        replace(start, guard=None),
    ):
        start_up, _ = phase(machine=replace(MACHINE, transitions=(other,)) if other.guard else broken(other))
        assert start_up.holds(0.0, READY, "waiting"), other
    nan, _ = phase()
    assert nan.holds(0.0, Snapshot(1.0, {"L": math.nan}), "waiting")


def broken(transition: Any) -> Any:
    class Machine:
        transitions = (transition,)

    return Machine()
