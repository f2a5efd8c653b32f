"""What a write is made of: when two targets are the same, when one is on the way, and what is said of a part."""

from __future__ import annotations

import pytest

from homeostat.domain.events.writes import Cause
from homeostat.domain.recovery import Command
from homeostat.guard.writing.flight import GivenUp, Write, between, same, shown

FEED, VALVE, HEAT = Command("F.sp", 0.02, 0.005), Command("V.man", None, None), Command("T.sp", 305.0, 0.5)


@pytest.mark.parametrize(
    ("one", "other", "tolerance", "equal"),
    [
        (0.0, 1e-9, 0.0, True), (0.0, 1.5e-9, 0.0, False), (0.0, -1e-9, 0.0, True), (0.0, -1.5e-9, 0.0, False),
        (1.0, 1.5, 0.5, True), (1.0, 1.5 + 5e-10, 0.5, True), (1.0, 1.5 + 2e-9, 0.5, False),
        (None, None, 0.0, True), (None, 0.0, 1.0, False), (0.0, None, 1.0, False),
    ],
)  # fmt: skip
def test_two_targets_are_the_same_within_tolerance_and_rounding(
    one: float | None, other: float | None, tolerance: float, equal: bool
) -> None:
    assert same(one, other, tolerance) is equal


@pytest.mark.parametrize(
    ("target", "lies"),
    [
        (0.5, True), (1.0, True), (3.5, True), (2.0, True), (0.5 - 5e-10, True), (3.5 + 5e-10, True),
        (1.0 - 0.5 - 1e-9, True), (3.0 + 0.5 + 1e-9, True),
        (0.5 - 2e-9, False), (3.5 + 2e-9, False), (None, False),
    ],
)  # fmt: skip
def test_what_lies_between_two_targets_lies_there_whichever_is_the_first(target: float | None, lies: bool) -> None:
    assert between(target, 1.0, 3.0, 0.5) is lies and between(target, 3.0, 1.0, 0.5) is lies
    assert not between(target, None, 3.0, 0.5) and not between(target, 1.0, None, 0.5)


@pytest.mark.parametrize(
    ("written", "missing", "text"),
    [
        ((), (FEED, VALVE), "nothing; not F.sp = 0.02, V.man = automatic; overwritten unread T.sp = 305"),
        ((FEED,), (VALVE, HEAT), "F.sp = 0.02; not V.man = automatic, T.sp = 305"),
        ((FEED, VALVE), (), "F.sp = 0.02, V.man = automatic; overwritten unread T.sp = 305"),
        ((FEED, VALVE, HEAT), (), "F.sp = 0.02, V.man = automatic, T.sp = 305"),
    ],
)
def test_what_was_written_of_a_set_is_said_for_a_person(
    written: tuple[Command, ...], missing: tuple[Command, ...], text: str
) -> None:
    given_up = GivenUp(Write(Cause.REQUEST, "r1", (FEED, VALVE, HEAT), "running"), written, missing, taken=True)
    assert str(given_up) == f"r1 was carried out in part: {text}"
    assert given_up.whole is (len(written) == 3)


def test_a_target_is_shown_in_few_digits() -> None:
    assert shown(None) == "automatic" and shown(1.0 / 3.0) == "0.333333"
