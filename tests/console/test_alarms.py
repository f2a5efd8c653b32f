"""Alarms in their states, how many come at a time, and files that a spreadsheet may open."""

from __future__ import annotations

import csv
import io
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.console.events.alarms import FLOOD, AlarmState, ListedAlarm, alarm_list, as_csv
from homeostat.console.events.lines import journal_page, verified
from homeostat.console.server.asked import csv_answer
from homeostat.console.situation import situation
from homeostat.domain.alarm import Priority
from homeostat.domain.events.guard import GuardStarted
from homeostat.domain.events.people import AlarmAcknowledged, AlarmRaised, AlarmReturned, AlarmShelved, AlarmUnshelved
from homeostat.guard.watch.alarms import Alarms
from homeostat.journal.memory import Entry
from tests.console.served import Served

LOW, HIGH, CRITICAL = Priority.LOW, Priority.HIGH, Priority.CRITICAL


def after(*events: Any, at_s: float | None = None) -> Any:
    """The alarms after ``events``, one a second."""
    entries = [Entry(float(second), event) for second, event in enumerate(events)]
    return alarm_list(entries, float(len(events)) if at_s is None else at_s)


def test_an_alarm_goes_through_its_states() -> None:
    raised, seen, over = AlarmRaised("a", "hot", HIGH), AlarmAcknowledged("a", "Ada"), AlarmReturned("a")
    assert [a.state for a in after(raised).standing] == [AlarmState.UNACKNOWLEDGED]
    assert [a.state for a in after(raised, seen).standing] == [AlarmState.ACKNOWLEDGED]
    assert [a.state for a in after(raised, over).standing] == [AlarmState.RETURNED]
    for ends in ((seen, over), (over, seen)):
        found = after(raised, *ends)
        assert not found.standing and [a.state for a in found.past] == [AlarmState.NORMAL]
        assert found.past[0].acknowledged_by == "Ada" and found.past[0].raised_s == 0.0


def test_a_shelved_alarm_is_out_of_sight_with_who_why_and_until_when() -> None:
    raised, shelved = AlarmRaised("a", "hot", HIGH), AlarmShelved("a", "Bo", "known", 900.0)
    (found,) = after(raised, shelved).shelved
    assert (found.shelved_by, found.shelved_why, found.shelved_until_s) == ("Bo", "known", 900.0)
    again = after(raised, shelved, AlarmReturned("a"), AlarmRaised("a", "hotter", HIGH))
    assert [a.cause for a in again.shelved] == ["hotter"] and not again.standing
    assert after(raised, shelved, AlarmUnshelved("a", "")).standing[0].state is AlarmState.UNACKNOWLEDGED
    assert [a.state for a in after(raised, shelved, AlarmReturned("a"), AlarmAcknowledged("a", "Bo")).past] == [
        "normal"
    ]


def test_what_is_urgent_and_unseen_stands_first() -> None:
    names = {"a": LOW, "b": CRITICAL, "c": HIGH, "d": CRITICAL}
    events = [AlarmRaised(name, name, priority) for name, priority in names.items()]
    found = after(*events, AlarmAcknowledged("b", "Ada"))
    assert [a.alarm for a in found.standing] == ["d", "c", "a", "b"]
    assert [a.alarm for a in found.standing if a.first] == ["a"], "what was raised while no other lasted"


def test_many_alarms_in_ten_minutes_are_a_flood() -> None:
    events = [AlarmRaised(f"a{k}", "x", LOW) for k in range(FLOOD)]
    assert not after(*events[:-1]).flood and after(*events).flood
    assert not after(*events, at_s=700.0).flood


def test_one_that_chatters_is_counted_and_stands_once() -> None:
    events = [event for _ in range(4) for event in (AlarmRaised("a", "x", LOW), AlarmReturned("a"))]
    found = after(*events)
    assert [a.times for a in found.standing] == [4] and len(found.past) == 3


def test_after_a_guard_that_began_again_nothing_stands_that_it_has_not_raised() -> None:
    began = GuardStarted("p", "c", "observe", "plant", True)
    events = (AlarmRaised("a", "x", HIGH), AlarmShelved("a", "Bo", "known", 900.0), began)
    assert not after(*events).standing and not after(*events).shelved
    assert [a.alarm for a in after(*events, AlarmRaised("a", "x", HIGH)).standing] == ["a"]
    assert situation([Entry(0.0, event) for event in events]).alarms == {}


