"""``homeostat monitor`` as users and attackers give it."""

from __future__ import annotations

import csv
import json
import subprocess
from pathlib import Path
from subprocess import PIPE

import pytest

from homeostat.cli.main import NOBODY_READS
from tests.cli.command import COMMAND, LIMIT_S, environment, homeostat, refused
from tests.detectors.tables import NAMES, written


@pytest.fixture
def ill(tmp_path: Path) -> str:
    return str(written(tmp_path / "ill.csv", 900, seed=2, shifted=slice(500, 700)))


@pytest.fixture
def well(tmp_path: Path) -> str:
    return str(written(tmp_path / "well.csv", 2_000))


def test_what_is_out_of_the_ordinary_is_told_with_its_time_and_its_signal(tmp_path: Path, ill: str, well: str) -> None:
    done = homeostat("monitor", ill, "--baseline", well, cwd=tmp_path)
    assert done.status == 1 and done.err == ""
    assert "900 rows of 4 signals at the times of 'time', judged by 1 fault-free table" in done.out
    (alarm,) = (line for line in done.out.splitlines() if "2026-11-25 13:08:2" in line)
    assert "2026-11-25 13:11:4" in alarm and "flow [l/s]" in alarm


def test_what_is_in_order_is_said_too(tmp_path: Path, well: str) -> None:
    other = str(written(tmp_path / "other.csv", 900, seed=3))
    done = homeostat("monitor", other, "--baseline", well, cwd=tmp_path)
    assert done.status == 0 and "nothing is out of the ordinary for 6 rows in a row" in done.out


def test_a_table_alone_is_judged_by_its_first_rows(tmp_path: Path, ill: str) -> None:
    done = homeostat("monitor", ill, cwd=tmp_path)
    assert done.status == 1 and "judged by its first 300 rows" in done.out
    assert (
        done.err == "homeostat: the first 300 rows are taken to be fault-free; --healthy or --baseline says which are\n"
    )


def test_rows_that_are_counted_for_want_of_times_are_said_to_have_none(tmp_path: Path, ill: str) -> None:
    assert "rows of 4 signals without times, judged" in homeostat("monitor", ill, "--ignore", "time", cwd=tmp_path).out


def test_json_is_one_object_and_nothing_else(tmp_path: Path, ill: str, well: str) -> None:
    done = homeostat("monitor", ill, "--baseline", well, "--detectors", "pca,three-sigma", "--json", cwd=tmp_path)
    found = json.loads(done.out)
    assert done.status == 1 and found["detectors"] == ["pca", "three-sigma"] and found["false_alarms"] == 0.01
    (table,) = found["tables"]
    assert table["time"] == "time"
    assert (
        table["rows"] == 900 and table["signals"] == list(NAMES) and table["alarms"][0]["signals"]["flow [l/s]"] > 1.0
    )


@pytest.mark.slow
def test_pictures_and_scores_are_kept_for_each_table(tmp_path: Path, ill: str, well: str) -> None:
    (tmp_path / "more").mkdir()
    other = str(written(tmp_path / "more" / "ill.csv", 900, seed=3))
    done = homeostat("monitor", ill, other, "--baseline", well, "--out", "found", cwd=tmp_path)
    kept = {p.name for p in (tmp_path / "found").iterdir()}
    assert done.status == 1 and kept == {f"{tmp_path.name}-ill.{e}" for e in ("png", "csv")} | {
        "more-ill.png",
        "more-ill.csv",
    }
    with (tmp_path / "found" / f"{tmp_path.name}-ill.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 900 and rows[600]["beyond"] == "1" and float(rows[600]["ewma"]) > 1.0 > float(rows[100]["ewma"])
    refused(homeostat("monitor", ill, other, "--baseline", well, "--out", "found", cwd=tmp_path), "--force")
    assert homeostat("monitor", ill, other, "--baseline", well, "--out", "found", "--force", cwd=tmp_path).status == 1


@pytest.mark.slow
def test_whoever_stops_reading_loses_nothing_that_is_kept(tmp_path: Path, ill: str, well: str) -> None:
    command = [*COMMAND, "monitor", ill, "--baseline", well, "--out", "kept"]
    with subprocess.Popen(command, cwd=tmp_path, env=environment(), stdout=PIPE, stderr=PIPE) as running:
        assert running.stdout is not None
        running.stdout.close()
        assert running.wait(LIMIT_S) == NOBODY_READS
    assert (tmp_path / "kept" / "ill.png").is_file() and (tmp_path / "kept" / "ill.csv").is_file()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("nowhere.csv",), ("'nowhere.csv' cannot be used", "No such file")),
        (("ill.csv", "--baseline", "nowhere.csv"), ("nowhere.csv",)),
        (("ill.csv", "--detectors", "magic"), ("'magic' is no detector", "three-sigma")),
        (("ill.csv", "--healthy", "5000"), ("none is left to judge",)),
        (("ill.csv", "--time", "when"), ("no column 'when'",)),
        (("ill.csv", "--false-alarms", "0.001"), ("0.001 cannot be told from 300", "at least 0.0067")),
        (("ill.csv", *(o for name in NAMES for o in ("--ignore", name))), ("no column of signals is left",)),
        (("ill.csv", "--ignore", "lable"), ("--ignore 'lable': no table has it", f"has {', '.join(NAMES)}")),
        (("ill.csv", "--last", "8h"), ("for runs and histories",)),
        (("empty",), ("'empty'",)),
        ((".",), ("history",)),
    ],
)
def test_what_cannot_be_judged_is_one_line(
    tmp_path: Path, ill: str, options: tuple[str, ...], words: tuple[str, ...]
) -> None:
    (tmp_path / "empty").touch()
    done = homeostat("monitor", *options, "--out", "found", cwd=tmp_path)
    assert (done.status, done.out) == (2, "")
    assert all(word in done.err.splitlines()[-1] for word in words), done.err
    assert not (tmp_path / "found").exists()


@pytest.mark.parametrize("share", ["0", "1", "nan", "-0.1", "lots"])
def test_no_rate_of_false_alarms(tmp_path: Path, ill: str, share: str) -> None:
    refused(homeostat("monitor", ill, f"--false-alarms={share}", cwd=tmp_path), "--false-alarms")


def test_what_a_table_says_obeys_no_terminal(tmp_path: Path) -> None:
    text = written(tmp_path / "t.csv", 900, shifted=slice(500, 700)).read_text().replace("flow [l/s]", "flow\x1b[2J")
    (tmp_path / "t.csv").write_text(text)
    done = homeostat("monitor", "t.csv", cwd=tmp_path)
    assert done.status == 1 and "\x1b" not in done.out + done.err and "flow\\x1b" in done.out
