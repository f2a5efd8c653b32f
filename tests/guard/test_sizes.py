"""Whoever sends too much: what is too large is refused unread, a tick looks at so many requests, all are answered."""

from __future__ import annotations

import gc
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.events.guard import RequestAnswered
from homeostat.domain.events.people import AlarmRaised, PersonHeard
from homeostat.domain.mode import Mode, PersonCommand, Role, Verb
from homeostat.domain.observation import Trouble, Withdraw
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.request import Request
from homeostat.guard import mailbox as boxes
from homeostat.guard.mailbox import Mailbox
from homeostat.guard.requests import requests as asked
from homeostat.guard.requests import verification
from homeostat.guard.requests.verification import Unfit, mapped
from tests.guard.spoils import forged
from tests.guard.vessel import ADJUSTED, MACHINE, RULES, World, finding, running, statuses

EMPTY = MACHINE.transitions[2]


def heap(count: int, letters: int = 4) -> tuple[Command, ...]:
    """So many commands to tags with names of so many letters."""
    return tuple(Command(f"{k:0{letters}d}", 1.0, 1.0) for k in range(count))


def objection(request: Any) -> str:
    """Why the guard can make nothing of ``request``; empty where it can."""
    try:
        mapped(request, RULES)
    except Unfit as unfit:
        assert unfit.finding.criterion == "CHK-FORM"
        return unfit.finding.message.removeprefix("this is no request that the plant could take: ")
    return ""


def asking(**changed: Any) -> Request:
    return forged(SAMPLE, **changed)  # type: ignore[no-any-return]


def commanding(*parts: int) -> Request:
    """A request whose parts have so many commands, the first at once."""
    first, *later = (heap(count) for count in parts)
    then = tuple(Step(EMPTY, commands) for commands in later)
    actions = forged(ADJUSTED, commands=first, then=then)
    return asking(actions=actions, path=("adjust", *["empty"] * len(then)))


SAMPLE = running().request()


def test_a_part_has_as_many_commands_as_it_may_and_no_more() -> None:
    assert objection(commanding(100)) == ""
    assert objection(commanding(101)) == "a tuple has 101 items; at most 100 are looked at"
    assert objection(commanding(1, 101)) == "a tuple has 101 items; at most 100 are looked at"


def test_all_parts_together_have_as_many_commands_as_they_may_and_no_more() -> None:
    assert "looked at" not in objection(commanding(100, 100))
    assert objection(commanding(100, 99, 2)) == "it has 201 commands; at most 200 are looked at"
    assert objection(commanding(1, 100, 100)) == "it has 201 commands; at most 200 are looked at"


def test_a_path_and_its_steps_are_as_long_as_they_may_be_and_no_longer() -> None:
    assert "looked at" not in objection(asking(path=("adjust",) * 100))
    assert objection(asking(path=("adjust",) * 101)) == "a tuple has 101 items; at most 100 are looked at"
    assert objection(commanding(1, *[0] * 101)) == "a tuple has 102 items; at most 100 are looked at"
    steps = (Step(EMPTY, ()),) * 101
    assert "101 items" in objection(asking(actions=forged(ADJUSTED, then=steps)))


