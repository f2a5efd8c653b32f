"""The time by which recovery must have acted only comes nearer, until something is released, decided or done."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from homeostat.domain.events.guard import Armed
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import FallbackActivated, Latched
from homeostat.domain.events.writes import Cause, ReadBack
from homeostat.domain.mode import Mode, Verb
from homeostat.domain.observation import Arm, FallBack, NoAction
from homeostat.guard.settings import GuardSettings
from tests.guard.test_hands import dies
from tests.guard.test_memory import intended, remembered
from tests.guard.test_people import tell
from tests.guard.vessel import ADJUSTED, World, running, statuses

LATE = "recovery has not acted in the time that physics leaves"


def armed(*by_s: float | None, world: World | None = None) -> World:
    """A vessel that runs, at 4 s, for which recovery has named these times, one per tick."""
    world = world or running()
    for at_s in by_s:
        world.guard.mailbox.put(Arm(("drain",), at_s))
        world.tick()
    return world


def acted_s(world: World) -> list[float]:
    """When fallbacks were activated [s]."""
    return [at_s for e, at_s in world.journal.events if isinstance(e, Latched)]


def named_s(world: World) -> list[float | None]:
    """Every time that the guard says is armed [s]."""
    return [e.act_by_s for e in world.journal.of(Armed)]


@pytest.mark.parametrize(
    ("by_s", "stands_s"),
    [
        ((20.0, 30.0), [20.0, 20.0]), ((20.0, 15.0), [20.0, 15.0]), ((20.0, None), [20.0, 20.0]),
        ((20.0, 15.0, 20.0, None, 16.0), [20.0, 15.0, 15.0, 15.0, 15.0]), ((None, 20.0), [None, 20.0]),
    ],
)  # fmt: skip
def test_who_arms_again_does_not_put_it_off(by_s: tuple[float | None, ...], stands_s: list[float | None]) -> None:
    world = armed(*by_s)
    assert named_s(world) == stands_s and world.seen[-1].act_by_s == stands_s[-1]
    world.tick(30)
    assert acted_s(world) == [stands_s[-1]] and world.guard.latched == LATE and world.seen[-1].act_by_s is None
    assert all(seen.act_by_s is None for seen in world.seen if seen.latched), "it ends where the fallback acts"


@pytest.mark.parametrize(("anew_s", "stands_s"), [(30.0, 30.0), (12.0, 12.0), (None, None)])
def test_a_wait_that_is_over_says_anew_how_long_there_is(anew_s: float | None, stands_s: float | None) -> None:
    world = armed(20.0)
    world.guard.mailbox.put(Arm(("drain",), anew_s, anew=True))
    world.tick(30)
    assert named_s(world) == [20.0, stands_s]
    assert acted_s(world) == [] if stands_s is None else acted_s(world) == [stands_s]


@pytest.mark.parametrize("anew", ["yes", 1, None])
def test_only_who_says_so_puts_it_off(anew: object) -> None:
    world = armed(20.0)
    world.guard.mailbox.put(Arm(("drain",), 30.0, anew=anew))  # type: ignore[arg-type]
    world.tick(20)
    assert acted_s(world) == [20.0]


def test_a_time_that_has_come_is_not_put_off() -> None:
    world = armed(8.0)
    world.tick(2)
    world.guard.mailbox.put(Arm(("drain",), 60.0, anew=True))
    world.tick(3)
    assert acted_s(world) == [8.0]


def test_the_ranking_is_the_last_one_whatever_the_time() -> None:
    world = armed(20.0)
    world.guard.mailbox.put(Arm(("close",), 30.0))
    world.tick(20)
    assert [e.strategy for e in world.journal.of(FallbackActivated)] == ["close"] and acted_s(world) == [20.0]


def test_a_decision_that_nothing_is_to_be_done_ends_it_and_is_journalled_once() -> None:
    world = armed(20.0)
    for _ in range(2):
        world.guard.mailbox.put(NoAction())
        world.tick(1)
    world.tick(30)
    assert named_s(world) == [20.0, None] and world.guard.latched is None
    assert armed(50.0, 60.0, world=world).seen[-1].act_by_s == 50.0, "what comes after it counts anew"


def released(world: World) -> None:
    world.ask()
    world.tick(3)
    assert statuses(world)[-1] == "confirmed"


def fell_back(world: World) -> None:
    world.guard.mailbox.put(FallBack("nothing to release"))
    world.tick(8)
    assert tell(world, Verb.RESET, reason="it was dust").done


def tripped(world: World) -> None:
    world.tick(6, L=14.0)
    assert world.guard.latched is not None
    world.tick(10, L=8.0)
    assert tell(world, Verb.RESET, reason="it was dust").done


@pytest.mark.parametrize("what", [released, fell_back, tripped])
def test_a_release_and_a_fallback_end_it_and_a_later_one_may_be_named(what: Callable[[World], None]) -> None:
    world = armed(60.0)
    what(world)
    assert world.seen[-1].act_by_s is None
    assert armed(90.0, world=world).seen[-1].act_by_s == 90.0
    world.tick(50)
    assert 60.0 not in acted_s(world)


def test_a_request_that_failed_or_was_withdrawn_does_not_end_it() -> None:
    world = armed(12.0)
    world.vessel.ignores = True
    world.ask()
    world.tick(2)
    assert tell(world, Verb.MODE, "approve").done and statuses(world)[-1] == "withdrawn"
    armed(40.0, world=world).tick(10)
    assert acted_s(world) == [12.0]


def test_where_nobody_writes_it_ends_with_its_alarm_and_the_journal_says_so() -> None:
    world = running(mode=Mode.OBSERVE)
    armed(8.0, world=world).tick(6)
    assert named_s(world) == [8.0, None] and world.seen[-1].act_by_s is None
    assert "fallback wanted" in world.alarms
    assert [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "fallback wanted"] == [LATE]


# --- after a death ----------------------------------------------------------------------------------------------


def test_it_is_remembered_until_something_ends_it() -> None:
    by = Armed(("drain",), 20.0)
    write, held = intended(3, Cause.REQUEST, "r1"), ReadBack(3, ("T.sp", "F.sp"))
    assert remembered(by).act_by_s == remembered(by, write).act_by_s == 20.0
    assert remembered(by, write, ReadBack(3, ("T.sp",), ("F.sp",))).act_by_s == 20.0
    for ends in ((Armed(("drain",), None),), (write, held), (Latched("hot"),), (intended(4, Cause.FALLBACK, "drain"),)):
        assert remembered(by, *ends).act_by_s is None


def test_a_guard_that_dies_acts_at_the_same_time() -> None:
    world = dies(armed(20.0), {})
    armed(40.0, world=world).tick(20)
    assert acted_s(world) == [20.0]


def test_a_release_that_the_dead_guard_was_writing_has_met_it_where_the_plant_holds_it() -> None:
    world = armed(8.0)
    world.vessel.silent = True
    world.ask()
    world.tick(1)
    assert world.sent == [ADJUSTED.commands] and statuses(world)[-1] == "accepted"
    world = dies(world, {})
    world.vessel.silent = False
    world.tick(20)
    assert acted_s(world) == [] and world.guard.latched is None


def test_a_release_that_never_arrived_has_not_met_it() -> None:
    world = armed(8.0)
    world.vessel.hangs = True
    world.ask()
    world.tick(1)
    world = dies(world, {})
    world.vessel.hangs = False
    world.tick(20)
    assert acted_s(world) == [8.0]


@pytest.mark.parametrize(("by_s", "at_s"), [(5.5, 10.0), (9.5, 10.0), (11.0, 11.0)])
def test_a_guard_that_reads_nothing_after_a_restart_acts_once_it_waits_no_more_for_what_was_in_flight(
    by_s: float, at_s: float
) -> None:
    """The guard comes back at 6 s; for four seconds a release that was being written may stand."""
    world = dies(armed(by_s), {}, settings=GuardSettings(again_s=4.0, sync_s=5.0))
    world.silent(5 if at_s == 10.0 else 6)
    assert world.seen[0].now_s == 6.0 and acted_s(world) == [at_s] and world.guard.latched == LATE
