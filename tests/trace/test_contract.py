"""What every trace must do, whether it writes files or not."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from homeostat.trace import Event, Journal, MemoryTrace, Record, RunFinished, Trace, read_events
from tests.trace.samples import Health, Margin, Measured


@dataclass(frozen=True)
class Recorder:
    """A trace under test and how to read it back."""

    trace: Trace
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
    assert "wall_latency_s" not in first.timeless().fields and first.timeless().fields["tag"] == "T1"


def test_subscribers_hear_of_every_later_event(recorder: Recorder) -> None:
    heard: list[tuple[Event, float]] = []
    one, two = Measured("T1", 1.0), Measured("T2", 2.0)
    recorder.trace.record(one, 0.0)
    recorder.trace.subscribe(lambda event, at_s: heard.append((event, at_s)))
    recorder.trace.record(two, 1.0)
    assert heard == [(two, 1.0)]


def test_a_failing_subscriber_is_seen_after_the_event_is_kept(recorder: Recorder) -> None:
    def fail(event: Event, at_s: float) -> None:
        raise RuntimeError(f"no screen for {event.kind} at {at_s}")

    recorder.trace.subscribe(fail)
    with pytest.raises(RuntimeError, match="no screen for measured at 3"):
        recorder.trace.record(Measured("T1", 1.0), 3.0)
    assert len(recorder.records()) == 1


@dataclass(frozen=True)
class Numbered:
    kind: ClassVar[str] = "numbered"
    seq: int = 0


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
