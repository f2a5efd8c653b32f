"""``homeostat run --history``, ``history show`` and ``history export``: as a person uses them, and misuses them."""

from __future__ import annotations

import csv
import json
import os
import shutil
from pathlib import Path

import polars
import pyarrow.parquet as pq
import pytest

from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.store import EmbeddedStore
from homeostat.history.samples import ALWAYS, Span
from homeostat.history.store import HistoryError
from homeostat.history.times import read_duration, read_span, read_time, told_time
from homeostat.journal import read_events
from tests.cli.command import Done, homeostat, refused
from tests.cli.conftest import once
from tests.contracts.history_store import T0, S, batch, plain

SHORT = ("run", "cstr", "--fault", "cool_stuck_closed", "--onset", "900", "--end", "1050", "--thinking-declared", "1")


@pytest.fixture(scope="session")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Done:
    """A short run whose samples and events are in ``plant.history``."""
    return once(tmp_path_factory, "measured", *SHORT, "--out", "run", "--history", "plant.history")


@pytest.mark.slow
def test_a_run_adds_what_its_instruments_said(measured: Done) -> None:
    assert measured.status == 0 and "history" not in measured.err
    history = EmbeddedHistory(measured.cwd / "plant.history")
    kept = pq.read_table(measured.cwd / "run" / "trajectory.parquet").to_pydict()
    series = history.read(["T1", "V2.pos"], ALWAYS)
    assert series["T1"].length == 1050
    written = dict(zip([round(t) for t in kept["t_s"]], kept["measured T1"], strict=True))
    start_us = int(series["T1"].time_us[0]) - S
    for at_us, value in zip(series["T1"].time_us.tolist(), series["T1"].value.tolist(), strict=True):
        assert value == written[(at_us - start_us) // S]
    assert start_us % S == 0 and (series["T1"].server_us == series["T1"].time_us).all()


def test_its_alarms_and_events_are_there_with_what_was_said_of_them(measured: Done) -> None:
    found = EmbeddedHistory(measured.cwd / "plant.history").occurrences(ALWAYS)
    recorded = [r.kind for r in read_events(measured.cwd / "run") if r.kind not in ("signed", "resumed")]
    assert sorted(one.kind for one in found) == sorted("alarm" if k == "alarm-raised" else k for k in recorded)
    [diagnosis, *_] = [one for one in found if one.kind == "diagnosed"]
    assert diagnosis.source == "cstr" and diagnosis.severity == 1 and diagnosis.text != "diagnosed"
    assert "cool_stuck_closed" in diagnosis.details and json.loads(diagnosis.details)


def test_a_second_run_goes_on_after_the_first(measured: Done, tmp_path: Path) -> None:
    shutil.copytree(measured.cwd / "plant.history", tmp_path / "h")
    before = EmbeddedHistory(tmp_path / "h").extent()
    done = homeostat("run", "cstr", "--end", "400", "--thinking-declared", "1", "--history", "h", cwd=tmp_path)
    after = EmbeddedHistory(tmp_path / "h").read(["T1"], ALWAYS)["T1"]
    assert done.status == 0 and before is not None and after.length == 1450
    assert (after.time_us[1:] > after.time_us[:-1]).all()


def test_without_a_tag_the_last_value_of_each_is_shown(measured: Done) -> None:
    done = homeostat("history", "show", "--store", "plant.history", cwd=measured.cwd)
    head, _, *rows = done.out.splitlines()
    assert head.split() == ["tag", "last", "at", "value", "quality"] and len(rows) == 28
    assert [row.split()[0] for row in rows] == sorted(row.split()[0] for row in rows)


def test_a_long_span_is_shown_in_steps_and_a_short_one_sample_by_sample(measured: Done) -> None:
    words = ("history", "show", "T1", "L1", "--store", "plant.history", "--last")
    steps = homeostat(*words, "8h", cwd=measured.cwd).out.splitlines()
    assert steps[0].split() == ["tag", "from,", "1", "min", "least", "mean", "greatest", "last", "good", "of", "all"]
    assert 2 * 17 <= len(steps) - 2 <= 2 * 19
    samples = homeostat(*words, "10s", cwd=measured.cwd).out.splitlines()
    assert samples[0].split() == ["tag", "time", "value", "quality"] and len(samples) - 2 == 2 * 10
    every = homeostat(*words, "8h", "--samples", cwd=measured.cwd).out.splitlines()
    assert len(every) - 2 == 2 * 1050
    tens = homeostat(*words, "8h", "--step", "10m", cwd=measured.cwd).out.splitlines()
    assert 2 * 2 <= len(tens) - 2 <= 2 * 3


def test_json_has_the_same_numbers(measured: Done) -> None:
    words = ("history", "show", "T1", "--store", "plant.history", "--json", "--last")
    samples = json.loads(homeostat(*words, "10s", cwd=measured.cwd).out)
    kept = EmbeddedHistory(measured.cwd / "plant.history").read(["T1"], ALWAYS)["T1"]
    assert samples["step_s"] is None and samples["tags"]["T1"]["value"] == kept.value[-10:].tolist()
    steps = json.loads(homeostat(*words, "1h", cwd=measured.cwd).out)
    assert steps["step_s"] == 60 and sum(steps["tags"]["T1"]["count"]) == 1050
    assert min(steps["tags"]["T1"]["minimum"]) == kept.value.min()


def test_what_is_exported_is_what_was_measured(measured: Done, tmp_path: Path) -> None:
    store, kept = str(measured.cwd / "plant.history"), EmbeddedHistory(measured.cwd / "plant.history")
    series = kept.read(["T1"], ALWAYS)["T1"]
    done = homeostat("history", "export", "T1", "L1", "--store", store, "--out", "x.csv", cwd=tmp_path)
    assert done.status == 0 and done.out.startswith("x.csv: 2100 rows, 2 tags, ")
    with (tmp_path / "x.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["tag"] == "T1"]
    assert [float(row["value"]) for row in rows] == series.value.tolist()
    assert [read_time(row["time"]) for row in rows] == series.time_us.tolist()
    done = homeostat("history", "export", "--store", store, "--out", "x.parquet", "--minutes", cwd=tmp_path)
    table = polars.read_parquet(tmp_path / "x.parquet")
    assert done.status == 0 and table.filter(polars.col("tag") == "T1")["count"].sum() == 1050
    assert set(table["tag"]) == set(kept.tags()) and sorted(p.name for p in tmp_path.iterdir()) == [
        "x.csv",
        "x.parquet",
    ]


REFUSED = [
    (("show", "T9", "--store", "plant.history"), "has no tag 'T9'; did you mean 'T3'"),
    (("show", "T1", "--store", "nowhere"), "'nowhere' is no history; 'homeostat run CASE --history DIR' makes one"),
    (("show", "T1", "--store", "run"), "'run' is no history"),
    (("show", "T1", "--store", "plant.history", "--last", "soon"), "'soon' is no duration; write it as 90s, 30m, 8h"),
    (("show", "T1", "--store", "plant.history", "--last", "0h"), "'0h' is no duration"),
    (("show", "T1", "--store", "plant.history", "--from", "noon"), "'noon' is no time; write it as 2026-11-25T13:00"),
    (("show", "T1", "--store", "plant.history", "--from", "2300-01-01"), "is empty; correct --from or --to"),
    (("show", "T1", "--store", "plant.history", "--last", "1h", "--to", "2300-01-01"), "leave one of them out"),
    (("show", "T1", "--store", "plant.history", "--step", "90s"), "--step 90s must be whole minutes"),
    (("export", "T1", "--store", "plant.history", "--out", "run"), "'run' is there already"),
    (("export", "T1", "--store", "plant.history", "--out", "x.xls"), "must end with .csv or .parquet"),
    (("export", "T1", "--store", "plant.history", "--out", "no/x.csv"), "'no/x.csv' cannot be used: No such file"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "said"), REFUSED, ids=[said[:40] for _, said in REFUSED])
def test_what_cannot_be_done_is_said_in_one_line(measured: Done, words: tuple[str, ...], said: str) -> None:
    refused(homeostat("history", *words, cwd=measured.cwd), said)
    assert not (measured.cwd / "x.xls").exists()


def test_a_history_that_is_written_by_another_process_stops_no_run_half_way(tmp_path: Path) -> None:
    with EmbeddedStore(tmp_path / "h"):
        refused(homeostat(*SHORT, "--history", "h", cwd=tmp_path), "is written by process", "end that one first")
    assert not (tmp_path / "runs").exists()


def test_another_tag_of_the_future_does_not_hide_the_last_hours_of_this_one(tmp_path: Path) -> None:
    with EmbeddedStore(tmp_path / "h") as store:
        store.append(batch(plain("T1", T0, 1.0), plain("RTC", T0 + 10**15, 2.0)))
    done = homeostat("history", "show", "T1", "--store", "h", "--last", "1m", cwd=tmp_path)
    assert done.status == 0 and told_time(T0) in done.out
    done = homeostat("history", "export", "T1", "--store", "h", "--last", "1m", "--out", "x.csv", cwd=tmp_path)
    assert ": 1 rows, 1 tag" in done.out
    done = homeostat("history", "show", "T1", "RTC", "--store", "h", "--last", "1m", cwd=tmp_path)
    assert told_time(T0 + 10**15) in done.out and told_time(T0) not in done.out


def test_what_is_no_file_is_not_replaced_by_an_export(tmp_path: Path) -> None:
    with EmbeddedStore(tmp_path / "h") as store:
        store.append(batch(plain("T1", T0, 1.0)))
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "linked.csv").symlink_to(tmp_path / "real.csv")
    (tmp_path / "real.csv").write_text("before")
    export = ("history", "export", "T1", "--store", "h", "--force", "--out")
    refused(homeostat(*export, "pipe.csv", cwd=tmp_path), "'pipe.csv' is no file, and is not replaced by one")
    assert homeostat(*export, "linked.csv", cwd=tmp_path).status == 0
    assert (tmp_path / "linked.csv").is_symlink()
    assert "T1" in (tmp_path / "real.csv").read_text()


def test_a_history_without_samples_says_so(tmp_path: Path) -> None:
    EmbeddedStore(tmp_path / "h").close()
    refused(homeostat("history", "show", "--store", "h", cwd=tmp_path), "the history in 'h' has no samples yet")


def test_what_json_has_no_number_for_is_a_text(tmp_path: Path) -> None:
    with EmbeddedStore(tmp_path / "h") as store:
        store.append(batch(plain("T1", T0, float("nan")), plain("T1", T0 + S, float("-inf"), 0x808C0000)))
    done = homeostat("history", "show", "T1", "--store", "h", "--json", cwd=tmp_path)
    assert json.loads(done.out)["tags"]["T1"]["value"] == ["NaN", "-Infinity"]
    shown = homeostat("history", "show", "T1", "--store", "h", cwd=tmp_path).out
    assert "2025-11-24T16:00:01.000Z -inf bad, sensor failure" in " ".join(shown.split())


@pytest.mark.parametrize(
    ("text", "at_us"),
    [
        ("1970-01-01", 0),
        ("1970-01-01T00:00:01.5", 1_500_000),
        ("1970-01-01T01:00+01:00", 0),
        ("1969-12-31T23:59:59Z", -1_000_000),
    ],
)
def test_times_are_utc_unless_they_say_otherwise(text: str, at_us: int) -> None:
    assert read_time(text) == at_us and read_time(told_time(at_us)) == at_us


def test_a_span_is_named_by_its_end_or_its_length() -> None:
    extent = Span(T0, T0 + 3600 * S)
    assert read_span(None, None, None, extent) == extent
    assert read_span("10m", None, None, extent) == Span(T0 + 3000 * S, T0 + 3600 * S)
    assert read_span("30d", None, None, extent) == extent
    assert read_span(None, None, "2025-11-24T16:30", extent) == Span(T0, T0 + 1800 * S)
    assert read_duration("1.5h") == 5_400 * S and told_time(10**18) == f"{10**18} us"
    with pytest.raises(HistoryError):
        read_duration("99999999999999999d")
