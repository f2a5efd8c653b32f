"""What every trace must do, whether it writes files or not."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from homeostat.journal import Event, Journal, MemoryTrace, Record, RunFinished, read_events
from tests.journal.samples import Health, Margin, Measured

pytestmark = pytest.mark.quick


@dataclass(frozen=True)
class Recorder:
    """A trace under test and how to read it back."""

    trace: Journal | MemoryTrace
    records: Callable[[], tuple[Record, ...]]


@pytest.fixture(params=["journal", "memory"])
def recorder(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Recorder]:
    if request.param == "memory":
        memory = MemoryTrace()
        yield Recorder(memory, memory.records)
    else:
        with Journal(tmp_path / "run") as journal:
            yield Recorder(journal, lambda: tuple(read_events(journal.directory)))


def test_events_come_back_in_order_with_their_times(recorder: Recorder) -> None:
    recorder.trace.record(Measured("T1", math.nan, Health.BAD, (Margin("level", -0.25),), 0.125), 1)
    recorder.trace.record(RunFinished("released"), 2.5)
    first, second = recorder.records()
    assert (first.seq, first.at_s, first.kind) == (1, 1.0, "measured")
    assert dict(first.fields) == {
        "tag": "T1",
        "value": "NaN",
        "health": "BAD",
        "margins": [{"@type": "Margin", "criterion": "level", "value": -0.25}],
        "wall_latency_s": 0.125,
    }
    assert (second.seq, second.at_s, second.kind, second.fields["outcome"]) == (2, 2.5, "run-finished", "released")


def test_subscribers_hear_of_every_later_event(recorder: Recorder) -> None:
    heard: list[tuple[Event, float]] = []
    one, two = Measured("T1", 1.0), Measured("T2", 2.0)
    recorder.trace.record(one, 0.0)
    recorder.trace.subscribe(lambda event, at_s: heard.append((event, at_s)))
    recorder.trace.record(two, 1.0)
    assert heard == [(two, 1.0)]


def test_a_failing_subscriber_loses_no_line_and_does_not_reach_the_recorder(recorder: Recorder) -> None:
    def fail(event: Event, at_s: float) -> None:
        raise RuntimeError(f"no screen for {event.kind} at {at_s}")

    heard: list[float] = []
    recorder.trace.subscribe(fail)
    recorder.trace.subscribe(lambda event, at_s: heard.append(at_s))
    recorder.trace.record(Measured("T1", 1.0), 3.0)
    assert len(recorder.records()) == 1 and heard == [3.0]
    (trouble,) = recorder.trace.take_troubles()
    assert trouble == "a subscriber failed at event 'measured', 3 s: RuntimeError: no screen for measured at 3.0"
    assert recorder.trace.take_troubles() == ()


def test_an_event_that_is_recorded_late_keeps_its_own_time(recorder: Recorder) -> None:
    heard: list[float] = []
    recorder.trace.subscribe(lambda event, at_s: heard.append(at_s))
    for at_s in (1.0, 5.0, 2.5, 5.0, 6.0):
        recorder.trace.record(Measured("T1", at_s), at_s)
    assert [r.at_s for r in recorder.records()] == [1.0, 5.0, 5.0, 5.0, 6.0]
    assert [r.happened_s for r in recorder.records()] == heard == [1.0, 5.0, 2.5, 5.0, 6.0]
    assert all("happened_s" not in r.fields for r in recorder.records())


def test_threads_record_at_once_and_the_chain_holds(recorder: Recorder) -> None:
    heard: list[tuple[str, float]] = []
    recorder.trace.subscribe(lambda event, at_s: heard.append((event.tag, event.value)))  # type: ignore[attr-defined]

    def write(tag: str) -> None:
        for number in range(200):
            recorder.trace.record(Measured(tag, float(number)), float(number))
            if number % 50 == 0:
                recorder.trace.sync()

    threads = [threading.Thread(target=write, args=(f"T{n}",)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    records = recorder.records()
    assert [r.seq for r in records] == list(range(1, 801))
    assert [r.at_s for r in records] == sorted(r.at_s for r in records)
    assert heard == [(r.fields["tag"], r.fields["value"]) for r in records]


def test_a_subscriber_may_record(recorder: Recorder) -> None:
    def answer(event: Event, at_s: float) -> None:
        if isinstance(event, Measured):
            recorder.trace.record(RunFinished("released"), at_s)

    recorder.trace.subscribe(answer)
    recorder.trace.record(Measured("T1", 1.0), 3.0)
    assert [r.kind for r in recorder.records()] == ["measured", "run-finished"]


def test_a_subscriber_that_hangs_keeps_no_other_thread_from_recording(recorder: Recorder) -> None:
    hanging, released = threading.Event(), threading.Event()

    def hang(event: Event, at_s: float) -> None:
        hanging.set()
        released.wait()

    recorder.trace.subscribe(hang)
    thread = threading.Thread(target=recorder.trace.record, args=(Measured("T1", 1.0), 1.0))
    thread.start()
    hanging.wait()
    recorder.trace.record(Measured("T2", 2.0), 2.0)
    recorder.trace.sync()
    assert len(recorder.records()) == 2
    released.set()
    thread.join()


def test_a_memory_trace_may_keep_the_latest_events_only() -> None:
    memory = MemoryTrace(most=3)
    for number in range(10):
        memory.record(Measured("T1", float(number)), float(number))
    assert [entry.at_s for entry in memory.entries] == [7.0, 8.0, 9.0]
    assert [r.seq for r in memory.records()] == [8, 9, 10] and len(memory.of(Measured)) == 3


@dataclass(frozen=True)
class Numbered:
    kind: ClassVar[str] = "numbered"
    seq: int = 0


@dataclass(frozen=True)
class Late:
    kind: ClassVar[str] = "late"
    happened_s: float = 0.0


@dataclass(frozen=True)
class Impostor:
    kind: ClassVar[str] = "measured"
    level: float = 0.0


@dataclass
class Thawed:
    kind: ClassVar[str] = "thawed"
    level: float = 0.0


@pytest.mark.parametrize(
    ("event", "at_s", "error", "message"),
    [
        (Measured("T1", 1.0), math.nan, ValueError, "'measured' at nan s: the process time must be finite"),
        (Measured("T1", 1.0), math.inf, ValueError, "must be finite"),
        (Late(), 0.0, TypeError, "'late' has a field 'happened_s'"),
        (Numbered(), 0.0, TypeError, "'numbered' has a field 'seq'"),
        (Impostor(), 0.0, TypeError, "'measured' names both 'Measured' and 'Impostor'"),
        (Thawed(), 0.0, TypeError, "'Thawed' is not a frozen dataclass"),
        (Measured("T1", object()), 0.0, TypeError, "measured.value is a 'object'"),  # type: ignore[arg-type]
    ],
)
def test_a_refused_event_leaves_no_mark(
    recorder: Recorder, event: Event, at_s: float, error: type[Exception], message: str
) -> None:
    recorder.trace.record(Measured("T1", 1.0), 0.0)
    with pytest.raises(error, match=message):
        recorder.trace.record(event, at_s)
    recorder.trace.record(Measured("T1", 2.0), 1.0)
    assert [record.fields["value"] for record in recorder.records()] == [1.0, 2.0]


def test_a_memory_trace_holds_the_very_lines_of_a_journal(tmp_path: Path) -> None:
    memory = MemoryTrace()
    with Journal(tmp_path) as journal:
        for trace in (memory, journal):
            trace.record(Measured("T1", 1.0), 0.0)
            trace.record(RunFinished("released"), 9.0)
    lines = (tmp_path / "events.jsonl").read_bytes().splitlines()
    assert tuple(read_events(tmp_path)) == memory.records()
    assert json.loads(lines[1])["prev"] != json.loads(lines[0])["prev"] == "0" * 64
    assert [entry.at_s for entry in memory.entries] == [0.0, 9.0]
    assert memory.of(RunFinished) == (RunFinished("released"),)
