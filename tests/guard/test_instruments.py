"""Readings that stay bad while others come are alarms, each by name as long as they are few."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import AlarmRaised, AlarmReturned
from homeostat.domain.plant.rules import QualityRule
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.watch.alarms import Alarms
from homeostat.guard.watch.instruments import ALL, LASTS, MOST, Instruments

TAGS = [f"L{k}" for k in range(1, 9)]
STALE_S = 5.0
WHY = "has been exactly 3 L for 10 s: frozen"


def instruments() -> tuple[Instruments, list[tuple[Any, float]]]:
    noted: list[tuple[Any, float]] = []
    rules = {tag: QualityRule(tag, STALE_S) for tag in TAGS}
    return Instruments(rules, Alarms(lambda event, at_s: noted.append((event, at_s)))), noted


def read(at_s: float, *bad: str) -> Snapshot:
    values = {tag: math.nan if tag in bad else 3.0 for tag in TAGS}
    return Snapshot(at_s, values, frozenset(bad), frozenset(), {tag: f"{tag!r} {WHY}" for tag in bad[:1]})


def test_one_that_stays_bad_is_told_once_with_its_reason_and_returns() -> None:
    watched, noted = instruments()
    for at_s in range(100, 150):
        watched.judge(read(at_s, "L3") if at_s < 120 else read(at_s), float(at_s))
    told_s = 100.0 + LASTS * STALE_S
    raised = AlarmRaised("reading:L3", f"'L3' {WHY}", Priority.MEDIUM)
    assert noted == [(raised, told_s), (AlarmReturned("reading:L3"), 119.0 + LASTS * STALE_S)]


def test_one_without_a_reason_is_told_as_well() -> None:
    watched, noted = instruments()
    for at_s in (0.0, 5.0, 10.0):
        watched.judge(read(at_s, "L1", "L2"), at_s)
    assert [event.cause for event, _ in noted] == [f"'L1' {WHY}", "'L2' is bad again and again"]


@given(st.lists(st.integers(1, 9), min_size=1, max_size=20))
def test_dropouts_are_no_alarm(gaps: list[int]) -> None:
    watched, noted = instruments()
    at_s = 0.0
    for gap in gaps:
        for bad in (True, False):  # shorter than what lasts, each time, and good for as long
            for _ in range(gap):
                watched.judge(read(at_s, "L1") if bad else read(at_s), at_s)
                at_s += 1.0
    assert noted == []


def test_one_that_is_bad_most_of_the_time_is_told_and_does_not_chatter() -> None:
    watched, noted = instruments()
    for at_s in range(500):
        watched.judge(read(at_s) if at_s % 10 == 9 else read(at_s, "L1"), float(at_s))
    assert [type(event) for event, _ in noted] == [AlarmRaised]


def test_a_tag_without_a_rule_is_nobodys_alarm() -> None:
    watched, noted = instruments()
    for at_s in (0.0, 100.0):
        watched.judge(Snapshot(at_s, {"X": math.nan}, frozenset({"X"})), at_s)
    assert noted == []


@pytest.mark.parametrize("count", [MOST, MOST + 1])
def test_many_at_once_are_one_alarm_and_who_joins_later_is_named(count: int) -> None:
    watched, noted = instruments()
    for at_s in (0.0, 5.0, 9.0, 10.0, 11.0):
        watched.judge(read(at_s, *TAGS[:count]), at_s)
    if count == MOST:
        assert [event.alarm for event, _ in noted] == [f"reading:{tag}" for tag in TAGS[:count]]
        return
    ((event, at_s),) = noted
    assert (event.alarm, event.priority, at_s) == (ALL, Priority.HIGH, 10.0)
    assert event.cause == "6 of 8 readings are bad: L1, L2, L3, L4, L5, L6"
    for at_s in (12.0, 17.0, 22.0, 23.0):
        watched.judge(read(at_s, *TAGS), at_s)
    assert [(event.alarm, at_s) for event, at_s in noted[1:]] == [("reading:L7", 22.0), ("reading:L8", 22.0)]
    watched.judge(read(24.0, "L1"), 24.0)
    for at_s in (29.0, 34.0, 40.0):
        watched.judge(read(at_s, "L1"), at_s)
    assert len(noted) == 5 and ALL not in {event.alarm for event, _ in noted[3:]}, "one of them is still out"
    for at_s in (45.0, 50.0):
        watched.judge(read(at_s), at_s)
    assert noted[-1] == (AlarmReturned(ALL), 50.0)


def test_one_that_was_told_before_there_were_many_returns_when_it_is_good() -> None:
    watched, noted = instruments()
    for at_s in (0.0, 5.0, 10.0):
        watched.judge(read(at_s, "L8"), at_s)
    for at_s in (11.0, 16.0, 21.0):
        watched.judge(read(at_s, *TAGS), at_s)
    for at_s in (26.0, 31.0):
        watched.judge(read(at_s, *TAGS[:7]), at_s)
    assert [event.alarm for event, _ in noted] == ["reading:L8", ALL, "reading:L8"]
    assert noted[-1] == (AlarmReturned("reading:L8"), 31.0)


def test_a_clock_that_stands_or_goes_back_breaks_nothing() -> None:
    watched, noted = instruments()
    for at_s in (100.0, 100.0, 50.0, 55.0, 60.0):
        watched.judge(read(at_s, "L1"), at_s)
    assert [event.alarm for event, _ in noted] == ["reading:L1"]


def test_of_a_gap_nobody_knows_what_a_reading_was() -> None:
    """The link was away for an hour, and one reading is bad in the first sample that comes."""
    watched, noted = instruments()
    for at_s, bad in ((100.0, ()), (3700.0, ("L1",)), (3701.0, ()), (7300.0, ("L1",))):
        watched.judge(read(at_s, *bad), at_s)
    assert noted == []
