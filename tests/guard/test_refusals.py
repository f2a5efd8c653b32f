"""Refusals of commands and requests: each bound from both sides, and every finding with its figures."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.rules import GuardRules, WriteRule
from homeostat.domain.plant.state_machine import SetpointRange
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.request import Request, RequestStatus
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding
from homeostat.guard.requests.permissives import refusal
from homeostat.guard.requests.seal import Sealer, genuine
from homeostat.guard.requests.verification import (
    Present,
    Unfit,
    authorise,
    command_finding,
    mapped,
    verify,
    verify_start,
)
from homeostat.guard.watch.violations import Violation
from tests.guard.oracle import KEY as KEY_OF_ADVERSARY
from tests.guard.oracle import sealed
from tests.guard.spoils import forged
from tests.guard.vessel import ADJUSTED, KEY, MACHINE, POUR, ROUTE, RULES, VALUES, running, statuses

WIDE = SetpointRange("T.sp", 298.0, 312.0, 310.0)


def said(command: Command, admitted: SetpointRange | None = WIDE, rules: GuardRules = RULES) -> Finding | None:
    return command_finding(command, admitted, "running", rules)


@pytest.mark.parametrize(
    ("low", "high", "inside", "outside"),
    [
        (0.0, 0.5, (0.0, 0.5, 0.5 + 1e-9, 0.0 - 1e-9), (0.5 + 1.1e-9, -1.1e-9)),
        (0.0, 200.0, (200.0 + 1.9e-7, -1.9e-7), (200.0 + 2.1e-7, -2.1e-7)),
        (-200.0, 0.0, (-200.0 - 1.9e-7, 1.9e-7), (-200.0 - 2.1e-7, 2.1e-7)),
    ],
)
def test_a_range_allows_for_rounding_and_nothing_more(
    low: float, high: float, inside: tuple[float, ...], outside: tuple[float, ...]
) -> None:
    admitted = SetpointRange("X.cmd", low, high, low)
    assert [v for v in inside if said(Command("X.cmd", v, None), admitted) is not None] == []
    assert [v for v in outside if said(Command("X.cmd", v, None), admitted) is None] == []


def test_a_value_outside_its_range_is_told_with_both() -> None:
    text = "'T.sp' = {} K in state 'running'; admitted are 298 to 312 K"
    assert said(Command("T.sp", 315.0, 0.5)) == Finding(
        "CHK-RANGE", Owner.ACTION, -3.0, "K", 0.0, 0, text.format("315")
    )
    assert said(Command("T.sp", 296.5, 0.5)) == Finding(
        "CHK-RANGE", Owner.ACTION, -1.5, "K", 0.0, 0, text.format("296.5")
    )


def test_a_rate_above_its_limit_is_told_with_both() -> None:
    assert said(Command("T.sp", 305.0, 0.5)) is None
    assert said(Command("T.sp", 305.0, 0.75)) == Finding(
        "CHK-RATE", Owner.ACTION, -0.25, "K/s", 0.0, 0, "'T.sp' ramps at 0.75 K/s; limit 0.5 K/s"
    )
    assert said(Command("T.sp", 305.0, None)) == Finding(
        "CHK-RATE", Owner.ACTION, -math.inf, "K/s", 0.0, 0, "'T.sp' ramps at inf K/s; limit 0.5 K/s"
    )


def test_automatic_needs_a_tag_that_has_it_and_a_state_that_means_it() -> None:
    hand_back = Command("V.man", None, None)
    assert said(hand_back, SetpointRange("V.man", 0.0, 1.0, None)) is None
    why = refusal("CHK-AUTOMATIC", "'V.man' has no automatic mode in state 'running'")
    assert said(hand_back, SetpointRange("V.man", 0.0, 1.0, 1.0)) == why
    manual = replace(RULES, writables=dict(RULES.writables) | {"V.man": WriteRule("V.man", 0.005, 2.0)})
    assert said(hand_back, SetpointRange("V.man", 0.0, 1.0, None), manual) == why


def test_what_is_not_in_both_tables_is_not_writable() -> None:
    more = replace(RULES, writables=dict(RULES.writables) | {"Q.sp": WriteRule("Q.sp", 0.1, 2.0)})
    for tag, rules in (("Q.sp", RULES), ("Q.sp", more), ("T", RULES)):
        assert said(Command(tag, 305.0, 0.5), WIDE, rules) == refusal(
            "CHK-WRITABLE", f"{tag!r} is not a tag that may be written"
        )
    assert said(Command("T.sp", 305.0, 0.5), None) == refusal(
        "CHK-ADMISSIBLE", "'T.sp' may not be commanded in state 'running'"
    )


NEAR = (Violation("LIM-A", -1.0, "K", "too hot"), Violation("LIM-B", -1.0, "L", "too full"))
NOW = Present(
    10.0, Snapshot(10.0, VALUES | {"F.sp": 0.0, "X.cmd": 1.0, "V.man": 0.5}), "running", frozenset(RULES.writables), ()
)


def refused(request: Request, path: tuple[str, ...] | None = None, rules: GuardRules = RULES, **now: Any) -> Finding:
    """What `verify` finds; ``now`` changes what it is judged on."""
    by_name = {t.name: t for t in rules.machine.transitions}
    way = RecoveryPath(rules.machine, tuple(by_name[name] for name in path or request.path))
    with pytest.raises(Unfit) as unfit:
        verify(request, way, rules, replace(NOW, **now))
    assert str(unfit.value) == unfit.value.finding.message
    return unfit.value.finding


PLAIN = running().request()


def test_every_refusal_of_a_request_says_what_is_wrong() -> None:
    nothing = replace(PLAIN, actions=ActionSet((), "running"))
    assert refused(nothing) == refusal("CHK-EMPTY", "request 'r1' commands nothing; there is nothing to release")
    assert refused(replace(PLAIN, configuration="x")) == refusal(
        "CHK-CONFIGURATION", "request 'r1' was approved under another configuration"
    )
    shut = replace(PLAIN, path=("trip",), actions=ActionSet((Command("F.sp", 0.0, 0.005),), "shut"))
    assert refused(shut) == refusal("CHK-TARGET", "'shut' is no state in which a recovery may end")
    assert refused(PLAIN, in_service=frozenset({"T.sp"})) == refusal(
        "CHK-SERVICE", "'F.sp' is out of service; a person must bring it back"
    )
    assert refused(PLAIN, near=NEAR) == refusal("LIM-A", "hard limit at release: too hot")


def test_a_state_that_the_plant_has_left_and_a_way_that_is_not_open_ask_for_another_plan() -> None:
    left = refusal("CHK-STATE", "the plant is in 'rest', and the request starts in 'running'", Owner.PLANNING)
    assert refused(PLAIN, state="rest") == left and left.owner is Owner.PLANNING and left.margin == -math.inf
    assert refused(replace(PLAIN, state="rest")).criterion == "CHK-STATE"
    assert refused(replace(PLAIN, state="shut"), state="shut").criterion == "CHK-STATE"
    hot = replace(NOW.readings, values=VALUES | {"T": 321.0})  # type: ignore[type-var]
    closed = refusal("CHK-OPEN", "'T <= 320' does not hold, so 'running' is not open (adjust)", Owner.PLANNING)
    assert refused(PLAIN, readings=hot) == closed == refused(PLAIN, readings=None)


def test_without_a_reading_nothing_is_released() -> None:
    always = replace(MACHINE.transitions[1], guard=MACHINE.states[0].settled_when)
    rules = replace(RULES, machine=replace(MACHINE, transitions=(MACHINE.transitions[0], always)))
    assert refused(PLAIN, rules=rules, readings=None) == refusal("CHK-READING", "there is no reading to decide on")


def test_a_permissive_that_does_not_hold_is_told_with_its_margin() -> None:
    full = replace(NOW.readings, values=dict(NOW.readings.values) | {"L": 11.5})  # type: ignore[union-attr, type-var]
    found = refused(PLAIN, readings=full)
    assert (found.criterion, found.owner, found.margin, found.unit) == ("PRM-FEED", Owner.ACTION, -2.5, "1")
    assert found.message.startswith("permissive at release: What PRM-FEED protects: ")


def test_a_path_that_is_not_that_of_the_request_passes_nothing() -> None:
    found = refused(PLAIN, ("adjust", "empty"))
    assert found.criterion == "CHK-RULES" and found.message.startswith("request 'r1' cannot be judged: zip()")


@pytest.mark.parametrize(("error", "why"), [(ArithmeticError("no number"), "no number"), (KeyError(), "KeyError")])
def test_a_rule_that_breaks_says_how(error: Exception, why: str) -> None:
    class Broken:
        text, tags = "broken", frozenset[str]()

        def holds(self, values: object) -> bool:
            raise error

    adjust = replace(MACHINE.transitions[1], guard=Broken())  # type: ignore[arg-type]
    rules = replace(RULES, machine=replace(MACHINE, transitions=(MACHINE.transitions[0], adjust)))
    assert refused(PLAIN, rules=rules) == refusal("CHK-RULES", f"request 'r1' cannot be judged: {why}")


def test_every_refusal_of_a_seal_says_what_is_wrong_with_it() -> None:
    def refused(checked_s: float, lasts_s: float, now_s: float, key: bytes = KEY) -> str:
        request = Sealer("check", key, lambda: lasts_s).seal(PLAIN, checked_s)
        with pytest.raises(Unfit) as unfit:
            authorise(request, {"check": KEY}, now_s, 30.0, 25.0)
        return f"{unfit.value.finding.criterion}: {unfit.value}"

    assert refused(10.0, 20.0, 10.0, b"x") == (
        "CHK-SEAL: the seal of request 'r1' is not the release check's; have it checked again"
    )
    assert refused(10.0, 25.0, 45.0) == (
        "CHK-AGE: the release check of request 'r1' is 35 s old; 0 to 30 s are allowed"
    )
    assert refused(10.0, 20.0, 35.0) == "CHK-EXPIRY: the seal of request 'r1' is void since 30 s"
    assert refused(10.0, 26.0, 12.0) == "CHK-EXPIRY: the seal of request 'r1' lasts 26 s; at most 25 s are allowed"


def test_a_seal_may_last_a_rounding_longer_and_no_more() -> None:
    for lasts_s, fits in ((25.0, True), (25.0 + 1e-6, True), (25.0 + 1.5e-6, False)):
        request = Sealer("check", KEY, lambda lasts_s=lasts_s: lasts_s).seal(PLAIN, 0.0)  # type: ignore[misc]
        try:
            authorise(request, {"check": KEY}, 1.0, 30.0, 25.0)
        except Unfit:
            assert not fits
        else:
            assert fits


def test_a_seal_lasts_half_a_minute_unless_somebody_says_otherwise_and_no_two_are_the_same() -> None:
    first, second = (Sealer("check", KEY).seal(PLAIN, 100.0).seal for _ in range(2))
    assert (first.issuer, first.checked_s, first.expires_s) == ("check", 100.0, 130.0)
    assert first.nonce != second.nonce and first.mac != second.mac
    assert len(bytes.fromhex(first.nonce)) == 16, "so many bytes that nobody guesses one"


def test_a_seal_is_what_anybody_makes_who_has_the_key_and_the_standard() -> None:
    by_hand = sealed(PLAIN, 100.0)
    assert genuine(by_hand, KEY_OF_ADVERSARY) and not genuine(by_hand, KEY)


def test_what_has_no_form_says_what_is_missing() -> None:
    def why(**changed: Any) -> str:
        with pytest.raises(Unfit) as unfit:
            mapped(forged(PLAIN, **changed), RULES)
        assert unfit.value.finding.criterion == "CHK-FORM"
        return str(unfit.value).removeprefix("this is no request that the plant could take: ")

    assert why(path=("nowhere",)) == "the machine has no transition 'nowhere'"
    assert why(path=("adjust", "empty")) == "the later steps are not those that the path waits for"
    assert why(actions=ROUTE) == "the later steps are not those that the path waits for"
    assert why(actions=replace(ADJUSTED, target="rest")) == "the commands lead to 'rest', the path to 'running'"


class Sly(float):
    """A number that says of itself whatever is wanted."""

    def __le__(self, other: object) -> bool:
        return True

    __ge__ = __lt__ = __gt__ = __le__  # type: ignore[assignment]


def test_a_number_that_lies_when_it_is_compared_is_taken_for_what_it_is() -> None:
    world = running()
    sly = ActionSet((forged(Command("T.sp", 400.0, 0.5), value=Sly(400.0)),), "running")
    world.ask(actions=sly)
    world.tick()
    (answer,) = [a for a in world.seen[-1].answers if a.status is RequestStatus.REFUSED]
    assert answer.finding is not None and answer.finding.criterion == "CHK-RANGE" and world.sent == []
    own, _ = mapped(forged(PLAIN, actions=sly), RULES)
    assert [type(c.value) for c in own.actions.commands] == [float]


def test_a_request_may_leave_the_present_alone_and_command_later_steps_only() -> None:
    world = running()
    world.ask(actions=ActionSet((), "running", (POUR,)), path=("adjust", "empty"))
    world.tick()
    assert statuses(world) == ["authorised", "verified", "accepted", "confirmed"] and world.sent == []
    world.tick(1, L=9.5)
    assert world.sent == [POUR.commands]


def test_a_step_is_judged_by_the_state_that_it_leads_to() -> None:
    world = running()
    step = Step(POUR.transition, (Command("F.sp", 0.0101, 0.005),))
    world.ask(actions=ActionSet(ADJUSTED.commands, "running", (step,)), path=("adjust", "empty"))
    world.tick()
    (answer,) = [a for a in world.seen[-1].answers if a.status is RequestStatus.REFUSED]
    assert answer.reason == "'F.sp' = 0.0101 L/s in state 'emptying'; admitted are 0 to 0.01 L/s"


def test_of_several_limits_the_first_one_refuses_a_request_and_a_start() -> None:
    first = refusal("LIM-A", "hard limit at release: too hot")
    assert refused(PLAIN, near=NEAR) == first
    with pytest.raises(Unfit) as unfit:
        verify_start(MACHINE.transitions[1], ADJUSTED, RULES, replace(NOW, above=NEAR))
    assert unfit.value.finding == first


def test_a_person_who_interrupts_while_the_name_of_a_request_is_asked_ends_the_guard() -> None:
    class Interrupts(str):
        __slots__ = ()

        def __getitem__(self, _: object) -> str:
            raise KeyboardInterrupt

    world = running()
    world.ask(replace(PLAIN, id=Interrupts("r1"), proposer=""))
    with pytest.raises(KeyboardInterrupt):
        world.tick()
