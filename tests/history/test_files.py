"""The files of a store: others read them as they are, they grow together, they go when the settings say so."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import numpy as np
import polars
import pytest

from benchmarks.history.plant import PlantReadings
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS, Batch, Span
from homeostat.history.settings import HistorySettings, read_settings
from homeostat.history.store import HistoryError, Occurrence
from tests.cli.command import environment
from tests.contracts.history_store import T0, S, batch, expected_of, plain, rows_of

REPO = Path(__file__).resolve().parents[2]
TAGS = 30


@pytest.fixture(scope="module")
def appended(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Batch]]:
    """A store with two hours and a half of a small plant."""
    folder = tmp_path_factory.mktemp("store") / "history"
    batches = list(PlantReadings(TAGS, T0).hour(9000))
    with EmbeddedStore(folder) as store:
        for one in batches:
            store.append(one)
        store.record(Occurrence(T0, batches[-1].own_us, "alarm", "LIM", 900, "hot"))
    return folder, batches


def test_hours_that_are_over_are_one_file_each(appended: tuple[Path, list[Batch]]) -> None:
    folder, _ = appended
    hours = [path.name.partition(".")[0] for path in sorted((folder / "raw").iterdir())]
    assert hours[:2] == ["2025-11-24T16", "2025-11-24T17"] and hours[2:] == ["2025-11-24T18"] * 3
    assert not list((folder / "log").iterdir())


def test_duckdb_reads_them_as_they_are(appended: tuple[Path, list[Batch]]) -> None:
    folder, batches = appended
    tag = batches[0].tags[3]
    with duckdb.connect() as database:
        database.execute("SET TimeZone = 'UTC'")
        rows = database.execute(
            f"SELECT epoch_us(time), value, quality, epoch_us(server_time), epoch_us(own_time) "
            f"FROM '{folder}/raw/*.parquet' JOIN '{folder}/arrivals/*.parquet' USING (arrival) "
            f"WHERE tag = '{tag}' ORDER BY time"
        ).fetchall()
        [(good, least)] = database.execute(
            f"SELECT sum(good), min(minimum) FROM '{folder}/minutes/*.parquet' WHERE tag = '{tag}'"
        ).fetchall()
        [(text,)] = database.execute(f"SELECT text FROM '{folder}/events/*.parquet'").fetchall()
    assert [(t, np.float64(v).tobytes(), q, s, o) for t, v, q, s, o in rows] == expected_of(batches, tag)
    column = [(float(b.value[3]), int(b.quality[3])) for b in batches]
    assert good == sum(code == 0 for _, code in column) and least == min(v for v, code in column if code == 0)
    assert text == "hot"


def test_polars_reads_them_as_they_are(appended: tuple[Path, list[Batch]]) -> None:
    folder, batches = appended
    tag = batches[0].tags[0]
    table = polars.scan_parquet(folder / "raw" / "*.parquet").filter(polars.col("tag") == tag).sort("time").collect()
    assert table["value"].to_list() == [float(b.value[0]) for b in batches]
    assert table.schema["time"] == polars.Datetime("us", "UTC") and table.schema["tag"] == polars.String


def test_they_are_sorted_by_tag_and_then_by_time(appended: tuple[Path, list[Batch]]) -> None:
    folder, _ = appended
    for path in (folder / "raw").iterdir():
        table = polars.read_parquet(path)
        assert table.select("tag", "time").equals(table.select("tag", "time").sort("tag", "time"))


def test_a_sample_takes_less_than_three_bytes(tmp_path: Path) -> None:
    with EmbeddedStore(tmp_path) as store:
        for one in PlantReadings(200, T0).hour(3700):
            store.append(one)
    hour = [path for path in tmp_path.rglob("2025-11-24*.parquet") if "T17" not in path.name]
    assert {path.parent.name for path in hour} == {"raw", "arrivals", "minutes"} and len(hour) == 3
    raw = next(path for path in hour if path.parent.name == "raw")
    samples = polars.scan_parquet(raw).select(polars.len()).collect().item()
    assert sum(path.stat().st_size for path in hour) < 3.0 * samples


def days(folder: Path, settings: HistorySettings, number: int, gap_s: int = 86_400) -> EmbeddedStore:
    """A store, closed and opened again, to which one sample a day and an alarm were added."""
    with EmbeddedStore(folder, settings) as store:
        for k in range(number):
            now = T0 + k * gap_s * S
            store.append(batch(*(plain("T1", now + n, float(n)) for n in range(500)), own_us=now))
            store.record(Occurrence(now, now, "alarm", "LIM", 900, str(k)))
    return EmbeddedStore(folder, settings)


def test_what_is_older_than_the_settings_keep_goes_and_events_stay(tmp_path: Path) -> None:
    settings = HistorySettings(raw_days=3.0, minutes_days=6.0)
    with days(tmp_path, settings, 10) as store:
        kept, minutes = store.read(["T1"], ALWAYS)["T1"], store.minutes(["T1"], ALWAYS)["T1"]
        assert kept.length == 4 * 500 and kept.time_us[0] == T0 + 6 * 86_400 * S
        assert minutes.length in (7, 8) and len(store.occurrences(ALWAYS)) == 10
        assert store.take_troubles() == ()


def test_the_oldest_samples_go_where_there_are_too_many(tmp_path: Path) -> None:
    with days(tmp_path, HistorySettings(raw_bytes=1e5), 130, gap_s=3600) as store:
        size = sum(path.stat().st_size for path in (tmp_path / "raw").iterdir())
        kept = store.read(["T1"], ALWAYS)["T1"]
        assert 0.8e5 < size <= 1e5 and 0 < kept.length < 130 * 500
        assert kept.time_us[-1] == T0 + 129 * 3600 * S + 499 and len(store.occurrences(ALWAYS)) == 130
        assert store.minutes(["T1"], ALWAYS)["T1"].count.sum() == 130 * 500


def test_one_clock_that_jumps_ahead_makes_nothing_old(tmp_path: Path) -> None:
    with EmbeddedStore(tmp_path) as store:
        store.append(batch(plain("T1", T0, 1.0)))
        store.append(batch(plain("T1", T0 + S, 2.0), own_us=T0 + 50 * 365 * 86_400 * S))
    with EmbeddedStore(tmp_path) as store:
        store.append(batch(plain("T1", T0 + 2 * S, 3.0), own_us=T0 + 50 * 365 * 86_400 * S))
        store.retain()
        assert store.read(["T1"], ALWAYS)["T1"].value.tolist() == [1.0, 2.0, 3.0]


FILLING = """
import sys, time
from pathlib import Path
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS
from homeostat.history.settings import HistorySettings
from homeostat.history.store import Occurrence
from benchmarks.history.plant import PlantReadings
from tests.contracts.history_store import T0

