"""Every check of a request by name, in the positive, and at its edge."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from homeostat.domain.mode import Mode
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.request import Request
from homeostat.guard.mailbox import Mailbox
from homeostat.guard.requests import requests as asked
from homeostat.guard.requests.seal import Sealer, genuine, new_key
from homeostat.guard.requests.verification import Unfit, authorise, command_finding, mapped
from tests.guard.spoils import forged
from tests.guard.vessel import ADJUSTED, KEY, MACHINE, POUR, ROUTE, RULES, finding, running, statuses

pytestmark = pytest.mark.quick


def sets(*commands: Command, then: tuple[Step, ...] = (), target: str = "running") -> ActionSet:
    return ActionSet(commands, target, then)


HOT = Command("T.sp", 305.0, 0.5)


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"actions": sets()}, "CHK-EMPTY"),
        ({"configuration": "another"}, "CHK-CONFIGURATION"),
        ({"state": "waiting"}, "CHK-STATE"),
        ({"path": ("restart",), "actions": sets(target="waiting"), "state": "shut"}, "CHK-EMPTY"),
        ({"path": ("restart",), "actions": sets(HOT, target="waiting"), "state": "shut"}, "CHK-STATE"),
        ({"path": ("trip",), "actions": sets(Command("F.sp", 0.0, 0.005), target="shut")}, "CHK-TARGET"),
        ({"actions": sets(Command("T", 300.0, None))}, "CHK-WRITABLE"),
        ({"actions": sets(Command("Q.sp", 300.0, None))}, "CHK-WRITABLE"),
        ({"actions": sets(HOT, then=(Step(POUR.transition, (HOT,)),)), "path": ("adjust", "empty")}, "CHK-ADMISSIBLE"),
        ({"actions": sets(Command("F.sp", None, None))}, "CHK-AUTOMATIC"),
        ({"actions": sets(Command("T.sp", 312.001, 0.5))}, "CHK-RANGE"),
        ({"actions": sets(Command("T.sp", 297.999, 0.5))}, "CHK-RANGE"),
        ({"actions": sets(Command("T.sp", 305.0, None))}, "CHK-RATE"),
        ({"actions": sets(Command("T.sp", 305.0, 0.5001))}, "CHK-RATE"),
        ({"path": ()}, "CHK-FORM"),
        ({"path": ("nowhere",)}, "CHK-FORM"),
        ({"path": ["adjust"]}, "CHK-FORM"),
        ({"path": ("adjust", "empty")}, "CHK-FORM"),
        ({"path": ("adjust", "end")}, "CHK-FORM"),
        ({"actions": sets(HOT, target="rest")}, "CHK-FORM"),
        ({"id": "x" * 501}, "CHK-FORM"),
    ],
)
def test_a_check_that_fails_is_named(changed: dict[str, Any], name: str) -> None:
    world = running()
    world.ask(**changed)
    world.tick(2)
    assert world.sent == [] and [a.finding.criterion for s in world.seen for a in s.answers if a.finding] == [name]


@pytest.mark.parametrize(
    "actions",
    [
        sets(Command("T.sp", 312.0, 0.5)), sets(Command("T.sp", 298.0, 0.0001)), sets(Command("V.man", None, None)),
        sets(Command("V.man", 1, 0.2)), sets(Command("X.cmd", 1.0, 99.0)), sets(HOT, then=(POUR,)),
    ],
)  # fmt: skip
def test_what_is_at_the_edge_passes(actions: ActionSet) -> None:
    world = running()
    world.ask(actions=actions, path=("adjust", "empty") if actions.then else ("adjust",))
    world.tick(2)
    assert statuses(world)[-1] == "confirmed"


@pytest.mark.parametrize(
    "broken",
    [
        {"actions": None}, {"actions": forged(ADJUSTED, commands=(forged(HOT, value=math.nan),))},
        {"actions": forged(ADJUSTED, commands=(forged(HOT, value="305"),))},
        {"actions": forged(ADJUSTED, commands=(forged(HOT, value=True),))},
        {"actions": forged(ADJUSTED, commands=(forged(HOT, rate=-0.5),))},
        {"actions": forged(ADJUSTED, commands=(HOT, HOT))}, {"actions": forged(ADJUSTED, commands=[HOT])},
        {"actions": forged(ADJUSTED, commands=(forged(HOT, tag=7),))}, {"seal": None}, {"id": 7}, {"state": None},
        {"actions": forged(ADJUSTED, commands=tuple(Command(f"Z{k}", 1.0, None) for k in range(101)))},
    ],
)  # fmt: skip
def test_what_has_no_form_is_answered_all_the_same(broken: dict[str, Any]) -> None:
    world = running()
    world.guard.mailbox.put(forged(world.request(), **broken))
    world.tick()
    assert [a.finding.criterion for a in world.seen[-1].answers if a.finding] == ["CHK-FORM"] and world.sent == []


def refused(request: Request, now_s: float = 10.0, keys: dict[str, bytes] | None = None, oldest_s: float = 30.0) -> str:
    try:
        authorise(request, {"check": KEY} if keys is None else keys, now_s, oldest_s, oldest_s)
    except Unfit as unfit:
        return unfit.finding.criterion
    return ""


def sealed(checked_s: float = 10.0, lasts_s: float = 30.0, issuer: str = "check", key: bytes = KEY) -> Request:
    return Sealer(issuer, key, lambda: lasts_s).seal(running().request(), checked_s)


def test_a_seal_is_an_issuers_and_covers_everything() -> None:
    request = sealed()
    assert refused(request) == ""
    assert refused(request, keys={}) == refused(sealed(issuer="other")) == refused(sealed(key=b"x")) == "CHK-SEAL"
    for name in ("id", "proposer", "state", "diagnosis", "configuration"):
        assert refused(replace(request, **{name: "x"})) == "CHK-SEAL"
    assert refused(replace(request, path=("empty",))) == refused(replace(request, actions=ROUTE)) == "CHK-SEAL"
    for name, value in {"checked_s": 9.0, "expires_s": 41.0, "nonce": "n", "mac": "é" * 64}.items():
        assert refused(replace(request, seal=replace(request.seal, **{name: value}))) == "CHK-SEAL"
    assert genuine(request, KEY) and len(new_key()) == 32 and new_key() != new_key()


@pytest.mark.parametrize(
    ("checked_s", "lasts_s", "now_s", "name"),
    [
        (10.0, 30.0, 10.0, ""), (10.0, 30.0, 40.0, ""), (10.0, 30.0, 40.1, "CHK-AGE"), (10.0, 30.0, 9.9, "CHK-AGE"),
        (10.0, 20.0, 30.0, ""), (10.0, 20.0, 30.1, "CHK-EXPIRY"), (10.0, 30.1, 12.0, "CHK-EXPIRY"),
        (10.0, math.inf, 12.0, "CHK-EXPIRY"), (10.0, math.nan, 12.0, "CHK-EXPIRY"), (math.nan, 30.0, 12.0, "CHK-AGE"),
        (math.inf, 30.0, 12.0, "CHK-AGE"), (-math.inf, 30.0, 12.0, "CHK-AGE"),
    ],
)  # fmt: skip
def test_a_release_check_is_neither_old_nor_of_the_future(
    checked_s: float, lasts_s: float, now_s: float, name: str
) -> None:
    assert refused(sealed(checked_s, lasts_s), now_s) == name


@settings(max_examples=200)
@given(st.floats(0.0, 1e7))
def test_rounding_refuses_no_seal_that_lasts_as_long_as_it_may(checked_s: float) -> None:
    assert refused(SEALER.seal(PLAIN, checked_s), checked_s) == ""


SEALER, PLAIN = Sealer("check", KEY), running().request()


def test_a_seal_and_a_name_are_used_once() -> None:
    world = running()
    first = world.ask()
    world.tick(2)
    world.ask(first)
    world.tick()
    assert finding(world) == "CHK-USED"
    world.ask(replace(first, id="r2"))
    world.tick()
    assert finding(world, "r2") == "CHK-USED"
    world.ask()  # the same name under a new seal
    world.tick()
    assert finding(world) == "CHK-USED" and len(world.sent) == 1


def test_only_so_many_requests_wait_and_the_oldest_goes_first() -> None:
    world = running()
    for k in range(asked.MOST + 1):
        world.ask(name=f"r{k}")
    world.tick(2)
    assert finding(world, f"r{asked.MOST}") == "CHK-BUSY"
    assert statuses(world, "r0")[-1] == "confirmed"
    box = Mailbox(2)
    assert [box.put(m) for m in "abc"] == [True, True, False]  # type: ignore[arg-type]
    assert box.take() == ("a", "b") and box.take() == ()


def test_a_request_waits_for_a_reading_inside_the_limits() -> None:
    world = running()
    stop = sets(HOT, Command("F.sp", 0.0, 0.005))
    world.ask(actions=stop)
    world.tick(1, L=12.08)
    assert statuses(world) == ["authorised"] and world.sent == []
    world.tick(1, L=8.0)
    assert world.sent == [stop.commands]


def test_a_broken_rule_passes_nothing() -> None:
    class Broken:
        text, tags = "broken", frozenset[str]()

        def holds(self, values: object) -> bool:
            raise ArithmeticError("no number")

    adjust = replace(MACHINE.transitions[1], guard=Broken())  # type: ignore[arg-type]
    machine = replace(MACHINE, transitions=(MACHINE.transitions[0], adjust, *MACHINE.transitions[2:]))
    rules: GuardRules = replace(RULES, machine=machine)
    world = running(rules=rules)
    request = world.request()
    own, _ = mapped(request, rules)
    assert own == request and own.actions is not request.actions
    found = command_finding(HOT, None, "running", rules)
    assert found is not None and found.criterion == "CHK-ADMISSIBLE"
    world.ask(request)
    world.tick(2)
    assert world.sent == [] and statuses(world)[-1] == "refused" and world.guard.mode is Mode.CLOSED_LOOP
