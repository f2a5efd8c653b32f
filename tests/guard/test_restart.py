"""A guard that dies in any tick comes back to where it stood; what follows a failed write does not come back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import RequestAnswered, StepTaken
from homeostat.domain.events.people import AlarmRaised, PersonHeard
from homeostat.domain.events.writes import Cause, ReadBack, WriteIntended
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import FallBack
from homeostat.domain.recovery import Command
from homeostat.guard.restart.memory import Memory, OpenWrite
from tests.guard.test_hands import dies, remembered
from tests.guard.test_lapse import Sheds
from tests.guard.test_memory import remembered as told
from tests.guard.test_people import latched, tell
from tests.guard.vessel import POUR, ROUTE, RULES, World, finding, running, statuses


def stands(world: World) -> None:
    """The journal says what the guard says of itself: where it died now, it would come back to the same.

    What follows a write that is tried again comes back once the plant was read to hold it.
    """
    memory, seen = remembered(world.journal), world.seen[-1]
    nominal = tuple(s.transition.name for s in RULES.nominal if s.transition.source == seen.state)
    waiting = nominal if memory.waiting is None else tuple(name for name, _ in memory.waiting)
    again = memory.open.get(memory.writes)
    if again is not None and not again.taken and not waiting:
        waiting = tuple(name for name, _ in again.steps)
    assert (memory.state or "waiting") == seen.state
    assert waiting == tuple(s.transition.name for s in seen.rest.then)
    assert (memory.latched is None) == (seen.latched is None) and memory.mode is seen.mode
    assert memory.out == world.guard.out_of_service


def follow(world: World, ticks: int, **values: float) -> None:
    for _ in range(ticks):
        world.tick(1, **values)
        stands(world)


def asked(world: World, **rest: Any) -> None:
    world.ask(actions=ROUTE, path=("adjust", "empty"), **rest)


def request(world: World) -> None:
    asked(world)
    follow(world, 3)
    follow(world, 3, L=9.5)


def disobeyed(world: World) -> None:
    world.vessel.ignores = True
    asked(world)
    follow(world, 12)


def refused_by_the_link(world: World) -> None:
    asked(world)
    follow(world, 2)
    world.vessel.raises = True
    world.ask(name="r2")
    follow(world, 12)


def mode_changed(world: World) -> None:
    world.vessel.ignores = True
    asked(world)
    follow(world, 1)
    world.order(Verb.MODE, Mode.APPROVE.value)
    follow(world, 3)


def lease_lost(world: World) -> None:
    vessel = world.vessel
    assert isinstance(vessel, Sheds)
    vessel.ignores = vessel.tells = True
    asked(world)
    follow(world, 1)
    vessel.shed()
    follow(world, 3)


def trip(world: World) -> None:
    asked(world)
    follow(world, 2)
    follow(world, 5, L=14.0)


def trip_that_no_strategy_answers(world: World) -> None:
    asked(world)
    follow(world, 2)
    world.vessel.raises = True
    follow(world, 20, L=14.0)


def reset_and_start(world: World) -> None:
    follow(world, 5, L=14.0)
    world.order(Verb.RESET, reason="repaired")
    follow(world, 4, L=1.0)
    world.order(Verb.MODE, Mode.CLOSED_LOOP.value)
    follow(world, 2)
    world.order(Verb.START, "restart")
    follow(world, 3)
    follow(world, 4, L=8.0)


STORIES = (
    request, disobeyed, refused_by_the_link, mode_changed, lease_lost, trip, trip_that_no_strategy_answers,
    reset_and_start,
)  # fmt: skip


@pytest.mark.parametrize("story", STORIES)
def test_whenever_it_dies_the_guard_comes_back_to_where_it_stood(story: Callable[[World], None]) -> None:
    world = World(vessel=Sheds())
    follow(world, 4)
    story(world)


@pytest.mark.parametrize("story", [disobeyed, mode_changed, lease_lost])
def test_nothing_follows_a_request_that_came_to_nothing_in_this_life_or_the_next(
    story: Callable[[World], None],
) -> None:
    world = running(vessel=Sheds())
    story(world)
    assert statuses(world)[-1] in ("failed", "withdrawn") and world.seen[-1].way is None
    world.vessel.ignores = False
    world.vessel.wire.clear()
    world.tick(3, L=9.5)
    assert world.sent == [] and POUR.target != world.seen[-1].state
    world = dies(world, {})
    world.tick(3)
    assert world.sent == [] and POUR.target != world.seen[-1].state


def test_nothing_follows_a_request_that_the_link_took_and_the_plant_does_not_hold_after_a_death() -> None:
    before = running()
    before.vessel.accepts_first = 1  # the first command of two
    asked(before)
    before.tick()
    assert before.seen[-1].way is not None
    world = dies(before, {})
    world.tick(2, L=9.5)
    assert world.sent == [] and world.seen[-1].way is None
    assert [e.cause for e in world.journal.of(AlarmRaised) if e.alarm == "write:half"] == [
        "write 2 (r1) was carried out in part: not F.sp"
    ]
    before.journal.events += world.journal.events
    world = dies(before, {})
    world.tick(2)
    assert world.sent == [] and world.seen[-1].state == "running", "nor after another one"


def test_an_attempt_after_the_first_brings_the_later_steps_with_it() -> None:
    before = running()
    before.vessel.ignores = True
    asked(before)
    before.tick()
    while len(before.journal.of(WriteIntended)) < 3:
        before.tick()
    assert [e.attempt for e in before.journal.of(WriteIntended)] == [1, 1, 2]
    world = dies(before, {"T.sp": 305.0, "F.sp": 0.02})
    world.tick()
    assert world.seen[-1].way is not None and [t.name for t in world.seen[-1].way.transitions] == ["empty"]
    world.tick(2, L=9.5)
    assert world.sent == [POUR.commands]


def test_what_was_refused_before_a_death_is_refused_after_it() -> None:
    world = running()
    order = PersonCommand("o1", "Ada", Role.ENGINEER, Verb.RESET, reason="seen")
    world.guard.mailbox.put(order)
    world.tick(1)
    world.tick(4, L=14.0)
    request = world.ask()
    world.tick()
    assert statuses(world) == ["authorised", "refused"] and finding(world) == "CHK-LATCHED"
    world = dies(world, {})
    world.tick(2, L=8.0)
    heard = tell(world, Verb.RESET, reason="seen", id="o1")
    assert heard.reason == "order 'o1' was answered already" and world.guard.latched is not None
    assert tell(world, Verb.RESET, reason="seen").done and tell(world, Verb.MODE, "closed-loop").done
    world.ask(request)
    world.tick()
    assert finding(world) == "CHK-USED"


def test_an_order_that_was_refused_is_not_carried_out_when_it_comes_again() -> None:
    world = running()
    assert not tell(world, Verb.MODE, "observe", role=Role.OPERATOR, id="o1").done
    heard = tell(world, Verb.MODE, "observe", id="o1")
    assert heard.reason == "order 'o1' was answered already" and world.guard.mode is Mode.CLOSED_LOOP


def test_the_last_ten_thousand_requests_and_orders_are_known_after_a_restart() -> None:
    known = told(
        *(RequestAnswered(f"r{n}", "search", "", "authorised") for n in range(10_001)),
        *(PersonHeard(f"o{n}", "Ada", Role.OPERATOR, Verb.RESET, "", n % 2 == 0) for n in range(10_001)),
    )
    assert known.requests == tuple(f"r{n}" for n in range(1, 10_001))
    assert known.orders == tuple(f"o{n}" for n in range(1, 10_001))


def test_what_was_ordered_in_vain_in_a_trip_is_not_carried_out_by_a_later_life() -> None:
    world = latched()
    world.guard.mailbox.put(FallBack("once more"))
    world = dies(world, {})
    world.tick(3)
    assert world.sent == [] and world.guard.latched is not None


def test_the_rest_of_the_nominal_sequence_is_under_its_permissives_after_a_death() -> None:
    world = World(memory=Memory(mode=Mode.CLOSED_LOOP, state="waiting"))
    world.tick(3, L=11.5)
    assert world.sent == [] and world.seen[-1].refused is not None and "PRM-FEED" in world.seen[-1].refused
    assert not world.guard.carries
    world.tick(2, L=8.0)
    assert world.sent == [(Command("F.sp", 0.03, 0.005),)]


def test_a_write_that_was_read_before_the_death_is_not_read_again() -> None:
    world = running()
    world.ask()
    world.tick(2)
    world = dies(world, {})
    world.tick(2)
    assert world.journal.of(ReadBack) == [] and world.journal.of(StepTaken) == []
    assert world.sent == [] and world.journal.of(WriteIntended) == []


def test_a_restart_that_trips_before_it_has_read_the_plant_sends_nothing_of_before() -> None:
    open_step = OpenWrite(Cause.SEQUENCE, "start", (Command("F.sp", 0.03, 0.005),), "running", (), True)
    memory = Memory(mode=Mode.CLOSED_LOOP, state="running", waiting=(), writes=1, open={1: open_step}, last=open_step)
    world = World(memory=memory)
    world.vessel.values["L"] = 14.0
    blind = replace(world.vessel.sample(), accepted={})
    world.seen.append(world.guard.tick(blind.at_s, blind))
    world.tick(20)
    assert world.guard.latched is not None
    assert (Command("F.sp", 0.03, 0.005),) not in world.sent