store = EmbeddedStore(sys.argv[1], HistorySettings(segment_s=100.0))
count = 0
for one in PlantReadings(200, T0).hour(9000):
    store.append(one)
    count += 1
    while len(list((Path(sys.argv[1]) / "log").iterdir())) > 3:
        time.sleep(0.01)
    if count % 1500 == 0:
        store.record(Occurrence(one.own_us, one.own_us, "alarm", "LIM", 900, str(count)))
store.close()
troubles = store.take_troubles()
assert troubles and all("the disk is full: the oldest " in line for line in troubles), troubles
store = EmbeddedStore(sys.argv[1])
kept = store.read(store.tags()[:1], ALWAYS)[store.tags()[0]]
assert [o.text for o in store.occurrences(ALWAYS)] == [str(1500 * k) for k in range(1, 7)]
assert 100 < kept.length < 9000 and (kept.time_us[1:] - kept.time_us[:-1]).max() < 1_100_000
store.close()
print("kept", kept.length)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux" or shutil.which("unshare") is None, reason="needs a small disk of its own")
def test_on_a_full_disk_the_oldest_samples_go_and_alarms_stay(tmp_path: Path) -> None:
    """Two and a half hours, of which the disk holds one and the room to join it: whole hours go."""
    mount = f"mount -t tmpfs -o size=4000k tmpfs {tmp_path}"
    if subprocess.run(["unshare", "-rm", "sh", "-c", mount], capture_output=True).returncode:
        pytest.skip("no disk of its own may be mounted here")
    surroundings = environment() | {"PYTHONPATH": f"{environment()['PYTHONPATH']}:{REPO}"}
    words = [sys.executable, "-c", FILLING, str(tmp_path / "history")]
    command = ["unshare", "-rm", "sh", "-c", f'{mount} && exec "$@"', "sh", *words]
    done = subprocess.run(command, capture_output=True, text=True, env=surroundings, cwd=REPO, timeout=240)
    assert done.returncode == 0 and done.stdout.startswith("kept "), done.stderr


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("raw_dais = 3", "has 'raw_dais', which is no setting; did you mean 'raw_days'"),
        ("raw_days = -1", "raw_days = -1 must be a number from 0.0416667 to 36500 d"),
        ("sync_s = true", "sync_s = True must be a number from 0.01 to 60 s"),
        ("raw_days = = 3", "is no TOML"),
        ("raw_days = " + 5000 * "9", "is no TOML"),
        ("raw_days = " + 5000 * "[" + 5000 * "]", "is no TOML"),
    ],
)
def test_settings_that_are_wrong_are_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "history.toml").write_text(text)
    with pytest.raises(HistoryError) as caught:
        EmbeddedStore(tmp_path)
    assert words in str(caught.value) and "\n" not in str(caught.value) and "history.toml" in str(caught.value)


def test_settings_in_the_folder_are_those_of_the_store(tmp_path: Path) -> None:
    (tmp_path / "history.toml").write_text("raw_days = 3\n")
    assert read_settings(tmp_path) == HistorySettings(raw_days=3)
    EmbeddedStore(tmp_path).close()
    assert EmbeddedHistory(tmp_path).extent() is None


@pytest.mark.slow
def test_joining_hours_changes_nothing_that_is_read(tmp_path: Path) -> None:
    every = [batch(plain("T1", T0 + k * 60 * S, float(k)), own_us=T0 + k * 60 * S) for k in range(300)]
    with EmbeddedStore(tmp_path, HistorySettings(segment_s=120.0)) as store:
        for one in every:
            store.append(one)
            part = Span(T0, one.own_us + 1)
            assert store.read(["T1"], part)["T1"].length == int((one.own_us - T0) // (60 * S)) + 1
    assert rows_of(EmbeddedHistory(tmp_path).read(["T1"], ALWAYS)["T1"]) == expected_of(every, "T1")
    assert len(list((tmp_path / "raw").iterdir())) < 40  # of 150 segments
