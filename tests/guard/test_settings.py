"""The guard's settings: what they are by default, and that senseless ones are refused."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

import pytest

from homeostat.domain.events.trips import LatchReset
from homeostat.domain.events.writes import WriteEnded, WriteIntended, WriteResult
from homeostat.domain.mode import Mode, Verb
from homeostat.guard.requests.seal import Sealer
from homeostat.guard.settings import GuardSettings
from tests.guard.test_recorder import Hanging
from tests.guard.vessel import KEY, World, finding, running, statuses


def settings() -> GuardSettings:
    """The settings as they are, but for a journal on a busy machine."""
    return GuardSettings(sync_s=5.0)


def times(world: World, kind: type) -> list[float]:
    return [at_s for event, at_s in world.journal.events if isinstance(event, kind)]


def test_a_write_that_hangs_is_given_up_after_3_s_and_tried_3_times() -> None:
    world = running(settings=settings())
    world.vessel.hangs = True
    world.ask()
    world.tick(30)
    assert [at_s for at_s, _ in world.vessel.wire] == [5.0, 9.0, 13.0]
    ended = [(e.result, at_s) for e, at_s in world.journal.events if isinstance(e, WriteEnded)][1:]
    assert ended == [(WriteResult.TIMED_OUT, at_s) for at_s in (8.0, 12.0, 16.0)]
    assert statuses(world)[-1] == "failed"


def test_a_step_that_failed_is_begun_again_after_10_s() -> None:
    world = World(settings=settings())
    world.vessel.raises = True
    world.tick(27)
    assert times(world, WriteIntended) == [1.0, 2.0, 3.0, 14.0, 15.0, 16.0, 27.0]  # read to have failed at 4 and 17 s


@pytest.mark.parametrize(
    ("mode", "oldest_s", "answer"), [(Mode.CLOSED_LOOP, 30.0, "accepted"), (Mode.APPROVE, 600.0, "offered")]
)
def test_a_release_check_is_good_for_30_s_and_for_600_s_where_a_person_decides(
    mode: Mode, oldest_s: float, answer: str
) -> None:
    for older_s, expected in ((0.0, answer), (1.0, "refused")):
        world = running(mode=mode, settings=settings())
        heard_s = world.vessel.now_s + 1.0
        sealer = Sealer("check", KEY, lambda: oldest_s)
        world.ask(sealer.seal(world.request(), heard_s - oldest_s - older_s))
        world.tick()
        assert statuses(world)[-1] == expected
    assert finding(world) == "CHK-AGE"
    assert f"is {oldest_s + 1.0:g} s old; 0 to {oldest_s:g} s are allowed" in world.seen[-1].answers[-1].reason


def test_one_person_may_reset() -> None:
    world = running(settings=settings())
    world.tick(4, L=14.0)
    world.tick(3, L=8.0)
    world.order(Verb.RESET, reason="repaired")
    world.tick()
    assert world.journal.of(LatchReset)[0].persons == ("Ada",) and world.guard.latched is None


def test_a_journal_is_waited_for_a_tenth_of_a_second() -> None:
    journal = Hanging()
    world = World(record=journal, settings=GuardSettings())
    journal.gate.clear()
    world.tick()
    said = {a.id: a.cause for a in world.guard.alarms}
    journal.gate.set()
    assert said["journal"] == "the journal does not answer within 0.1 s"


@pytest.mark.parametrize(
    "name", ["write_s", "again_s", "check_age_s", "person_s", "order_s", "sync_s", "lease_within_s"]
)
@pytest.mark.parametrize("seconds", [0.0, -1.0, math.nan, math.inf])
def test_a_time_that_is_none_is_refused(name: str, seconds: float) -> None:
    with pytest.raises(ValueError, match=rf"{name} is {seconds!r} s; it must be finite and more than 0 s"):
        replace(GuardSettings(), **{name: seconds})
    assert getattr(replace(GuardSettings(), **{name: 0.5}), name) == 0.5


@pytest.mark.parametrize("changed", [{"attempts": 0}, {"persons": 0}, {"persons": -1}, {"attempts": -3}])
def test_nobody_and_never_are_refused(changed: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="at least one of each is needed"):
        GuardSettings(**changed)
    assert GuardSettings(attempts=1, persons=1).attempts == 1


def test_nobody_waits_for_a_lease_for_longer_than_between_two_attempts() -> None:
    assert GuardSettings(lease_within_s=600.0).lease_within_s == 600.0
    with pytest.raises(ValueError, match=r"lease_within_s is 600\.1 s; at most 600 s are waited for"):
        GuardSettings(lease_within_s=600.1)


def test_what_is_not_set_is_as_the_manual_says() -> None:
    assert asdict(GuardSettings()) == {
        "write_s": 3.0, "attempts": 3, "again_s": 10.0, "check_age_s": 30.0, "person_s": 600.0, "order_s": 60.0,
        "persons": 1, "sync_s": 0.1, "call_s": 0.2, "lease_s": 0.5, "lease_within_s": 10.0,
    }  # fmt: skip
