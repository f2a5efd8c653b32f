"""What the server has said: what is a sample, what was missed, and since when a node says so."""

from __future__ import annotations

import math
import pickle
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from typing import Any, cast

import pytest

from homeostat.domain.snapshot import Snapshot
from homeostat.links.opcua.connection.board import Board, NodeReading
from homeostat.links.opcua.connection.keeper import Keeper
from homeostat.links.opcua.mapping import LinkMapping, mapping_of
from homeostat.links.opcua.reading.node_sample import NodeSample
from homeostat.links.opcua.reading.process_time import ProcessTime
from homeostat.links.opcua.reading.samples import Samples
from homeostat.links.opcua.reading.source import OpcuaSource
from homeostat.service.attached.source import Onward
from homeostat.service.historian.observed import Observed
from tests.equipment.opcua.tank import RULES

COUNTER, TIME, LEVEL = "ns=2;s=Counter", "ns=2;s=Time", "ns=2;s=L"


def mapping(guard: dict[str, str], **level: object) -> LinkMapping:
    url = "opc.tcp://127.0.0.1:1/"
    return mapping_of({"connection": {"url": url}, "guard": guard, "tags": {"L": {"node": LEVEL, **level}}}, "m")


def said(value: Any, source_at: datetime | None = None, status: int = 0) -> NodeReading:
    return NodeReading(value, status, source_at, None, time.monotonic(), datetime.now(UTC))


def reader(board: Board, of: LinkMapping) -> OpcuaSource:
    keeper = cast(Keeper, SimpleNamespace(up=True, trouble=""))
    return OpcuaSource(keeper, board, of, Samples(of, RULES, 1.0), ProcessTime(1.0))


@contextmanager
def published(board: Board, every_s: float, batch: Callable[[int], dict[str, NodeReading]]) -> Iterator[None]:
    over = threading.Event()

    def publish() -> None:
        number = 0
        while not over.wait(every_s):
            board.put(batch(number))
            number += 1

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def read_for(source: OpcuaSource, seconds: float) -> list[Snapshot]:
    found, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        if (seen := source.advance()) is not None:
            found.append(seen)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    "guard",
    [{}, {"counter": COUNTER}, {"time": TIME}, {"counter": COUNTER, "time": TIME}],
    ids=["nothing", "counter", "time", "both"],
)
def test_batches_come_faster_than_ticks_and_process_time_keeps_to_the_clock(guard: dict[str, str]) -> None:
    board = Board(guard.get("counter") or guard.get("time"), 1.0)
    source = reader(board, mapping(guard))
    begin = time.monotonic()

    def batch(number: int) -> dict[str, NodeReading]:
        shown = {"counter": said(number), "time": said(time.monotonic() - begin + 50.0)}
        return {LEVEL: said(float(number))} | {guard[key]: shown[key] for key in guard}

    with published(board, 0.1, batch):
        found = read_for(source, 4.0)
    assert 3 <= len(found) <= 6
    assert found[-1].at_s - found[0].at_s <= 5.0, "no second of the plant is longer than ours"


def test_who_begins_to_read_late_begins_with_the_newest_sample_and_misses_none_before_it() -> None:
    board = Board(COUNTER)
    source = reader(board, mapping({"counter": COUNTER, "time": TIME}))
    source.skip()
    for number in range(1, 8):
        board.put({COUNTER: said(number), TIME: said(float(number)), LEVEL: said(float(number))})
    source.skip()
    sample = source.advance()
    assert sample is not None and sample.values["L"] == 7.0 and source.missed == 0
    board.put({COUNTER: said(8), TIME: said(8.0), LEVEL: said(8.0)})
    source.skip()
    sample = source.advance()
    assert sample is not None and sample.values["L"] == 8.0 and source.missed == 0


