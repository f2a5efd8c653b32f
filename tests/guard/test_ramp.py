"""Ramps that the guard makes: where they start, how fast they go, where they end, and what stops them."""

from __future__ import annotations

import math
from collections.abc import Callable
from weakref import WeakKeyDictionary

import pytest

from homeostat.domain.mode import Side
from homeostat.domain.plant.rules import WriteRule
from homeostat.domain.recovery import Command
from homeostat.guard.writing.ramp import Ramps

RULES = {
    "T.sp": WriteRule("T.sp", 0.05, 2.0, ramped_by=Side.GUARD),
    "F.sp": WriteRule("F.sp", 0.05, 2.0, ramped_by=Side.PLANT),
}


def same(tag: str, target: float | None, sent: float) -> bool:
    return target == sent


def step(ramps: Ramps, at_s: float) -> tuple[Command, ...]:
    """The steps at ``at_s`` [s] of ramps that the plant follows: it holds each before the next one is due."""
    held = HOLDS.setdefault(ramps, {})
    sent = ramps.step(at_s, held, same, anyway=False)
    ramps.took(sent, at_s, {})
    held.update({c.tag: c.value for c in sent})
    return sent


HOLDS: WeakKeyDictionary[Ramps, dict[str, float | None]] = WeakKeyDictionary()
"""Targets that a plant with these ramps holds."""


def ramping(start: float = 300.0, target: float = 310.0, rate: float = 0.5) -> Ramps:
    """Ramps with one under way, at 10 s."""
    ramps = Ramps()
    HOLDS[ramps] = {"T.sp": start}
    ramps.present({"T.sp": start})
    assert ramps.first((Command("T.sp", target, rate),), RULES, anyway=False) == (Command("T.sp", start, None),)
    assert step(ramps, 10.0) == ()  # it begins here
    return ramps


def values(ramps: Ramps, *times_s: float) -> list[float | None]:
    return [c.value for at_s in times_s for c in step(ramps, at_s)]


@pytest.mark.parametrize(
    "command",
    [
        Command("T.sp", 310.0, None), Command("T.sp", None, None), Command("T.sp", None, 0.5),
        Command("F.sp", 310.0, 0.5), Command("V.man", 310.0, 0.5),
    ],
    ids=["a step", "automatic", "automatic with a rate", "the plant ramps it", "a tag without a rule"],
)  # fmt: skip
def test_what_is_no_ramp_of_the_guard_is_sent_as_it_is(command: Command) -> None:
    ramps = Ramps()
    ramps.present({"T.sp": 300.0, "F.sp": 300.0, "V.man": 300.0})
    assert ramps.first((command,), RULES, anyway=False) == (command,)
    assert values(ramps, 1.0, 2.0) == []
    assert not ramps.passes(command.tag, 300.0, 1.0)


def test_a_target_that_nobody_knows_is_the_start_of_no_ramp() -> None:
    command = Command("T.sp", 310.0, 0.5)
    ramps = Ramps()
    assert ramps.first((command,), RULES, anyway=False) == (command,)
    ramps.present({"T.sp": None})
    assert ramps.first((command,), RULES, anyway=False)[0].value == 310.0
    ramps = Ramps()
    ramps.present({"T.sp": 300.0})
    ramps.present({"T.sp": None})  # handed back to automatic meanwhile
    assert ramps.first((command,), RULES, anyway=False) == (command,)
    ramps = Ramps()
    ramps.present({"T.sp": 300.0})
    ramps.first((Command("T.sp", None, None),), RULES, anyway=False)
    assert ramps.first((command,), RULES, anyway=False) == (command,)


def test_a_ramp_goes_as_fast_as_its_rate_however_long_a_tick_is_and_ends_on_its_target() -> None:
    ramps = ramping()
    assert values(ramps, 12.0, 12.0) == [301.0]  # a clock that stands moves nothing
    assert values(ramps, 12.5, 21.0, 40.0, 41.0) == [301.25, 305.5, 310.0]
    assert values(ramping(target=299.0), 11.0, 12.0, 13.0) == [299.5, 299.0]


def test_the_end_of_a_ramp_is_its_target_to_the_last_bit() -> None:
    assert 0.2 + 0.7 != 0.9
    assert values(ramping(0.2, 0.9, 0.7), 11.0, 12.0) == [0.9]


def test_a_ramp_of_the_guard_is_a_row_of_steps() -> None:
    assert step(ramping(), 11.0) == (Command("T.sp", 300.5, None),)


