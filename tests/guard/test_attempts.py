"""Attempts at a write: when each is made, how it ends, what is said of it, and how often one may arrive late."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.trips import FallbackStands
from homeostat.domain.events.writes import Cause, ReadBack, WriteEnded, WriteIntended, WriteResult
from homeostat.domain.recovery import ActionSet, Command
from homeostat.guard.settings import GuardSettings
from tests.guard.test_hands import falling
from tests.guard.test_writer import SLOW, guarded
from tests.guard.vessel import DRAIN, World, running, statuses

WARM = ActionSet((Command("T.sp", 305.0, 0.5),), "running")


def attempts(world: World, source: str = "r1") -> list[tuple[int, float]]:
    """Every attempt and its time after the first [s]."""
    made = [
        (e.attempt, at_s) for e, at_s in world.journal.events if isinstance(e, WriteIntended) and e.source == source
    ]
    return [(n, at_s - made[0][1]) for n, at_s in made]


def ends(world: World) -> list[tuple[WriteResult, str]]:
    return [(e.result, e.detail) for e in world.journal.of(WriteEnded)][1:]


@pytest.mark.parametrize(
    ("how", "times_s", "failed_s", "end"),
    [
        ("ignores", [0.0, 2.0, 4.0], 6.0, (WriteResult.ACCEPTED, "")),
        ("hangs", [0.0, 4.0, 8.0], 12.0, (WriteResult.TIMED_OUT, "no answer for 3 s")),
        ("raises", [0.0, 1.0, 2.0], 3.0, (WriteResult.FAILED, "the control system does not answer")),
    ],
)
def test_each_attempt_is_made_at_its_time(
    how: str, times_s: list[float], failed_s: float, end: tuple[WriteResult, str]
) -> None:
    world = running()
    setattr(world.vessel, how, True)
    world.ask(actions=WARM)
    world.tick()
    began_s = world.vessel.now_s
    world.tick(int(failed_s) - 1)
    assert statuses(world)[-1] == "accepted"
    world.tick()
    assert statuses(world)[-1] == "failed" and world.vessel.now_s - began_s == failed_s
    assert attempts(world) == [(n, at_s) for n, at_s in enumerate(times_s, 1)]
    assert ends(world) == [end] * 3


@pytest.mark.parametrize(("error", "said"), [(TimeoutError(), "TimeoutError"), (OSError("gone"), "gone")])
def test_what_the_link_raises_is_said_by_its_text_or_its_name(error: Exception, said: str) -> None:
    class Breaks:
        @property
        def done(self) -> bool:
            raise error

    def raises(commands: tuple[Command, ...]) -> Any:
        raise error

    for send in (raises, lambda commands: Breaks()):
        world = running()
        world.vessel.send = send  # type: ignore[method-assign]
        world.ask(actions=WARM)
        world.tick(6)
        assert ends(world) == [(WriteResult.FAILED, said)] * 3


@pytest.mark.parametrize(("error", "said"), [(TimeoutError(), "TimeoutError"), (OSError("gone"), "gone")])
def test_what_the_link_raises_at_a_step_of_a_ramp_is_said_when_the_request_has_failed(
    error: Exception, said: str
) -> None:
    world = guarded()
    world.ask(actions=SLOW)
    world.tick(4)
    stood, send = world.vessel.accepted["T.sp"], world.vessel.send

    def takes_no_step(commands: tuple[Command, ...]) -> Any:
        if commands[0].value != stood:
            raise error
        return send(commands)

    world.vessel.send = takes_no_step  # type: ignore[method-assign]
    world.tick(12)
    assert statuses(world)[-1] == "failed" and world.vessel.accepted["T.sp"] == stood
    assert [a.reason for seen in world.seen for a in seen.answers][-1].endswith(said)


def test_a_reading_as_old_as_the_write_says_nothing_of_it() -> None:
    world = running()
    world.vessel.silent = True
    world.ask(actions=WARM)
    world.tick()
    sample = replace(world.vessel.sample(), at_s=world.vessel.now_s - 1.0)
    world.seen.append(world.guard.tick(world.vessel.now_s, sample))
    assert statuses(world)[-1] == "accepted" and [e for e in world.journal.of(ReadBack) if e.write == 2] == []
    world.tick()
    assert statuses(world)[-1] == "confirmed"


def late(world: World, target: float) -> bool:
    """Whether a setpoint that comes to ``target`` behind the fallback is taken for a late write and put right."""
    world.vessel.accepted["T.sp"] = target
    world.tick(3)
    return world.vessel.accepted["T.sp"] != target


@pytest.mark.parametrize("how", ["overtaken", "failed"])
def test_a_write_may_arrive_late_as_often_as_it_was_sent_and_then_it_is_a_person(how: str) -> None:
    world = running()
    world.vessel.ignores = how == "failed"
    world.vessel.hangs = how == "overtaken"
    world.ask(actions=WARM)
    world.tick(8 if how == "failed" else 5)
    sent = len(attempts(world))
    assert sent == (3 if how == "failed" else 2)
    world.vessel.ignores = world.vessel.hangs = False
    world.tick(5, L=14.0)
    assert world.journal.of(FallbackStands)
    assert [late(world, 305.0) for _ in range(sent)] == [True] * sent
    assert not late(world, 305.0) and world.guard.out_of_service == {"T.sp"}


def test_an_attempt_before_the_one_that_was_confirmed_may_arrive_late_once() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask(actions=WARM)
    world.tick(2)
    world.vessel.ignores = False
    world.tick(3)
    assert statuses(world)[-1] == "confirmed" and len(attempts(world)) == 2
    world.ask(name="r2", actions=ActionSet((Command("T.sp", 300.0, 0.5),), "running"))
    world.tick(3)
    world.tick(5, L=14.0)
    assert late(world, 305.0) and world.vessel.accepted["T.sp"] == 300.0
    assert not late(world, 305.0)


def test_what_was_given_up_is_read_when_the_fallback_behind_it_has_come_to_its_end() -> None:
    world = falling("F.sp", "T.sp")
    world.ask(actions=WARM)
    world.tick()
    world.tick(6, L=14.0)
    number = next(e.write for e in world.journal.of(WriteIntended) if e.source == "r1")
    assert [e for e in world.journal.of(ReadBack) if e.write == number] == []
    world.vessel.accepted["F.sp"] = 0.0
    world.tick(3)
    assert [e.deviating for e in world.journal.of(ReadBack) if e.write == number] == [("T.sp",)]


def test_a_hand_on_a_tag_of_a_request_that_was_overtaken_is_noticed_while_the_fallback_is_sent() -> None:
    world = falling("F.sp")
    world.vessel.ignores = True
    world.ask(actions=WARM)
    world.tick()
    world.tick(2, L=14.0)
    world.vessel.accepted["T.sp"] = 300.0
    world.tick()
    assert world.guard.out_of_service == {"T.sp"}


def test_the_next_attempt_at_what_a_person_has_left_says_what_it_sends_and_the_digest_of_that() -> None:
    world = falling("V.man", "F.sp")
    world.tick(2, L=14.0)
    world.tick(1, L=8.0)
    world.vessel.accepted["V.man"] = 0.1
    world.tick(4)
    intended = [e for e in world.journal.of(WriteIntended) if e.cause is Cause.FALLBACK]
    kept = tuple(c for c in DRAIN.actions.commands if c.tag != "V.man")
    assert intended[0].digest == DRAIN.actions.digest
    assert {e.digest for e in intended if e.commands == kept} == {ActionSet(kept, "shut").digest}


def test_a_creep_after_a_ramp_is_noticed_once_it_is_more_than_the_tolerance() -> None:
    world = guarded()
    world.ask(actions=SLOW)
    world.tick(25)
    for target in (300.04, 300.08):
        world.vessel.accepted["T.sp"] = target
        world.tick(2)
    assert world.guard.out_of_service == {"T.sp"}


def test_a_ramp_that_is_confirmed_within_the_tolerance_is_over() -> None:
    world = guarded()
    world.ask(actions=ActionSet((Command("T.sp", 309.96, 0.01),), "running"))
    world.tick(3)
    world.ask(name="r2", actions=ActionSet((Command("F.sp", 0.02, 0.005),), "running"))
    world.tick(6)
    assert {c.value for commands in world.sent for c in commands if c.tag == "T.sp"} == {310.0}


def test_one_attempt_is_one_attempt_also_where_the_wire_was_lost() -> None:
    world = running(settings=GuardSettings(sync_s=5.0, attempts=1))
    world.vessel.raises = True
    world.tick(1, L=14.0)
    world.tick(4)
    assert attempts(world, "drain")[0] == (1, 0.0) and {n for n, _ in attempts(world, "drain")} == {1}


def test_a_target_that_the_plant_does_not_tell_is_not_known_to_hold() -> None:
    world = running()
    world.ask(actions=WARM)
    world.tick()
    sample = world.vessel.sample()
    told = {tag: target for tag, target in sample.accepted.items() if tag != "T.sp"}
    world.seen.append(world.guard.tick(sample.at_s, replace(sample, accepted=told)))
    assert statuses(world)[-1] == "accepted" and not {a for a in world.alarms if a.startswith("guard:")}
    world.tick()
    assert statuses(world)[-1] == "confirmed"


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