def test_what_the_counter_has_skipped_is_missed() -> None:
    board = Board(COUNTER)
    source = reader(board, mapping({"counter": COUNTER, "time": TIME}))
    for count in (1, 2, 9):
        board.put({COUNTER: said(count), TIME: said(float(count)), LEVEL: said(float(count))})
    found = [source.advance(), source.advance()]
    assert [seen and seen.values["L"] for seen in found] == [2.0, 9.0] and source.missed == 6


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf])
def test_a_counter_without_a_number_loses_no_sample(odd: float) -> None:
    board = Board(COUNTER)
    source = reader(board, mapping({"counter": COUNTER, "time": TIME}))
    for at, count in enumerate((1.0, 2.0, odd, 4.0, 5.0)):
        board.put({COUNTER: said(count), TIME: said(float(at)), LEVEL: said(float(at))})
    found = [source.advance() for _ in range(4)]
    assert [seen and seen.values["L"] for seen in found] == [1.0, 2.0, 3.0, 4.0] and source.missed == 0


def test_samples_that_came_together_are_kept_with_their_own_times_and_status() -> None:
    board, of = Board(COUNTER), mapping({"counter": COUNTER, "time": TIME})
    source, observed = Onward(reader(board, of), 100.0, 1.0), Observed(of)
    begin, bad = datetime(2026, 11, 25, 13, tzinfo=UTC), 0x80310000
    board.put({COUNTER: said(0), TIME: said(0.0), LEVEL: said(0.0)})
    for count in range(1, 6):  # one publish of a plant that goes faster than its server publishes
        at = begin + timedelta(seconds=count)
        level = said(float(count), at, bad if count == 3 else 0)
        board.put({COUNTER: said(count, at), TIME: said(float(count), at), LEVEL: level})
    found = []
    for _ in range(5):
        sample = source.advance()
        assert isinstance(sample, NodeSample)
        assert type(pickle.loads(pickle.dumps(sample))) is Snapshot, "who thinks is told of the plant alone"
        found.append(observed.batch(sample))
    level_row = found[0].tags.index("L")
    assert [each.value[level_row] for each in found] == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert [each.quality[level_row] for each in found] == [0, 0, bad, 0, 0]
    first_us = round(begin.timestamp() * 1e6)
    assert [each.time_us[level_row] - first_us for each in found] == [count * 1_000_000 for count in range(1, 6)]


def test_what_waits_is_read_one_by_one_and_a_counter_that_began_again_has_missed_nothing() -> None:
    board = Board(COUNTER)
    source = reader(board, mapping({"counter": COUNTER, "time": TIME}))
    for count in (7, 8, 9, 10, 1, 2, 4_000_000_000):
        board.put({COUNTER: said(count), TIME: said(float(count % 1000)), LEVEL: said(float(count))})
    found = [seen.values["L"] for _ in range(6) if (seen := source.advance()) is not None]
    assert found == [8.0, 9.0, 10.0, 1.0, 2.0, 4e9] and source.missed == 0


def test_a_reader_that_was_away_is_told_what_it_has_missed() -> None:
    board = Board(COUNTER)
    source = reader(board, mapping({"counter": COUNTER, "time": TIME}))
    for count in range(40):
        board.put({COUNTER: said(count), TIME: said(float(count)), LEVEL: said(float(count))})
        if count == 1:
            assert source.advance() is not None
    found = [seen.at_s for _ in range(10) if (seen := source.advance()) is not None]
    assert found == [float(count) for count in range(30, 40)] and source.missed == 28


@pytest.mark.parametrize("again", [said(5.0), said(float("nan"))], ids=["number", "no number"])
def test_a_node_that_is_only_read_again_gets_older(again: NodeReading) -> None:
    board, of = Board(None, 0.01), mapping({}, polled=True, stale_s=5.0)
    samples = Samples(of, RULES, 1.0)
    for poll in range(10):
        board.put({LEVEL: replace(again, received_s=100.0 + poll)})
    board.clear()
    board.put({LEVEL: replace(again, received_s=110.0)})
    assert samples.sample(50.0, board.readings()[1], 110.0).taken_s == {"L": 40.0}, "over a new connection, too"
    board.put({LEVEL: replace(again, received_s=111.0, source_at=datetime.now(UTC))})
    assert samples.sample(51.0, board.readings()[1], 111.0).taken_s == {}, "the same value was measured again"
    board.put({LEVEL: replace(again, received_s=120.0, status=0x40900000)})
    assert samples.sample(60.0, board.readings()[1], 120.0).taken_s == {}