MOST = {"tag": 200}
TEXTS: dict[str, Callable[[str], Request]] = {
    "id": lambda text: asking(id=text),
    "proposer": lambda text: asking(proposer=text),
    "state": lambda text: asking(state=text),
    "diagnosis": lambda text: asking(diagnosis=text),
    "configuration": lambda text: asking(configuration=text),
    "issuer": lambda text: asking(seal=replace(SAMPLE.seal, issuer=text)),
    "nonce": lambda text: asking(seal=replace(SAMPLE.seal, nonce=text)),
    "mac": lambda text: asking(seal=replace(SAMPLE.seal, mac=text)),
    "tag": lambda text: asking(actions=ActionSet((Command(text, 1.0, 1.0),), "running")),
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_is_as_long_as_it_may_be_and_no_longer(name: str) -> None:
    most = MOST.get(name, 500)
    assert objection(TEXTS[name]("x" * most)) == ""
    assert objection(TEXTS[name]("x" * (most + 1))) == (
        f"a text of at most {most} characters is needed, not 'xxxxxxxxxxxxxxxxxxxx'"
    )


@pytest.mark.parametrize(
    "made",
    [
        lambda text: asking(path=(text,)),
        lambda text: asking(actions=forged(ADJUSTED, target=text)),
        lambda text: asking(
            actions=forged(ADJUSTED, then=(Step(forged(EMPTY, name=text), ()),)), path=("adjust", "empty")
        ),
    ],
    ids=["a transition of the path", "the target", "the transition of a step"],
)
def test_a_name_that_is_too_long_is_compared_with_nothing(made: Callable[[str], Request]) -> None:
    assert "500 characters" not in objection(made("x" * 500)) != ""
    assert "500 characters" in objection(made("x" * 501))


class Shouts(str):
    """A text that is none: it does whatever its maker likes."""


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"path": ["adjust"]}, "a tuple is needed, not list"),
        ({"path": None}, "a tuple is needed, not NoneType"),
        ({"state": 7}, "a text of at most 500 characters is needed, not 'int'"),
        ({"state": Shouts("running")}, "a text of at most 500 characters is needed, not 'running'"),
        ({"seal": replace(SAMPLE.seal, checked_s=10**400)}, "int too large to convert to float"),
        ({"seal": replace(SAMPLE.seal, expires_s=10**5000)}, "int too large to convert to float"),
        ({"seal": replace(SAMPLE.seal, checked_s=True)}, "a number is needed, not bool"),
        ({"seal": replace(SAMPLE.seal, checked_s="now")}, "a number is needed, not str"),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_text_and_no_number_is_told_by_its_kind(changed: dict[str, Any], why: str) -> None:
    assert objection(asking(**changed)) == why


def test_what_is_said_of_a_request_is_no_longer_than_it_may_be() -> None:
    class Long:
        def __getattr__(self, name: str) -> object:
            raise RuntimeError("x" * 10_000)

    assert objection(asking(actions=Long())) == "x" * 500


def delivered(made: Callable[[str], Any], count: int = 1000) -> tuple[World, float]:
    """A world into which so many requests were put at once, and the time that the next tick worked on them [s]."""
    world = running()
    for request in [made(f"r{k}") for k in range(count)]:
        world.guard.mailbox.put(request)
    sample = world.vessel.sample()
    gc.disable()  # what else the process holds says nothing of the guard
    try:
        began_s = time.thread_time()
        world.seen.append(world.guard.tick(sample.at_s, sample))
        return world, time.thread_time() - began_s
    finally:
        gc.enable()


LONG, OBJECT = "x" * 1_000_000, [1] * 1_000_000
HEAP, STEPS = heap(100, 200), tuple(Step(EMPTY, heap(100)) for _ in range(99))
FLOODS: dict[str, Callable[[str], Any]] = {
    "as many commands as may be": lambda name: asking(
        id=name, actions=forged(ADJUSTED, commands=HEAP, then=(Step(EMPTY, HEAP),)), path=("adjust", "empty")
    ),
    "steps": lambda name: asking(id=name, actions=forged(ADJUSTED, then=STEPS), path=("adjust", *["empty"] * 99)),
    "transitions": lambda name: asking(id=name, path=("adjust",) * 100),
    "texts": lambda name: asking(id=LONG, path=(LONG,)),
    "objects": lambda name: asking(id=OBJECT, state=OBJECT),
}


@pytest.mark.parametrize("made", FLOODS.values(), ids=FLOODS)
def test_a_thousand_requests_at_once_are_answered_within_the_tick(made: Callable[[str], Any]) -> None:
    """Not much work beyond that of requests of usual size: what is not bounded takes hundreds of times as much."""
    world, took_s = delivered(made)
    _, usual_s = delivered(lambda name: asking(id=name))
    assert took_s < 40.0 * usual_s
    answers = world.seen[-1].answers
    assert len(answers) == 1000 == len(world.journal.of(RequestAnswered))
    found = Counter(a.finding.criterion for a in answers if a.finding)
    assert found["CHK-BUSY"] == 950 and found["CHK-FORM"] + found["CHK-SEAL"] == 50
    assert all(len(a.request) <= 500 for a in answers)
    world.ask()
    world.tick(2)
    assert statuses(world)[-1] == "confirmed"


