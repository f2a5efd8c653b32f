"""``homeostat plant show``: every row of a plant's tables, those that follow from others included, as CSV."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from tests.cli.command import homeostat, refused

EXAMPLE = Path(__file__).parents[2] / "examples" / "two_tanks"
TANKS = Path(__file__).parents[1] / "knowledge" / "two_tanks"


@pytest.fixture
def tanks(tmp_path: Path) -> Path:
    return Path(shutil.copytree(TANKS, tmp_path / "two_tanks"))


def rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


def test_a_table_is_csv_whose_last_column_says_what_a_row_follows_from(tanks: Path) -> None:
    (tanks / "engineering" / "signals.csv").write_text("tag,high\nF1.sp,0.5\n")
    done = homeostat("plant", "show", "./two_tanks", "--table", "signals", cwd=tanks.parent)
    assert (done.status, done.err) == (0, "")
    shown = {row["tag"]: row for row in rows(done.out)}
    assert len(shown) == 20 and list(shown["L1"])[-1] == "follows_from"
    assert (shown["F1.sp"]["high"], shown["F1.sp"]["unit"], shown["F1.sp"]["follows_from"]) == ("0.5", "L/s", "")
    assert shown["L1"]["follows_from"] == "instruments.csv row 2"
    assert shown["V1.man"]["follows_from"] == "loops.csv row 2"


def test_what_is_shown_can_be_stated_and_says_the_same(tanks: Path) -> None:
    def show(table: str) -> list[dict[str, str]]:
        out = homeostat("plant", "show", "./two_tanks", "--table", table, cwd=tanks.parent).out
        return [{column: cell for column, cell in row.items() if column != "follows_from"} for row in rows(out)]

    for table in ("signals", "faults", "transitions", "trips"):
        before = show(table)
        with (tanks / "engineering" / f"{table}.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, list(before[0]))
            writer.writeheader()
            writer.writerows(before)
        assert show(table) == before, table


def test_all_tables_are_told_apart_by_lines_with_their_names(tanks: Path) -> None:
    done = homeostat("plant", "show", "./two_tanks", cwd=tanks.parent)
    heads = [line for line in done.out.splitlines() if line.startswith("#")]
    assert len(heads) == 30
    assert "# signals: 20 rows, 20 of them from other tables" in heads
    assert "# states: 5 rows, 0 of them from other tables" in heads


def test_a_plant_that_states_everything_is_shown_as_it_is(tmp_path: Path) -> None:
    done = homeostat("plant", "show", "cstr", "--table", "loops", cwd=tmp_path)
    assert done.status == 0 and {row["follows_from"] for row in rows(done.out)} == {""}


def test_an_unknown_table_and_one_that_cannot_be_read_are_one_line(tanks: Path) -> None:
    done = homeostat("plant", "show", "./two_tanks", "--table", "signls", cwd=tanks.parent)
    refused(done, "there is no table 'signls'; did you mean 'signals'")
    (tanks / "engineering" / "states.csv").write_text("id,id\n")
    refused(homeostat("plant", "show", "./two_tanks", cwd=tanks.parent), "states.csv: needs a header")


def test_the_times_of_the_settings_follow_from_how_fast_the_plant_is(tmp_path: Path) -> None:
    tanks = Path(shutil.copytree(EXAMPLE, tmp_path / "two_tanks"))
    settings = tanks / "case.toml"
    text = settings.read_text("utf-8")
    settings.write_text(f"{text}\n[time]\ntick_s = 10.0\n[monitoring]\nreview_s = 700.0\n", "utf-8")
    done = homeostat("plant", "show", "./two_tanks", "--table", "times", cwd=tanks.parent)
    assert (done.status, done.err) == (0, "")
    shown = {(row["table"], row["key"]): row for row in rows(done.out)}
    assert shown["time", "response_s"]["seconds"] == "2500"
    assert (shown["time", "tick_s"]["seconds"], shown["time", "tick_s"]["follows_from"]) == ("10", "")
    assert shown["twin", "horizon_s"]["seconds"] == "9000"
    assert shown["twin", "horizon_s"]["follows_from"] == "a response of 2500 s in ticks of 10 s"
    assert (shown["monitoring", "review_s"]["seconds"], shown["monitoring", "review_s"]["follows_from"]) == ("700", "")


def test_the_states_that_the_settings_may_name_are_listed(tmp_path: Path) -> None:
    tanks = Path(shutil.copytree(EXAMPLE, tmp_path / "two_tanks"))
    settings = tanks / "case.toml"
    text = settings.read_text("utf-8").replace("B1_V = 0.2", "level_B1 = 0.2")
    settings.write_text(text, "utf-8")
    done = homeostat("plant", "try", "./two_tanks", cwd=tmp_path)
    assert done.status == 2 and "twin, initial: the plant has no state variable 'level_B1'" in done.err
    said = "there are B1_V, B2_V, B1_T, B2_T, product ('homeostat plant show two_tanks --table model' shows all)"
    assert said in done.err
    done = homeostat("plant", "show", "./two_tanks", "--table", "model", cwd=tmp_path)
    assert done.status == 0
    shown = {row["state"]: row for row in rows(done.out)}
    assert shown["B1_V"] == {"state": "B1_V", "begins": "90", "unit": "L", "initial": ""}
    assert shown["B2_V"]["initial"] == "0.2" and list(shown) == ["B1_V", "B2_V", "B1_T", "B2_T", "product"]


def test_the_states_of_a_kernel_by_hand_are_all_that_it_has(tmp_path: Path) -> None:
    done = homeostat("plant", "show", "mixing_module", "--table", "model", cwd=tmp_path)
    first = {"state": "V1", "begins": "0.314898", "unit": "", "initial": "0.02"}
    assert done.status == 0 and rows(done.out)[0] == first