def test_what_the_plant_tells_of_a_tag_under_way_does_not_move_the_ramp() -> None:
    ramps = ramping()
    step(ramps, 12.0)
    ramps.present({"T.sp": 300.0})  # it lags behind
    assert values(ramps, 13.0) == [301.5]


@pytest.mark.parametrize("target", [None, 305.0])
def test_another_command_ends_a_ramp(target: float | None) -> None:
    ramps = ramping()
    ramps.first((Command("T.sp", target, None),), RULES, anyway=False)
    assert values(ramps, 11.0, 12.0) == []


@pytest.mark.parametrize("stop", [lambda ramps: ramps.stop(), lambda ramps: ramps.drop("T.sp")], ids=["all", "one"])
def test_a_ramp_that_was_stopped_stays_where_it_got_to_and_the_next_one_starts_there(
    stop: Callable[[Ramps], None],
) -> None:
    ramps = ramping()
    step(ramps, 12.0)
    stop(ramps)
    assert values(ramps, 13.0) == []
    assert ramps.first((Command("T.sp", 290.0, 0.5),), RULES, anyway=False) == (Command("T.sp", 301.0, None),)
    assert values(ramps, 14.0, 15.0) == [300.5]


def test_a_ramp_is_turned_round_where_it_is() -> None:
    ramps = ramping()
    step(ramps, 12.0)
    assert ramps.first((Command("T.sp", 290.0, 0.5),), RULES, anyway=False) == (Command("T.sp", 301.0, None),)
    assert values(ramps, 13.0, 14.0) == [300.5]


def test_a_ramp_that_is_turned_round_before_its_first_step_starts_where_it_was() -> None:
    ramps = ramping()
    assert ramps.first((Command("T.sp", 290.0, 0.5),), RULES, anyway=False) == (Command("T.sp", 300.0, None),)


def test_a_ramp_starts_at_the_last_step_that_was_commanded() -> None:
    ramps = Ramps()
    ramps.first((Command("T.sp", 305.0, None),), RULES, anyway=False)
    assert ramps.first((Command("T.sp", 310.0, 0.5),), RULES, anyway=False) == (Command("T.sp", 305.0, None),)


@pytest.mark.parametrize(
    ("value", "passed"),
    [(299.5, True), (299.49, False), (301.0, True), (302.5, True), (302.51, False), (None, False)],
)
def test_a_ramp_has_led_through_what_lies_behind_it(value: float | None, passed: bool) -> None:
    up, down = ramping(), ramping(302.0, 290.0)
    step(up, 14.0)
    step(down, 14.0)
    for ramps in (up, down):  # both between 300 and 302
        assert ramps.passes("T.sp", value, 0.5) is passed
        assert not ramps.passes("F.sp", value, 0.5)
    up.drop("F.sp")
    up.drop("T.sp")
    assert not up.passes("T.sp", value, 0.5)


@pytest.mark.parametrize("first", [302.0, 298.0])
def test_what_several_ramps_have_led_through_is_explained_and_no_more(first: float) -> None:
    ramps = ramping(target=first)
    step(ramps, 12.0)
    over = 301.0 if first > 300.0 else 299.0
    ramps.present({"T.sp": 300.5})
    ramps.first((Command("T.sp", 600.0 - first, 0.5),), RULES, anyway=False)
    HOLDS[ramps]["T.sp"] = 300.5
    step(ramps, 20.0)
    step(ramps, 21.0)
    ramps.stop()
    now = 300.0 if first > 300.0 else 301.0
    low, high = min(over, now), max(over, now)
    explained = [ramps.passes("T.sp", t, 0.0) for t in (low - 0.1, low, high, high + 0.1)]
    assert explained == [False, True, True, False]


@pytest.mark.parametrize(
    ("begins", "goal", "low", "high"), [(303.0, 309.0, 300.0, 304.0), (298.0, 292.0, 297.0, 301.0)]
)
def test_a_later_ramp_explains_more_above_or_below(begins: float, goal: float, low: float, high: float) -> None:
    """Both go 1 K: the first from 300 K up, the second from where the plant was found."""
    ramps = ramping(target=310.0)
    step(ramps, 12.0)
    for target in (goal, None):
        ramps.present({"T.sp": begins})
        ramps.first((Command("T.sp", target, 0.5),), RULES, anyway=False)
        if target is not None:
            HOLDS[ramps]["T.sp"] = begins
            step(ramps, 20.0)
            step(ramps, 22.0)
    explained = [ramps.passes("T.sp", t, 0.0) for t in (low - 0.1, low, high, high + 0.1)]
    assert explained == [False, True, True, False]