@given(st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(["raise", "return", "see"])), max_size=30))
def test_what_stands_is_what_the_guards_own_list_has(steps: list[tuple[str, str]]) -> None:
    entries: list[Entry] = []
    own = Alarms(lambda event, at_s: entries.append(Entry(at_s, event)))
    for second, (name, what) in enumerate(steps):
        match what:
            case "raise":
                own.raise_(name, "x", HIGH, float(second))
            case "return":
                own.return_(name, float(second))
            case _:
                own.acknowledge(name, "Ada", float(second))
    found = {a.alarm: (a.raised_s, a.returned_s) for a in alarm_list(entries, 100.0).standing}
    assert found == {a.id: (a.raised_s, a.returned_s) for a in own.standing}


@pytest.mark.parametrize("text", ["=1+1", "+cmd", "-2", "@x", '=HYPERLINK("http://x","y")', "\t=1"])
def test_a_file_has_texts_and_no_formula(text: str) -> None:
    alarm = ListedAlarm("a", text, "high", AlarmState.NORMAL, 1.0)
    (_, row) = csv.reader(io.StringIO(as_csv([alarm])))
    assert row[-1] == f"'{text}" and row[0] == "a"


def test_the_journal_is_browsed_and_verified(console: Served) -> None:
    told = console.ask("/api/journal").json
    numbers = [line["number"] for line in told["lines"]]
    assert numbers == sorted(numbers, reverse=True) and "diagnosed" in told["kinds"] and not told["trouble"]
    assert "run-started" not in told["kinds"] and "cool_stuck_closed" not in str(told["lines"][-1])
    only = console.ask("/api/journal?kind=diagnosed&words=COOL").json["lines"]
    assert only and all(line["kind"] == "diagnosed" and "cool" in line["text"] for line in only)
    older = console.ask(f"/api/journal?before={numbers[-1]}").json["lines"]
    assert all(line["number"] < numbers[-1] for line in older)
    said = console.ask("/api/verified").json
    assert said["whole"] and said["closed"] and "unaltered" in said["text"]


def test_an_altered_journal_is_said_to_be(recovered_run: Any, tmp_path: Any) -> None:
    lines = (recovered_run / "events.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "events.jsonl").write_bytes(b"".join([*lines[:10], *lines[11:]]))
    said = verified(tmp_path)
    assert not said.whole and said.text.startswith("ALTERED: line 11")
    page = journal_page(tmp_path, frozenset(), "", None)
    assert page.lines[0].number == 10 and "line 11" in page.trouble


def test_readings_and_alarms_are_taken_away_as_files(console: Served) -> None:
    answer = console.ask("/api/readings.csv?tag=T1&tag=T1.sp&from=900&to=910")
    rows = list(csv.reader(io.StringIO(answer.body.decode())))
    assert answer.headers["content-disposition"] == 'attachment; filename="readings.csv"'
    assert rows[0] == ["time_s", "T1", "T1.sp"] and [float(row[0]) for row in rows[1:]] == [
        900.0 + k for k in range(11)
    ]
    assert console.ask("/api/alarms.csv").body.startswith(b"alarm,priority,state")
    assert console.ask("/api/readings.csv?tag=../x").status == 400 and console.ask("/api/readings.csv").status == 400


def test_half_a_character_in_an_alarm_is_exported_as_its_escape() -> None:
    standing = after(AlarmRaised("a", "half of \ud83d", HIGH), AlarmRaised("b", "45 °C", LOW)).standing
    answer = csv_answer(as_csv(standing), "alarms.csv")
    rows = list(csv.reader(io.StringIO(bytes(answer.body).decode())))
    assert [row[-1] for row in rows[1:]] == ["half of \\ud83d", "45 °C"]


def test_a_file_has_every_alarm_and_a_list_says_how_many_it_leaves_out() -> None:
    entries = [
        Entry(float(n), event)
        for n in range(700)
        for event in (AlarmRaised("a", f"cause {n}", Priority.LOW), AlarmAcknowledged("a", "Ada"), AlarmReturned("a"))
    ]
    listed, whole = alarm_list(entries, 700.0), alarm_list(entries, 700.0, None)
    assert (len(listed.past), listed.over, len(whole.past), whole.over) == (500, 700, 700, 700)
    assert len(as_csv(whole.past).splitlines()) == 701
