"""What a review found: each was true of the guard once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.clock import DeclaredClock
from homeostat.recovery.exchange import Exchange
from tests.guard.vessel import DRAIN, ROUTE, World, running, statuses


def test_a_step_owed_from_before_a_person_s_fallback_is_void() -> None:
    world = running()
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick(2)
    world.vessel.ignores = True
    world.tick(12, L=9.5)  # the step is taken by the link, ignored by the plant, and owed
    world.vessel.ignores = False
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    world.tick(30, L=8.0)
    after = world.sent[world.sent.index(DRAIN.actions.commands) + 1 :]
    assert after == []


def test_a_late_attempt_that_a_later_one_had_overtaken_is_put_right_while_latched() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick(4)  # the first attempt hangs and times out
    world.vessel.hangs = False
    world.tick(4)
    assert statuses(world)[-1] == "confirmed"
    world.tick(4, L=14.0)
    assert world.guard.latched is not None
    world.vessel.accepted["F.sp"] = 0.02
    world.tick(3)
    assert world.vessel.accepted["F.sp"] == 0.0 and "F.sp" not in world.guard.out_of_service


def test_a_reading_that_is_uncertain_for_good_counts_after_the_grace_of_its_limit() -> None:
    world = running()
    for _ in range(30):
        sample = world.vessel.sample()
        hot = {**sample.values, "T": 330.0 + 0.01 * sample.at_s}
        doubted = Snapshot(
            sample.at_s, hot, uncertain=frozenset({"T"}), reasons={"T": "maintenance"}, accepted=sample.accepted
        )
        world.seen.append(world.guard.tick(sample.at_s, doubted))
    assert world.guard.latched is not None and "LIM-HOT" in world.guard.latched


def test_later_steps_of_a_request_that_failed_are_not_carried_out() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick(14)
    assert statuses(world)[-1] == "failed"
    world.vessel.ignores = False
    world.tick(5, L=9.5)
    assert ROUTE.then[0].commands not in world.sent


def test_who_uses_a_name_again_gets_an_answer_of_its_own() -> None:
    world = running(mode=Mode.APPROVE)
    first = world.ask()
    world.tick()
    world.ask(replace(first, proposer="stranger"))
    world.tick()
    assert statuses(world)[-1] == "offered"
    assert statuses(world, "r1#again") == ["refused"]


def test_a_limit_that_is_violated_again_calls_the_next_strategy() -> None:
    world = running()
    world.tick(5, L=14.0)
    world.tick(20, L=8.0)
    world.tick(5, L=14.0)
    assert [c for c in world.sent if c == DRAIN.actions.commands] == [DRAIN.actions.commands]
    assert len(world.sent) == 2


def test_recovery_does_not_speak_for_a_person() -> None:
    exchange = Exchange(DeclaredClock(0.0), lambda message: True, lambda cause: None)
    with pytest.raises(PermissionError, match="Ada"):
        exchange.put(PersonCommand("o1", "Ada", Role.ENGINEER, Verb.RESET, reason="looks fine"))


def test_a_restart_that_trips_before_it_has_read_the_plant_sends_nothing_of_before() -> None:
    from homeostat.domain.write_events import Cause
    from homeostat.guard.memory import Memory, OpenWrite

    open_step = OpenWrite(Cause.SEQUENCE, "start", (Command("F.sp", 0.03, 0.005),), "running", (), True)
    memory = Memory(mode=Mode.CLOSED_LOOP, state="running", waiting=(), writes=1, open={1: open_step}, last=open_step)
    world = World(memory=memory)
    world.vessel.values["L"] = 14.0
    blind = replace(world.vessel.sample(), accepted={})
    world.seen.append(world.guard.tick(blind.at_s, blind))
    world.tick(20)
    assert world.guard.latched is not None
    assert (Command("F.sp", 0.03, 0.005),) not in world.sent


def test_one_leap_of_the_clock_trips_nothing_and_is_caught_up_at_once() -> None:
    world = running()
    sample = world.vessel.sample()
    world.guard.tick(sample.at_s + 60.0, sample)
    assert "clock" in world.alarms
    seen = world.tick(30)
    assert world.guard.latched is None and seen.now_s == world.vessel.now_s and "clock" not in world.alarms


def test_a_clock_that_goes_on_from_where_it_leapt_to_is_believed() -> None:
    world = running()
    world.vessel.now_s += 600.0  # the machine slept
    world.tick(3)
    assert world.seen[-1].now_s == world.vessel.now_s and world.guard.latched is None


def test_the_limits_of_start_up_end_when_the_plant_could_leave_it_whoever_keeps_it_there() -> None:
    world = World()
    world.tick(3, L=4.0, T=340.0)
    assert world.guard.latched is None
    world.order(Verb.OUT_OF_SERVICE, "F.sp", reason="maintenance")
    world.tick(20, L=8.0)
    assert world.seen[-1].state != "running" and world.guard.latched is not None


def test_a_reset_needs_a_plant_that_answers() -> None:
    world = running()
    world.tick(5, L=14.0)
    world.silent(20)
    world.order(Verb.RESET, reason="all is well")
    world.silent()
    assert world.guard.latched is not None
