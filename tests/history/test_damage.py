"""A file that is damaged, or cannot become a table, costs itself alone: the rest is joined, dropped and read."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from homeostat.history.embedded.layout import EVENTS, RAW, TableFile, listed, segments_of
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.embedded.tidying import Tidying
from homeostat.history.samples import ALWAYS, Batch
from homeostat.history.settings import HistorySettings
from homeostat.history.store import HistoryError, Occurrence
from homeostat.history.times import read_duration
from tests.contracts.history_store import T0, S, batch, plain

HOUR = 3600 * S
HOUR_0 = T0 // HOUR * HOUR
"""The beginning of an hour."""
TWO_HOURS = HistorySettings(raw_days=2 / 24)
FEW = 128
"""Files that a process may open, and tables that it has to join."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "history"


def sample(at_us: int) -> Batch:
    return batch(plain("T1", at_us, 1.0), own_us=at_us)


def fill(folder: Path, hour: int, settings: HistorySettings = TWO_HOURS) -> tuple[str, ...]:
    """Three segments of an hour; what was told."""
    with EmbeddedStore(folder, settings) as store:
        for k in range(3):
            store.append(sample(HOUR_0 + hour * HOUR + k * 700 * S))
    return store.take_troubles()


def cut(table: TableFile) -> None:
    content = table.path.read_bytes()
    table.path.write_bytes(content[: len(content) // 2])


def test_a_damaged_table_keeps_no_other_from_being_joined_and_dropped(folder: Path) -> None:
    fill(folder, 0, HistorySettings())
    cut(listed(folder, RAW).tables[0])
    told = [*fill(folder, 1), *fill(folder, 2), *fill(folder, 3), *fill(folder, 9)]
    assert [t.label[-2:] for t in listed(folder, RAW).tables] == [f"{(HOUR_0 // HOUR + 9) % 24:02d}"] * 3
    assert any("is damaged" in line and "move it out of the history" in line for line in told)


def test_a_damaged_table_is_named_by_whoever_reads_it_and_the_rest_can_be_read(folder: Path) -> None:
    fill(folder, 0)
    fill(folder, 1)
    damaged = listed(folder, RAW).tables[0]
    cut(damaged)
    with pytest.raises(HistoryError, match=f"{damaged.path.name}' is damaged .*; move it out of the history"):
        EmbeddedHistory(folder).read(["T1"], ALWAYS)
    damaged.path.unlink()
    assert EmbeddedHistory(folder).read(["T1"], ALWAYS)["T1"].length >= 3


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" + bytes(100) + b"PAR1", b"no table at all" * 50])
def test_whatever_a_table_holds_is_one_line(folder: Path, content: bytes) -> None:
    fill(folder, 0)
    table = listed(folder, RAW).tables[0]
    table.path.write_bytes(content)
    with pytest.raises(HistoryError, match="is damaged") as refused:
        EmbeddedHistory(folder).last(["T1"])
    assert "\n" not in str(refused.value)


def test_half_a_character_in_an_event_is_kept_as_an_escape(folder: Path) -> None:
    with EmbeddedStore(folder) as store:
        store.record(Occurrence(T0, T0, "alarm", "recovery:\udcff", 400, "the file '\udcff' cannot be used"))
        store.append(sample(T0))
    assert not segments_of(folder)
    assert listed(folder, EVENTS).tables
    (found,) = EmbeddedHistory(folder).occurrences(ALWAYS)
    assert found.text == r"the file '\udcff' cannot be used"


def test_a_segment_of_which_no_table_can_be_made_stays_and_those_behind_it_become_tables(folder: Path) -> None:
    with EmbeddedStore(folder) as store:
        for k in range(3):
            store.append(sample(HOUR_0 + k * 700 * S))
            store.record(Occurrence(HOUR_0, HOUR_0 + k * 700 * S, "alarm", "T1", 400, "high"))
        first, told = segments_of(folder)[0], list[str]()
        unfit = Occurrence(2**70, HOUR_0, "alarm", "T1", 400, "a time that no table holds")
        store.record(unfit)
    left = segments_of(folder)
    assert len(left) == 1 and left[0].number > first.number
    tidying = Tidying(folder, HistorySettings(), told.append)
    for _ in range(3):
        tidying.tidy(left[0].number + 1, "", HOUR_0)
    assert len(told) == 1 and "stays in the log" in told[0]
    assert len(EmbeddedHistory(folder).occurrences(ALWAYS)) == 3
    assert EmbeddedHistory(folder).read(["T1"], ALWAYS)["T1"].length == 3


def fill_with_few_files(folder: Path) -> None:
    """A process that may open few files: a service has 1024, and an hour of small segments 3600 tables."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (FEW, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
    with EmbeddedStore(folder, HistorySettings(segment_s=1.0)) as store:
        for k in range(FEW):
            store.append(sample(HOUR_0 + k * 1_500_000))
            store.sync()
    print(fill(folder, 2))


def test_more_tables_than_a_process_may_open_are_joined(folder: Path) -> None:
    script = "import sys; from tests.history.test_damage import *; fill_with_few_files(Path(sys.argv[1]))"
    done = subprocess.run([sys.executable, "-c", script, str(folder)], capture_output=True, text=True, timeout=60)
    assert (done.stdout, done.returncode) == ("()\n", 0), done.stderr
    assert len([t for t in listed(folder, RAW).tables if t.to_us < HOUR_0 + HOUR]) == 1
    assert EmbeddedHistory(folder).read(["T1"], ALWAYS)["T1"].length == FEW + 3


@pytest.mark.parametrize("text", ["1" * 400 + "d", "9" * 19 + "s", "0." + "1" * 400 + "s"])
def test_a_duration_that_is_no_number_of_a_machine_is_refused(text: str) -> None:
    with pytest.raises(HistoryError, match="is no duration; write it as 90s, 30m, 8h or 7d"):
        read_duration(text)