def test_what_is_shown_late_leads_only_a_ramp_back_that_is_not_sent_anyway() -> None:
    for anyway, target, start in ((False, 310.0, 300.0), (True, 310.0, 301.0), (True, 305.0, 300.0)):
        ramps = ramping()
        step(ramps, 12.0)
        ramps.present({"T.sp": 300.0})
        commands = (Command("T.sp", target, 0.5),)
        sent = ramps.first(commands, RULES, anyway=anyway)
        assert sent == (Command("T.sp", start, None),)


def test_a_ramp_that_was_stopped_explains_what_it_has_led_through_until_all_is_read_or_it_is_left() -> None:
    ramps = ramping()
    step(ramps, 12.0)
    ramps.stop()
    assert ramps.passes("T.sp", 300.5, 0.0)
    ramps.first((Command("T.sp", 305.0, None),), RULES, anyway=False)
    assert ramps.passes("T.sp", 300.5, 0.0)
    ramps.forget()
    assert not ramps.passes("T.sp", 300.5, 0.0)
    ramps = ramping()
    step(ramps, 12.0)
    ramps.stop()
    ramps.drop("T.sp")
    assert not ramps.passes("T.sp", 300.5, 0.0)


def two() -> Ramps:
    """Two ramps under way at 10 s: one of two steps, one of twenty."""
    ramps, rules = Ramps(), {t: WriteRule(t, 0.05, 2.0, ramped_by=Side.GUARD) for t in ("T.sp", "F.sp")}
    ramps.present({"T.sp": 300.0, "F.sp": 1.0})
    ramps.first((Command("T.sp", 310.0, 0.5), Command("F.sp", 2.0, 0.5)), rules, anyway=False)
    HOLDS[ramps] = {"T.sp": 300.0, "F.sp": 1.0}
    step(ramps, 10.0)
    return ramps


def test_the_plant_follows_as_well_as_it_follows_the_worst_ramp_under_way() -> None:
    assert Ramps().followed_s == -math.inf
    ramps = two()
    assert ramps.followed_s == 10.0
    step(ramps, 11.0)
    step(ramps, 12.0)  # the short one is at its end
    step(ramps, 13.0)
    assert ramps.followed_s == 13.0
    ramps = two()
    holds: dict[str, float | None] = {"T.sp": 300.0, "F.sp": 1.3}  # not where it was sent
    for at_s in (11.0, 12.0, 13.0):
        sent = ramps.step(at_s, holds, same, anyway=False)
        ramps.took(sent, at_s, holds)
        holds.update({c.tag: c.value for c in sent})
    assert holds == {"T.sp": 301.5, "F.sp": 1.3}
    assert ramps.followed_s == 10.0
    ramps = two()
    for n in range(1, 21):
        step(ramps, 10.0 + n)
    assert ramps.followed_s == 30.0, "the last step of all"


@pytest.mark.parametrize(
    ("told", "followed_s"),
    [({"T.sp": 300.0}, 11.0), ({}, 12.0), ({"T.sp": None}, 11.0)],
    ids=["it stands still", "nobody hears it", "it is in automatic"],
)
def test_a_ramp_that_goes_on_anyway_is_followed_as_long_as_the_plant_moves_or_is_not_heard(
    told: dict[str, float | None], followed_s: float
) -> None:
    ramps = ramping()
    step(ramps, 11.0)
    sent = ramps.step(11.0, told, same, anyway=True)
    assert sent == ()
    sent = ramps.step(12.0, told, same, anyway=True)
    ramps.took(sent, 12.0, told)
    assert sent == (Command("T.sp", 301.0, None),) and ramps.followed_s == followed_s


def test_a_ramp_that_goes_on_anyway_is_followed_by_a_plant_that_comes_after_it() -> None:
    ramps, told = ramping(), {"T.sp": 300.0}
    for n in range(1, 5):
        told["T.sp"] += 0.2
        ramps.took(ramps.step(10.0 + n, told, same, anyway=True), 10.0 + n, told)
    assert ramps.followed_s == 14.0


def test_a_step_that_the_link_did_not_take_is_sent_again_unless_the_plant_holds_it() -> None:
    ramps = ramping()
    for at_s, told in ((11.0, 300.0), (12.0, 300.0), (13.0, 300.5)):
        sent = ramps.step(at_s, {"T.sp": told}, same, anyway=False)
        assert sent == (Command("T.sp", told + 0.5, None),)
    assert ramps.passes("T.sp", 301.0, 0.0) and not ramps.passes("T.sp", 301.1, 0.0)
