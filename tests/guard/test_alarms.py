"""The list of alarms by itself: raised once, returned once, gone when it was seen and is over."""

from __future__ import annotations

from typing import Any

import pytest

from homeostat.domain.alarm import Alarm, Priority
from homeostat.domain.events.people import AlarmAcknowledged, AlarmRaised, AlarmReturned
from homeostat.domain.observation import Settled, Trouble
from homeostat.guard.watch.alarms import LISTED, Alarms, Troubles

HIGH, LOW = Priority.HIGH, Priority.LOW


def alarms() -> tuple[Alarms, list[tuple[Any, float]]]:
    noted: list[tuple[Any, float]] = []
    return Alarms(lambda event, at_s: noted.append((event, at_s))), noted


def test_an_alarm_that_lasts_is_raised_once_and_keeps_its_cause() -> None:
    listed, noted = alarms()
    assert not listed.lasts("a")
    listed.raise_("a", "hot", HIGH, 1.0)
    listed.raise_("a", "hotter", LOW, 2.0)
    assert listed.lasts("a") and listed.standing == (Alarm("a", "hot", HIGH, 1.0),)
    assert noted == [(AlarmRaised("a", "hot", HIGH), 1.0)]


def test_an_alarm_that_has_returned_stands_until_it_is_seen_and_is_raised_anew() -> None:
    listed, noted = alarms()
    listed.return_("a", 0.5)
    listed.raise_("a", "hot", HIGH, 1.0)
    listed.return_("a", 2.0)
    listed.return_("a", 3.0)
    assert not listed.lasts("a") and listed.standing == (Alarm("a", "hot", HIGH, 1.0, returned_s=2.0),)
    listed.raise_("a", "hot again", LOW, 4.0)
    assert listed.lasts("a") and listed.standing == (Alarm("a", "hot again", LOW, 4.0),)
    assert [(type(e), at_s) for e, at_s in noted] == [(AlarmRaised, 1.0), (AlarmReturned, 2.0), (AlarmRaised, 4.0)]


def test_an_alarm_leaves_the_list_when_it_is_over_and_was_seen_in_either_order() -> None:
    listed, noted = alarms()
    listed.raise_("a", "hot", HIGH, 1.0)
    assert listed.acknowledge("a", "Ada", 2.0)
    assert listed.standing == (Alarm("a", "hot", HIGH, 1.0, acknowledged_by="Ada"),) and listed.lasts("a")
    listed.return_("a", 3.0)
    assert listed.standing == () and not listed.acknowledge("a", "Ada", 4.0)
    listed.say("b", "over", LOW, 5.0)
    assert listed.standing == (Alarm("b", "over", LOW, 5.0, returned_s=5.0),)
    assert listed.acknowledge("b", "Ada", 6.0) and listed.standing == ()
    assert noted == [
        (AlarmRaised("a", "hot", HIGH), 1.0), (AlarmAcknowledged("a", "Ada"), 2.0), (AlarmReturned("a"), 3.0),
        (AlarmRaised("b", "over", LOW), 5.0), (AlarmReturned("b"), 5.0), (AlarmAcknowledged("b", "Ada"), 6.0),
    ]  # fmt: skip


def test_a_trouble_is_as_urgent_as_it_says_and_high_where_it_says_nothing_that_can_be_read() -> None:
    listed, noted = alarms()
    troubles = Troubles(listed)
    troubles.begin(Trouble("recovery:a", "unexplained", LOW), 1.0)
    troubles.begin(Trouble("recovery:b", "broken"), 2.0)
    troubles.begin(Trouble("recovery:c", "forged", "none at all"), 3.0)  # type: ignore[arg-type]
    assert [event.priority for event, _ in noted] == [LOW, HIGH, HIGH]


def test_troubles_under_ever_new_names_do_not_fill_the_list_for_ever() -> None:
    listed, _ = alarms()
    troubles = Troubles(listed)
    for n in range(LISTED):
        troubles.begin(Trouble(f"recovery:{n}", "over at once"), float(n))
        troubles.end(Settled(f"recovery:{n}"), float(n))
    with pytest.raises(ValueError, match="nobody has acknowledged"):
        troubles.begin(Trouble("recovery:new", "one more"), 1e3)
    troubles.begin(Trouble("recovery:7", "again"), 1e3)
    assert listed.lasts("recovery:7") and len(listed.standing) == LISTED
    assert listed.acknowledge("recovery:8", "Ada", 1e3)
    troubles.begin(Trouble("recovery:new", "one more"), 1e3)
    assert listed.lasts("recovery:new")


def test_a_trouble_that_becomes_urgent_is_raised_anew_once_it_was_settled() -> None:
    listed, noted = alarms()
    troubles = Troubles(listed)
    for message in (Trouble("recovery:a", "seen", LOW), Trouble("recovery:a", "near", HIGH)):
        troubles.begin(message, 1.0)
    assert [event.priority for event, _ in noted] == [LOW]
    troubles.end(Settled("recovery:a"), 2.0)
    troubles.begin(Trouble("recovery:a", "near", HIGH), 2.0)
    (standing,) = listed.standing
    assert (standing.priority, standing.cause, standing.returned_s) == (HIGH, "near", None)
