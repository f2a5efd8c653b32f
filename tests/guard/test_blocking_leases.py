"""Links that block, and leases that are lost: what asks whether the lease lasts may hang as well."""

from __future__ import annotations

import time
from typing import Any

from homeostat.domain.events.trips import FallbackStands
from homeostat.domain.events.writes import LeaseLost
from homeostat.domain.recovery import Command
from homeostat.guard.writing import bounded
from tests.guard.test_blocking_links import QUICK, Blocked, timed, until
from tests.guard.vessel import DRAIN, World, running, statuses


class Telling(Blocked):
    """A vessel that says whether the lease is over, after a while, and whose writes may be refused at once."""

    over = refuses = False
    slow_s = 0.0

    @property
    def void(self) -> bool:
        self._wait("void")
        time.sleep(self.slow_s)
        return self.over

    def take(self) -> Any:
        found = super().take()
        self.over = False
        return found

    def send(self, commands: tuple[Command, ...]) -> Any:
        if self.refuses:
            raise ConnectionError("not connected")
        return super().send(commands)


def telling(*calls: str) -> tuple[World, Telling]:
    """A vessel that runs, and whose calls begin to block now."""
    vessel = Telling()
    world = running(vessel=vessel, settings=QUICK)
    world.tick(10)
    vessel.wire.clear()
    vessel.called.clear()
    vessel.blocked = set(calls)
    return world, vessel


def test_where_the_question_whether_the_lease_lasts_hangs_the_guard_writes_and_falls_back_as_before() -> None:
    world, vessel = telling("void")
    world.ask()
    timed(world, 3)
    assert statuses(world)[-1] == "confirmed" and world.journal.of(LeaseLost) == []
    timed(world, 4, L=14.0)
    assert vessel.wire[-1][1] == DRAIN.actions.commands and len(world.journal.of(FallbackStands)) == 1
    assert vessel.called.count("void") == 1, "one question at a time"
    vessel.let_go.set()


def test_a_link_that_always_says_too_late_that_the_lease_is_over_is_heard_at_the_next_tick() -> None:
    world, vessel = telling()
    vessel.slow_s, vessel.over = 3.0 * QUICK.call_s, True
    timed(world)
    assert world.journal.of(LeaseLost) == []
    until(lambda: not world.guard._parts.tenure._lease._questions[0].busy)  # type: ignore[union-attr]
    timed(world)
    assert [e.reason for e in world.journal.of(LeaseLost)] == ["the plant says that the lease is over"]


def test_a_lease_that_is_over_stays_over_and_nobody_asks_again() -> None:
    vessel = Telling()
    wire = bounded.BoundedLease(vessel, QUICK).take()
    assert wire.void is False
    vessel.over = True
    assert wire.void is True
    vessel.over = False
    vessel.called.clear()
    assert wire.void is True and vessel.called == []


def test_questions_that_hang_do_not_pile_up_however_often_the_lease_is_taken() -> None:
    world, vessel = telling("void")
    vessel.refuses = True
    timed(world, 40, L=14.0)
    assert vessel.called.count("take") >= 10 and vessel.called.count("void") == 8
    vessel.refuses = False
    timed(world, 30)
    assert vessel.accepted["X.cmd"] == 0.0 and world.journal.of(FallbackStands)
    vessel.let_go.set()
