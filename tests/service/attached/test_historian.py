"""The historian beside a guard: what it has acknowledged is kept once, whoever dies, and no disk holds the guard up."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from multiprocessing.connection import Client
from pathlib import Path
from statistics import median

import numpy as np
import pytest

pytest.importorskip("asyncua", reason="the extra 'opcua' is not installed")

from homeostat.domain.observation import Message, Settled, Trouble
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.quality import BAD
from homeostat.history.samples import ALWAYS, NO_TIME, Batch
from homeostat.history.store import Occurrence
from homeostat.links.opcua.connection.board import NodeReading
from homeostat.links.opcua.reading.node_sample import NodeSample
from homeostat.service.attached.place import HISTORY
from homeostat.service.historian import line as lines
from homeostat.service.historian.line import HistoryLine
from homeostat.service.historian.observed import PROCESS_TIME, WRONG_TYPE, Observed
from tests.cli.command import environment
from tests.equipment.opcua.attached import until
from tests.equipment.opcua.tank import tank_mapping

pytestmark = pytest.mark.slow

TAGS = ("T", "L", PROCESS_TIME)
BEGIN = datetime(2026, 11, 25, 13, tzinfo=UTC)


def batch(number: int) -> Batch:
    """Samples of second ``number``, whose values say which one it is."""
    now_us = time.time_ns() // 1000
    times = np.full(len(TAGS), now_us, dtype=np.int64)
    return Batch(TAGS, times, np.full(len(TAGS), float(number)), np.zeros(len(TAGS), dtype=np.uint32), times, now_us)


class Historian:
    """The real process, and the guard's end of its line."""

    def __init__(self, directory: Path, folder: Path) -> None:
        self.messages: list[Message] = []
        self.line = HistoryLine(directory / HISTORY, self.messages.append)
        self._command = [sys.executable, "-m", "homeostat.service.historian", str(directory), str(folder)]
        self.start()

    def start(self) -> None:
        listens, says = os.pipe()
        self.process = subprocess.Popen(
            [*self._command, str(says), str(os.getpid())], pass_fds=(says,), env=environment()
        )
        os.close(says)
        os.close(listens)

    def end(self) -> None:
        self.line.close(5.0)
        self.process.terminate()
        assert self.process.wait(30.0) == 0


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "history"


@pytest.fixture
def historian(tmp_path: Path, folder: Path) -> Iterator[Historian]:
    made = Historian(tmp_path, folder)
    yield made
    made.line.close(0.0)
    made.process.kill()
    made.process.wait(30.0)


def kept(folder: Path, tag: str = "T") -> list[float]:
    return EmbeddedHistory(folder).read([tag], ALWAYS)[tag].value.tolist()


def test_a_historian_that_is_killed_loses_nothing_and_keeps_nothing_twice(historian: Historian, folder: Path) -> None:
    numbers = itertools.count()
    for _ in range(4):
        until(lambda: historian.line._connection, "a historian", 30.0)
        for _ in range(150):
            historian.line.keep(batch(next(numbers)))
            time.sleep(0.002)
        historian.process.kill()
        historian.process.wait(30.0)
        historian.line.keep(Occurrence(1, time.time_ns() // 1000, "test", "T", 1, "while nobody was there"))
        historian.start()
    until(lambda: not historian.line._waiting, "everything is kept", 30.0)
    historian.end()
    assert kept(folder) == [float(n) for n in range(next(numbers))] and historian.line._waiting.lost == ""
    assert len(EmbeddedHistory(folder).occurrences(ALWAYS)) >= 4
    assert historian.messages == [] or isinstance(historian.messages[-1], Settled)


def test_without_a_historian_the_guard_goes_on_and_says_so(
    historian: Historian, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lines, "AWAY_S", 0.3)
    historian.process.send_signal(signal.SIGKILL)
    historian.process.wait(30.0)
    took: list[float] = []
    for number in range(lines.MOST + 10):
        began = time.monotonic()
        historian.line.keep(batch(number))
        took.append(time.monotonic() - began)
    assert median(took) < 2.0 / len(took) and historian.line._waiting.lost_samples == 10

    def is_told() -> bool:
        historian.line.keep(batch(0))
        return any(isinstance(m, Trouble) and "no historian" in m.cause for m in historian.messages)

    until(is_told, "an alarm", 30.0)
    historian.start()
    until(lambda: isinstance(historian.messages[-1], Settled), "it is settled", 30.0)


def test_a_historian_that_has_just_gone_is_not_away_for_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard may look at any instant at which the line notices that it has gone."""
    messages = list[Message]()
    line = HistoryLine(tmp_path / HISTORY, messages.append)
    line._gone_s -= 2.0 * lines.AWAY_S  # it began long ago

    def looked_at(line: HistoryLine, name: str, value: object) -> None:
        object.__setattr__(line, name, value)
        line._look()

    with Client(str(tmp_path / HISTORY), family="AF_UNIX"):
        until(lambda: line._connection, "it is there")
        monkeypatch.setattr(HistoryLine, "__setattr__", looked_at)
    until(lambda: line._connection is None, "it has gone")
    assert messages == []
    line.close(0.0)


def test_a_sample_has_the_times_and_the_status_of_its_nodes() -> None:
    observed = Observed(tank_mapping(4840))

    def reading(value: float, status: int, seconds: float) -> NodeReading:
        at = BEGIN + timedelta(seconds=seconds)
        return NodeReading(value, status, at, at + timedelta(milliseconds=5), 0.0, at)

    def at_us(seconds: float) -> int:
        return round((BEGIN + timedelta(seconds=seconds)).timestamp() * 1e6)

    nodes = {
        "ns=2;s=L": reading(10.0, 0x80310000, 1.0),
        "ns=2;s=T": reading(300.0, 0, 0.5),
        "ns=2;s=L.sp": reading(10.0, 0, 0.0),
        "ns=2;s=Plant/Counter": reading(7, 0, 1.0),
    }
    values = {"L": 10.0, "T": 300.0, "L.sp": 10.0, "cool.man": 0.0}
    first = observed.batch(NodeSample(7.0, values, bad=frozenset({"L.sp"}), readings=nodes))
    row = {tag: k for k, tag in enumerate(first.tags)}
    assert first.time_us[row["T"]] == at_us(0.5) and first.server_us[row["T"]] == at_us(0.505)
    assert first.quality[row["L"]] == 0x80310000 and first.quality[row["L.sp"]] == WRONG_TYPE
    assert first.quality[row["cool.man"]] == BAD and first.server_us[row["cool.man"]] == NO_TIME
    assert first.value[row[PROCESS_TIME]] == 7.0
    nodes = nodes | {"ns=2;s=Plant/Counter": reading(8, 0, 2.0)}
    second = observed.batch(NodeSample(8.0, values, readings=nodes))
    assert second.time_us[row["T"]] == at_us(2.0), "unchanged: shown as of the sample, and not at the old time twice"
