"""The life of a request: what it waits for, what overtakes it, what the sequence does behind it, what is answered."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import RequestAnswered, SequenceLoaded, StepTaken
from homeostat.domain.events.writes import StepLoaded, WriteIntended
from homeostat.domain.mode import Mode, PersonCommand, Role, Side, Verb
from homeostat.domain.observation import Arm, FallBack, Trouble, Withdraw
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.request import Answer
from homeostat.guard.requests import requests as asked
from homeostat.guard.requests.permissives import refusal
from homeostat.guard.restart.memory import Memory
from tests.guard.test_people import latched, tell
from tests.guard.vessel import ADJUSTED, POUR, ROUTE, RULES, Journal, World, finding, running, statuses

pytestmark = pytest.mark.quick

BAD = ActionSet((Command("T.sp", 400.0, 0.5),), "running")
STOP = ActionSet((Command("F.sp", 0.0, 0.005),), "running")


def answers(world: World, name: str = "r1") -> list[Answer]:
    return [a for seen in world.seen for a in seen.answers if a.request == name]


def approval(world: World, name: str, verb: Verb = Verb.APPROVE, **rest: str) -> None:
    """Somebody says yes or no to request ``name`` before the next tick."""
    number = f"{verb}-{name}-{len(world.seen)}"
    world.guard.mailbox.put(PersonCommand(number, "Ada", Role.OPERATOR, verb, name, **rest))


def test_every_answer_is_journalled_with_what_was_asked_for() -> None:
    world = running()
    world.ask(actions=BAD)
    world.tick()
    why = "'T.sp' = 400 K in state 'running'; admitted are 298 to 312 K"
    assert world.journal.of(RequestAnswered) == [
        RequestAnswered("r1", "search", BAD.digest, "authorised"),
        RequestAnswered("r1", "search", BAD.digest, "refused", "CHK-RANGE", why),
    ]
    assert [(a.at_s, a.reason) for a in answers(world)] == [(5.0, ""), (5.0, why)]


def test_a_request_that_nobody_knows_is_journalled_as_such() -> None:
    world = running()
    world.guard.mailbox.put(world.request(id="x" * 501))
    world.tick()
    why = "this is no request that the plant could take: a text of at most 500 characters is needed, not"
    assert world.journal.of(RequestAnswered) == [
        RequestAnswered("x" * 500, "", "", "refused", "CHK-FORM", f"{why} 'xxxxxxxxxxxxxxxxxxxx'")
    ]


def test_the_next_request_is_written_where_the_one_before_is_refused() -> None:
    world = running()
    world.ask(name="bad", actions=BAD)
    world.ask(name="good")
    world.tick()
    assert world.sent == [ADJUSTED.commands] and world.alarms == set()
    assert statuses(world, "bad") == ["authorised", "refused"]
    assert statuses(world, "good") == ["authorised", "verified", "accepted"]
    world.tick()
    assert statuses(world, "good")[-1] == "confirmed"


def test_one_request_is_written_after_the_other() -> None:
    world = running()
    world.ask(name="first")
    world.ask(name="second", actions=STOP)
    world.tick()
    assert world.sent == [ADJUSTED.commands] and statuses(world, "second") == ["authorised"]
    world.tick(3)
    assert world.sent == [ADJUSTED.commands, STOP.commands] and statuses(world, "second")[-1] == "confirmed"


def test_only_what_was_shown_to_a_person_is_offered_and_can_be_answered() -> None:
    world = running(mode=Mode.APPROVE)
    stop = world.ask(actions=STOP)
    approval(world, "r1", digest=stop.actions.digest)
    world.tick()
    heard = tell(world, Verb.APPROVE, "r2", digest=stop.actions.digest)
    assert heard.reason == "no request 'r2' waits for a person; did you mean 'r1'?"
    assert statuses(world) == ["authorised", "offered"] and world.sent == []
    world = running(mode=Mode.APPROVE)
    stop = world.ask(actions=STOP)
    approval(world, "r1", Verb.REJECT, reason="no")
    world.tick(1, L=12.08)
    assert statuses(world) == ["authorised"] and world.guard.offered == ()
    world.tick(1, L=8.0)
    assert world.guard.offered == (stop,)
    world.tick(2)
    assert statuses(world) == ["authorised", "offered"], "it is offered once"


def test_a_person_says_no_in_their_own_words() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    assert tell(world, Verb.REJECT, "r1", reason="not now").done
    assert answers(world)[-1].finding == refusal("CHK-PERSON", "Ada: not now")
    assert answers(world)[-1].at_s == world.seen[-1].now_s and world.guard.offered == ()


def test_a_yes_to_something_else_is_none() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    assert tell(world, Verb.APPROVE, "r1", digest="0").reason == (
        "the digest is not that of request 'r1'; look at it again"
    )
    world.tick(2)
    assert world.sent == []


def test_while_a_fallback_is_latched_nothing_waits() -> None:
    world = latched()
    world.ask()
    world.tick()
    assert answers(world)[-1].finding == refusal(
        "CHK-LATCHED", f"a fallback has acted ({world.guard.latched}); a person must reset it"
    )
    world.ask()
    world.tick()
    assert finding(world) == "CHK-USED", "it was looked at, and a seal is used once"


def test_as_many_requests_wait_as_may_and_no_more() -> None:
    world = running(mode=Mode.APPROVE)
    for k in range(asked.MOST):
        world.ask(name=f"r{k}")
    world.tick()
    assert len(world.guard.offered) == asked.MOST == 50
    world.ask(name="late")
    world.tick()
    assert answers(world, "late")[-1].finding == refusal("CHK-BUSY", "50 requests wait already; ask again later")
    approval(world, "r0", Verb.REJECT, reason="no")
    world.ask(name="later")
    world.tick()
    assert statuses(world, "later") == ["authorised", "offered"]


def test_a_second_request_of_a_name_that_is_known_does_not_speak_for_the_first() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    world.ask()
    world.ask(name="other", configuration="x" * 501)
    world.tick()
    assert statuses(world) == ["authorised", "offered"] and statuses(world, "other") == ["refused"]
    assert finding(world, "r1#again") == "CHK-USED"
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick()
    world.ask()
    world.ask(name="other", configuration="x" * 501)
    world.tick()
    assert statuses(world)[-1] == "accepted" and statuses(world, "other") == ["refused"]
    assert finding(world, "r1#again") == "CHK-USED"


def test_a_request_of_before_a_restart_is_not_taken_again() -> None:
    known = tuple(f"m{k}" for k in range(asked.REMEMBERED))
    world = World(memory=Memory(mode=Mode.CLOSED_LOOP, state="running", requests=known))
    world.tick(2)
    world.ask(name="m0")
    world.tick()
    assert finding(world, "m0") == "CHK-USED"
    world.ask(name="new")  # so many are remembered, and no more
    world.tick()
    world.ask(name="m1")
    world.ask(name="m0")
    world.tick()
    assert finding(world, "m1") == "CHK-USED" and "authorised" in statuses(world, "m0")
    assert asked.REMEMBERED == 10_000


def test_its_issuer_may_give_up_what_is_not_written_yet() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    world.guard.mailbox.put(Withdraw("r1", "something better"))
    world.guard.mailbox.put(Withdraw("r9", "nobody asked for it"))
    world.tick()
    assert answers(world)[-1].finding == refusal("CHK-WITHDRAWN", "something better")
    assert answers(world)[-1].at_s == world.seen[-1].now_s and answers(world, "r9") == []
    world = running()
    world.vessel.hangs = True
    world.ask()
    world.tick()
    world.guard.mailbox.put(Withdraw("r1", "too late"))
    world.vessel.hangs = False
    world.tick(6)
    assert statuses(world)[-1] == "confirmed"


def test_what_overtakes_a_request_is_told_and_its_name_is_free_of_it() -> None:
    world = running()
    world.vessel.hangs = True
    world.ask(name="written")
    world.ask(name="waits", actions=STOP)
    world.tick()
    world.guard.mailbox.put(FallBack("x" * 1000))
    world.tick()
    for name in ("written", "waits"):
        (last,) = [a for a in answers(world, name) if a.status.final]
        assert last.finding == refusal("CHK-OVERTAKEN", "x" * 500) and last.at_s == world.seen[-1].now_s
    world.vessel.hangs = False
    world.tick(3)
    assert [a.status.value for a in answers(world, "written")][-1] == "withdrawn", "nothing more is said of it"
    world.ask(name="written")
    world.tick()
    assert finding(world, "written") == "CHK-USED"


def test_a_request_that_was_overtaken_does_not_keep_the_deadline_from_acting() -> None:
    world = running()
    world.vessel.hangs = True
    world.guard.mailbox.put(Arm((), 10.0))
    world.ask()
    world.tick()
    assert tell(world, Verb.MODE, "approve").done and statuses(world)[-1] == "withdrawn"
    world.vessel.hangs = False
    world.tick(5)
    assert world.guard.latched == "recovery has not acted in the time that physics leaves"


def test_nothing_is_released_while_the_journal_fails() -> None:
    world = running()
    world.journal.error = OSError("disk full")
    world.guard.mailbox.put(Trouble("recovery", "something to journal"))
    world.tick()
    world.ask()
    world.tick()
    world.journal.error = None
    assert answers(world)[-1].finding == refusal("CHK-JOURNAL", "nothing is released: the journal failed: disk full")
    assert world.sent == []


class Full(Journal):
    """A journal that has room for everything but the intention of a request."""

    def record(self, event: Any, at_s: float) -> None:
        if isinstance(event, WriteIntended) and event.cause.value == "request":
            raise OSError("disk full")
        super().record(event, at_s)


def test_a_request_whose_intention_cannot_be_journalled_has_failed() -> None:
    world = running(record=Full())
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick()
    assert statuses(world) == ["authorised", "verified", "accepted", "failed"] and world.sent == []
    assert answers(world)[-1].finding == refusal(
        "CHK-JOURNAL", "the intention of request 'r1' could not be journalled: the journal failed: disk full"
    )
    world.ask(actions=STOP)
    world.tick()
    assert finding(world) == "CHK-USED" and answers(world, "r1#again") == []


def loads(world: World) -> list[SequenceLoaded]:
    return [e for e in world.journal.of(SequenceLoaded) if e.source == "r1"]


LOADED = SequenceLoaded("r1", "running", (StepLoaded("empty", POUR.commands),), False)


def test_the_sequence_goes_on_behind_a_request_once_the_link_has_taken_it() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick()
    assert loads(world) == [LOADED] and world.seen[-1].way is not None
    assert [t.name for t in world.seen[-1].way.transitions] == ["empty"]
    world.vessel.ignores = False
    world.tick(8)
    assert statuses(world)[-1] == "confirmed" and loads(world) == [LOADED]


def test_the_sequence_goes_on_behind_a_request_that_the_plant_holds_though_the_link_is_silent() -> None:
    world = running()
    world.vessel.silent = True
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick()
    assert loads(world) == []
    world.tick()
    assert loads(world) == [LOADED] and statuses(world)[-1] == "confirmed"
    world.tick(2)
    assert loads(world) == [LOADED] and world.alarms == set()


def test_nothing_follows_behind_what_the_plant_does_not_obey() -> None:
    world = running()
    world.vessel.ignores = True
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick(12)
    assert answers(world)[-1].finding == refusal(
        "CHK-OBEYED", "the plant does not hold every target after every attempt"
    )
    world.vessel.ignores = False
    world.tick(3, L=9.5)
    assert world.journal.of(StepTaken)[-1:] != [StepTaken("empty", "emptying")] and world.seen[-1].way is None


def test_a_request_that_the_link_refuses_leaves_the_sequence_as_it_was() -> None:
    world = World()
    world.tick(1, L=1.0)
    before = world.seen[-1].way
    world = running()
    world.ask(actions=ROUTE, path=("adjust", "empty"))
    world.tick(2)
    assert statuses(world)[-1] == "confirmed"
    world.vessel.raises = True
    world.ask(name="r2", actions=STOP)
    world.tick(12)
    assert answers(world, "r2")[-1].finding == refusal("CHK-OBEYED", "the control system does not answer")
    assert world.seen[-1].way is not None and before is not None
    assert [t.name for t in world.seen[-1].way.transitions] == ["empty"], "what was released before goes on"


def test_in_a_mode_that_does_not_write_a_request_is_shown_once_it_passes() -> None:
    world = running(mode=Mode.ADVISE, rules=replace(RULES, recipe=Side.PLANT))
    world.ask(name="bad", actions=BAD)
    world.ask(name="good")
    world.tick()
    assert statuses(world, "bad") == ["authorised", "refused"] and statuses(world, "good") == ["authorised", "advised"]
    assert answers(world, "good")[-1].at_s == world.seen[-1].now_s and world.sent == []


@pytest.mark.parametrize("mode", [Mode.APPROVE, Mode.CLOSED_LOOP])
def test_a_seal_is_judged_again_when_it_is_written(mode: Mode) -> None:
    world = running(mode=mode)
    world.ask(actions=STOP)
    world.tick(1, L=12.08)
    world.tick(1, L=8.0)
    assert statuses(world)[1] == ("offered" if mode is Mode.APPROVE else "verified")


def test_a_request_that_was_not_written_does_not_put_off_the_deadline() -> None:
    world = running(record=Full())
    world.guard.mailbox.put(Arm((), 7.0))
    world.ask()
    world.tick(3)
    assert statuses(world)[-1] == "failed"
    assert world.guard.latched == "recovery has not acted in the time that physics leaves"


def test_a_request_that_writes_nothing_now_is_released_before_the_deadline_all_the_same() -> None:
    world = running()
    world.guard.mailbox.put(Arm((), 7.0))
    world.ask(actions=ActionSet((), "running", (POUR,)), path=("adjust", "empty"))
    world.tick(5)
    assert statuses(world)[-1] == "confirmed" and world.guard.latched is None


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
