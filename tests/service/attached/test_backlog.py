"""What waits for the historian: samples go before alarms and events, and whoever lost something says how much."""

from __future__ import annotations

from multiprocessing.connection import Client
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.observation import Message, Settled, Trouble
from homeostat.history.samples import Batch
from homeostat.history.store import Occurrence
from homeostat.service.attached.place import HISTORY
from homeostat.service.historian import backlog
from homeostat.service.historian.backlog import MOST, MOST_EVENTS, Backlog
from homeostat.service.historian.line import LOST, HistoryLine
from homeostat.service.historian.messages import LARGEST, Back, Kept, from_guard, to_guard
from tests.equipment.opcua.attached import until


def sample(number: int) -> Batch:
    times = np.full(1, number, dtype=np.int64)
    return Batch(("T",), times, np.full(1, float(number)), np.zeros(1, dtype=np.uint32), times, number)


def event(number: int) -> Occurrence:
    return Occurrence(number, number, "alarm-raised", "T", 1, f"number {number}")


def test_events_outlive_samples() -> None:
    waiting = Backlog()
    waiting.put(Kept(1, event(1)))
    for number in range(2, MOST + 12):
        waiting.put(Kept(number, sample(number)))
    assert (waiting.lost, len(waiting)) == ("10 samples", MOST + 1)
    first = waiting.after(0)
    assert first is not None and first.what == event(1)
    following = waiting.after(1)
    assert following is not None and following.number == 12, "the oldest samples are the ones that went"


def test_where_there_are_too_many_events_every_sample_goes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(backlog, "MOST_EVENTS", 5)
    waiting = Backlog()
    for number in range(1, 4):
        waiting.put(Kept(number, sample(number)))
    for number in range(4, 9):
        waiting.put(Kept(number, event(number)))
    assert (waiting.lost, len(waiting)) == ("3 samples", 5)
    waiting.put(Kept(9, event(9)))
    assert waiting.lost == "3 samples and 1 event"


@given(st.lists(st.booleans(), max_size=40), st.integers(0, 40))
def test_what_waits_is_given_out_in_its_order_and_taken_up_to_a_number(samples: list[bool], taken: int) -> None:
    waiting, found = Backlog(), list[int]()
    for number, is_sample in enumerate(samples, 1):
        waiting.put(Kept(number, sample(number) if is_sample else event(number)))
    waiting.take(taken)
    while (following := waiting.after(found[-1] if found else 0)) is not None:
        found.append(following.number)
    assert found == list(range(taken + 1, len(samples) + 1)) and len(waiting) == len(found) and waiting.lost == ""
    assert MOST < MOST_EVENTS


def test_a_gap_is_an_alarm_that_says_how_large_it_is(tmp_path: Path) -> None:
    told = list[Message]()
    room = iter([False])

    def put(message: Message) -> bool:
        if next(room, True):
            told.append(message)
            return True
        return False

    line = HistoryLine(tmp_path / HISTORY, put)
    line.keep(event(1))
    for number in range(MOST + 7):
        line.keep(sample(number))
    line.miss()
    (begun,) = told
    assert isinstance(begun, Trouble) and begun.name == LOST and "older ones are lost" in begun.cause
    with Client(str(tmp_path / HISTORY), family="AF_UNIX") as historian:
        came = [from_guard(historian.recv_bytes(LARGEST)) for _ in range(MOST + 1)]
        assert came[0].what == event(1) and [kept.number for kept in came[1:]] == list(range(9, MOST + 9))
        historian.send_bytes(to_guard(Back(came[-1].number, "")))
        until(lambda: len(told) == 4, "the count is told", 10.0)
    ended, counted, over = told[1:]
    assert ended == over == Settled(LOST)
    assert isinstance(counted, Trouble) and "8 samples since the guard began were lost" in counted.cause
    line.close(0.0)