def test_a_tick_looks_at_so_many_requests_and_the_next_at_as_many_again() -> None:
    world = running(mode=Mode.APPROVE)
    for _ in range(2):
        for k in range(asked.MOST):
            world.ask(asking(id=f"nobody{k}"))
        good = world.ask(name=f"r{len(world.seen)}")
        world.tick()
        assert finding(world, good.id) == "CHK-BUSY"
        assert world.seen[-1].answers[-1].reason == "50 requests came at once; this one was not read, ask again later"
    world.ask(good)  # its seal was not used
    world.tick()
    assert statuses(world, good.id)[-2:] == ["authorised", "offered"]


def test_a_full_mailbox_still_takes_what_a_person_orders() -> None:
    world = running()
    while world.guard.mailbox.put(asking(id="junk")):
        pass
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    assert world.guard.latched == "ordered by Ada: smoke" and len(world.seen[-1].answers) == boxes.MOST == 1000


def test_a_full_mailbox_still_takes_alarms_and_what_a_person_orders() -> None:
    world = running()
    while world.guard.mailbox.put(asking(id="junk")):
        pass
    while world.guard.mailbox.put(Trouble("recovery:lost", "recovery is lost")):
        pass
    world.order(Verb.FALL_BACK, reason="smoke")
    world.tick()
    assert "recovery:lost" in {alarm.id for alarm in world.guard.alarms}
    assert world.guard.latched == "ordered by Ada: smoke"


def test_people_have_so_many_places_of_their_own() -> None:
    box = Mailbox(2)
    order = PersonCommand("o1", "Ada", Role.OPERATOR, Verb.FALL_BACK, reason="smoke")
    assert [box.put(SAMPLE) for _ in range(3)] == [True, True, False]
    assert [box.put(order) for _ in range(boxes.APART + 1)] == [True] * 100 + [False]
    assert box.take() == (SAMPLE, SAMPLE, *[order] * 100) and box.take() == ()


def test_an_order_of_any_size_is_answered_and_its_journal_line_is_short() -> None:
    world = running()
    for name in ("id", "person", "subject", "digest", "reason"):
        plain = PersonCommand("o1", "Ada", Role.OPERATOR, Verb.FALL_BACK, reason="smoke")
        world.guard.mailbox.put(forged(plain, **{name: LONG}))
        world.guard.mailbox.put(forged(plain, **{name: OBJECT}))
    world.guard.mailbox.put(forged(plain, verb=LONG))
    world.guard.mailbox.put(forged(plain, role=LONG))
    world.guard.mailbox.put(forged(plain, role=OBJECT))
    world.tick()
    heard = world.journal.of(PersonHeard)
    assert len(heard) == 13 and not any(h.done for h in heard) and world.guard.latched is None
    assert {h.command for h in heard} == {"o1", "x" * 200, "list"} and {h.verb for h in heard} == {
        "fall-back",
        "x" * 200,
    }
    assert all(len(h.subject) <= 200 and len(h.reason) <= 500 for h in heard)
    assert heard[-3].reason == f"there is no order '{'x' * 40}' in role 'operator'"
    assert heard[-2].reason == f"there is no order 'fall-back' in role '{'x' * 40}'"
    assert heard[-1].reason == "there is no order 'fall-back' in role 'list'" and heard[-1].role is Role.OPERATOR


def test_why_somebody_gives_up_is_told_in_so_many_words() -> None:
    world = running(mode=Mode.APPROVE)
    world.ask()
    world.tick()
    world.guard.mailbox.put(Withdraw("r1", LONG))
    world.tick()
    assert world.seen[-1].answers[-1].reason == "x" * 500
    assert world.journal.of(AlarmRaised) == []


def test_a_request_that_cannot_even_tell_its_name_is_answered() -> None:
    class Nameless(Request):
        def __getattribute__(self, name: str) -> Any:
            if name in Request.__slots__:
                raise RuntimeError(f"{name} is nobody's business")
            return super().__getattribute__(name)

    world = running()
    world.guard.mailbox.put(object.__new__(Nameless))
    world.tick()
    (answer,) = world.seen[-1].answers
    assert answer.request == "" and answer.finding is not None and answer.finding.criterion == "CHK-FORM"


def test_the_stated_sizes() -> None:
    assert (verification.MOST, verification.MOST_COMMANDS, asked.MOST, boxes.MOST, boxes.APART) == (
        100, 200, 50, 1000, 100,
    )  # fmt: skip
