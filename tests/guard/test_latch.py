"""The fallback and its latch: each strategy checked when it acts, another limit, later steps, clocks and links."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import FallbackActivated, FallbackSkipped, FallbackStands, Shed, Tripped
from homeostat.domain.observation import Arm
from homeostat.domain.plant.rules import TripRule
from homeostat.domain.recovery import ActionSet, Command, Effect, FallbackStrategy, Step
from homeostat.guard.settings import GuardSettings
from tests.guard.vessel import CLOSE, DRAIN, MACHINE, RULES, TRIPS, Vessel, World, awaited, running

pytestmark = pytest.mark.quick


def acted(world: World) -> list[str]:
    return [e.strategy for e in world.journal.of(FallbackActivated)]


def with_fallbacks(*strategies: FallbackStrategy) -> Any:
    return replace(RULES, fallbacks=strategies)


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (Command("Q.cmd", 0.0, None), "'Q.cmd' is not a tag that may be written"),
        (Command("T", 300.0, None), "'T' is not a tag that may be written"),
        (Command("T.sp", 300.0, 0.5), "'T.sp' may not be commanded in state 'shut'"),
        (Command("F.sp", 0.01, 0.005), "admitted are 0 to 0 L/s"),
        (Command("F.sp", 0.0, 0.006), "ramps at 0.006 L/s/s; limit 0.005 L/s/s"),
        (Command("F.sp", 0.0, None), "ramps at inf L/s/s"),
        (Command("F.sp", None, None), "no automatic mode"),
    ],
)
def test_a_strategy_that_fails_a_check_when_it_acts_gives_way_to_the_next(command: Command, why: str) -> None:
    wrong = FallbackStrategy("wrong", ActionSet((command,), "shut"))
    world = running(rules=with_fallbacks(wrong, CLOSE))
    world.tick(1, L=14.0)
    assert world.sent == [CLOSE.actions.commands] and acted(world) == ["close"]
    skipped = world.journal.of(FallbackSkipped)[0]
    assert skipped.strategy == "wrong" and why in skipped.reason and "fallback:wrong" in world.alarms


def test_a_strategy_that_cannot_even_be_checked_gives_way() -> None:
    odd = FallbackStrategy("odd", ActionSet((Command("F.sp", 0.0, 0.005),), "nowhere"))
    world = running(rules=with_fallbacks(odd, CLOSE))
    world.tick(1, L=14.0)
    assert world.sent == [CLOSE.actions.commands]


def test_the_later_steps_of_a_strategy_are_checked_with_it() -> None:
    late = Step(MACHINE.transitions[5], (Command("T.sp", 999.0, 0.5),))
    odd = FallbackStrategy("odd", replace(CLOSE.actions, then=(late,)))
    world = running(rules=with_fallbacks(odd, CLOSE))
    world.tick(1, L=14.0)
    assert acted(world) == ["close"]


def test_a_permissive_forbids_a_strategy_unless_its_row_waives_it() -> None:
    dry = FallbackStrategy("dry", ActionSet((Command("X.cmd", 0.0, None),), "shut"))
    world = running(rules=with_fallbacks(dry, CLOSE))
    world.tick(1, L=14.0)
    assert acted(world) == ["close"]
    world = running(
        rules=with_fallbacks(replace(dry, waived={"PRM-OPEN": "it is short", "PRM-FEED": "so is this"}), CLOSE)
    )
    world.tick(1, L=14.0)
    assert acted(world) == ["dry"]


def test_the_reading_that_failed_does_not_forbid_the_fallback_that_its_failure_calls_for() -> None:
    world = running()
    world.tick(8, L=math.nan)  # PRM-FEED reads L, but holds for a feed of zero whatever L is
    assert acted(world) == ["drain"] and math.isnan(world.journal.of(Tripped)[0].margin)
    assert world.journal.of(FallbackStands)


def test_another_limit_has_the_next_strategy_act_and_the_last_one_stays() -> None:
    world = running()
    world.tick(4, L=14.0)
    assert acted(world) == ["drain"] and world.journal.of(FallbackStands)
    world.tick(12, T=320.0)
    assert acted(world) == ["drain", "close"]
    assert world.sent == [DRAIN.actions.commands, CLOSE.actions.commands]
    assert [e.strategy for e in world.journal.of(FallbackStands)] == ["drain", "close"]
    world.tick(10, L=8.0)
    world.tick(4, L=14.0)
    assert acted(world) == ["drain", "close"] and world.vessel.given_back == 0 and not world.journal.of(Shed)
    assert [e.limit for e in world.journal.of(Tripped)] == ["LIM-FULL", "LIM-HOT", "LIM-FULL"]


def test_another_limit_that_is_violated_while_a_fallback_is_on_its_way_is_not_forgotten() -> None:
    world = running()
    world.vessel.ignores = True
    world.tick(1, L=14.0)
    world.vessel.values["T"] = 330.0
    world.tick(7)
    world.vessel.ignores = False
    world.tick(12)
    assert "LIM-HOT" in [e.limit for e in world.journal.of(Tripped)]
    assert acted(world)[:2] == ["drain", "close"]


def test_noise_about_a_limit_makes_one_trip() -> None:
    world = running()
    for n in range(60):
        world.tick(1, L=12.6 + 0.5 * (n % 2) - 0.25)
    assert len(world.journal.of(Tripped)) == 1 and acted(world) == ["drain"]


def test_a_later_step_leaves_a_persons_tag_alone_unless_its_row_says_so() -> None:
    machine = replace(MACHINE, transitions=(*MACHINE.transitions, awaited("cool", "shut", "emptying", "L <= 5")))
    cool = Step(machine.transitions[-1], (Command("F.sp", 0.0, 0.005), Command("V.man", 0.5, 0.2)))
    strategy = replace(CLOSE, actions=replace(CLOSE.actions, then=(cool,)))
    for forced, sent in ((frozenset[str](), cool.commands[:1]), (frozenset({"V.man"}), cool.commands)):
        world = running(rules=replace(RULES, machine=machine, fallbacks=(replace(strategy, forced=forced),)))
        world.tick(3, L=14.0)
        world.vessel.accepted["V.man"] = 0.3
        world.tick(2)
        world.tick(4, L=4.0)
        assert world.sent == [CLOSE.actions.commands, sent]
        assert world.seen[-1].state == "emptying"


def test_a_lost_lease_is_taken_again_by_a_fallback() -> None:
    class Lost(Vessel):
        lost = False

        def take(self) -> Vessel:
            self.lost = False
            return super().take()

        def send(self, commands: tuple[Command, ...]) -> Any:
            if self.lost:
                raise PermissionError("the lease is over")
            return super().send(commands)

    vessel = Lost()
    world = running(vessel=vessel)
    vessel.lost = True
    world.tick(3, L=14.0)
    assert acted(world) == ["drain"] and world.sent == [DRAIN.actions.commands]


def test_a_broken_limit_keeps_no_other_from_tripping() -> None:
    ahead = replace(RULES.limits.hard[0], name="LIM-ODD", formula=None)  # type: ignore[arg-type]
    limits = replace(RULES.limits, limits=(ahead, *RULES.limits.limits))
    world = World(rules=replace(RULES, limits=limits, trips=TRIPS | {"LIM-ODD": TripRule("LIM-ODD", 1.0, 1e9)}))
    world.tick(4)
    world.tick(3, L=14.0)
    assert acted(world) == ["drain"]


@pytest.mark.parametrize("now_s", [math.nan, math.inf, 4.0, -1.0, "5", None])
def test_a_clock_that_stands_is_an_alarm_and_the_guard_goes_on(now_s: Any) -> None:
    world = running()
    world.vessel.hangs = True
    world.vessel.values["L"] = 14.0
    sample = world.vessel.sample()
    world.seen.append(world.guard.tick(now_s, sample))
    assert "clock" in world.alarms
    for _ in range(45):
        world.seen.append(world.guard.tick(now_s, None))
    assert len(world.sent) >= 2  # blindness trips, and the hung fallback is tried again, although the clock stands
    world.vessel.now_s = 100.0
    world.tick(2)  # a leap is believed once the clock goes on from there
    assert "clock" not in world.alarms and world.seen[-1].now_s == 102.0


def test_one_repeated_time_is_caught_up() -> None:
    world = running()
    seen = world.guard.tick(4.0, None)
    assert seen.now_s == 4.5
    assert world.tick().now_s == 5.0 and "clock" not in world.alarms


def test_samples_that_stop_are_an_alarm_then_blindness_then_a_trip() -> None:
    world = running()
    world.silent(5)
    assert "link" in world.alarms and world.guard.latched is None
    world.silent(8)
    assert world.guard.latched is not None and "could not be judged" in world.guard.latched
    world.vessel.ignores = False
    world.tick(3)
    assert "link" not in world.alarms and world.journal.of(FallbackStands)


def test_a_stage_that_breaks_is_an_alarm_that_returns_and_the_other_stages_go_on() -> None:
    world = running()
    steps = world.guard._steps
    world.guard._steps = None  # type: ignore[assignment]
    world.tick()
    assert "guard:decide" in world.alarms
    world.tick(1, L=14.0)
    world.guard._steps = steps
    world.tick(2)
    assert world.sent == [DRAIN.actions.commands] and "guard:decide" not in world.alarms


def test_a_heartbeat_that_fails_is_an_alarm_that_returns() -> None:
    world = running()
    beat = world.vessel.beat

    def broken() -> None:
        raise TimeoutError

    world.vessel.beat = broken  # type: ignore[method-assign]
    world.tick()
    assert "heartbeat" in world.alarms
    cause = next(e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "heartbeat")
    assert cause == "the heartbeat is not taken: TimeoutError"
    world.vessel.beat = beat  # type: ignore[method-assign]
    world.tick()
    assert "heartbeat" not in world.alarms


def test_a_plant_that_gives_no_lease_is_an_alarm_and_the_fallback_tries_again() -> None:
    class Keeps(Vessel):
        keeps = False

        def take(self) -> Vessel:
            if self.keeps:
                raise PermissionError("somebody else has it")
            return super().take()

    vessel = Keeps()
    world = running(vessel=vessel, settings=GuardSettings(again_s=5.0, sync_s=5.0))
    vessel.ignores = True
    world.tick(12, L=14.0)
    vessel.keeps = True
    world.tick(12)
    assert "lease" in world.alarms or "shed" in world.alarms
    vessel.keeps = vessel.ignores = False
    world.tick(20)
    assert world.guard._latch.standing and "shed" not in world.alarms


SERVING = (
    replace(CLOSE, name="close", serves={"LIM-FULL": Effect(60.0)}),
    replace(DRAIN, name="drain", serves={"LIM-HOT": Effect(60.0)}),
)


@pytest.mark.parametrize("order", [SERVING, SERVING[::-1]])
@pytest.mark.parametrize(("tag", "begins", "step", "expected"), [("L", 14.0, 0.0, "close"), ("T", 305.0, 0.3, "drain")])
def test_without_an_armed_strategy_one_that_brings_the_violated_limit_back_acts_first(
    order: tuple[FallbackStrategy, ...], tag: str, begins: float, step: float, expected: str
) -> None:
    world = running(rules=with_fallbacks(*order))
    for k in range(60):
        world.tick(1, **{tag: begins + step * k})
    assert acted(world)[:1] == [expected]


def test_the_armed_strategy_acts_first_whatever_is_violated() -> None:
    world = running(rules=with_fallbacks(*SERVING))
    world.guard.mailbox.put(Arm(("drain",), None))
    world.tick(1)
    world.tick(3, L=14.0)
    assert acted(world)[:1] == ["drain"]
