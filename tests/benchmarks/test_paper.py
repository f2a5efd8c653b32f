"""The published figures are whole and agree with themselves, and stand beside ours."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from benchmarks import campaign_results
from benchmarks.paper.__main__ import FOLDER, main
from benchmarks.paper.names import distinct, file_name
from benchmarks.paper.published import ORIGINS, published, published_lines, published_rows
from benchmarks.paper.tables import RUN, by_published, paper_latency, paper_tables
from homeostat.evaluate.report.groups import ALL
from homeostat.evaluate.report.tables.table import Table
from homeostat.evaluate.study.ledger import DATASET, write_dataset
from tests.evaluate.study.fake_rows import campaign, plain


@pytest.mark.parametrize(("plant", "rows"), [("mixing_module", 7), ("cstr", 4)])
def test_every_row_has_both_models_and_both_campaigns(plant: str, rows: int) -> None:
    names = (*published_rows(plant), ALL)
    assert len(names) == rows
    for name in names:
        lines = published_lines(plant, name)
        assert {(line.model, line.origin) for line in lines} == {
            (model, origin) for model in ("GPT-4.1-mini", "GPT-4o-mini") for origin in ORIGINS.values()
        }


def test_the_last_row_counts_the_others() -> None:
    for last in (line for line in published() if line.row == ALL):
        whose = (last.case, last.source, last.model)
        parts = [line for line in published() if (line.case, line.source, line.model) == whose and line.row != ALL]
        assert sum(line.successes for line in parts) == last.successes
        assert sum(line.runs for line in parts) == last.runs
        if last.reprompted is not None:
            assert sum(line.reprompted or 0 for line in parts) == last.reprompted
            assert sum(line.recovered or 0 for line in parts) == last.recovered
        tokens = [line.tokens_in for line in parts if line.tokens_in is not None]
        assert last.tokens_in == pytest.approx(sum(tokens) / len(tokens), rel=0.01)


def test_known_totals() -> None:
    totals = {(line.case, line.source, line.model): line.successes for line in published() if line.row == ALL}
    assert totals["mixing_module", "paper", "GPT-4o-mini"] == 51
    assert totals["mixing_module", "rerun", "GPT-4o-mini"] == 0
    assert totals["cstr", "paper", "GPT-4.1-mini"] == 28
    assert totals["cstr", "rerun", "GPT-4.1-mini"] == 19


def test_published_lines_stand_below_ours() -> None:
    reactor, mixer = paper_tables(campaign(range(1, 4)))
    assert reactor.header[:5] == ("fault", "proposer", "figures", "runs", "success")
    faults = [line[0] for line in reactor.lines]
    assert list(dict.fromkeys(faults)) == [*published_rows("cstr"), ALL]
    assert [line[2] for line in reactor.lines if line[0] == "fouling"][-4:] == ["published"] * 2 + [
        "published rerun"
    ] * 2
    assert "replayed" in {line[2] for line in reactor.lines}
    assert [line[0] for line in mixer.lines][-1] == RUN
    assert "pump_degradation, sensor_fault were not run" in mixer.note


def test_the_total_of_some_rows_stands_beside_no_published_total() -> None:
    (table,) = paper_tables([plain()])
    assert {line[2] for line in table.lines if line[0] == RUN} == {"measured"}
    assert ALL not in {line[0] for line in table.lines}


def test_rows_that_stand_for_nothing_published_are_left_out() -> None:
    assert paper_tables([plain(published="")]) == []
    (table,) = paper_tables([plain(case="tank", published="fouling")])
    assert {line[2] for line in table.lines} == {"measured"}


def test_what_the_columns_mean_is_said() -> None:
    rows = campaign(range(1, 3))
    for table in (*paper_tables(rows), *paper_latency(rows)):
        silent = {column.name for column in table.columns if not column.meaning}
        assert silent <= {"fault", "proposer", "runs"}
        assert "or published" in next(column.meaning for column in table.columns if column.name == "figures")


def test_times_stand_in_tables_of_their_own() -> None:
    assert not any("[s]" in name for table in paper_tables(campaign(range(1, 3))) for name in table.header)
    assert all("mean run [s]" in table.header for table in paper_latency(campaign(range(1, 3))))


def test_groups_are_in_order_whatever_the_order_of_the_rows() -> None:
    rows = campaign(range(1, 3))
    assert by_published(rows) == by_published(rows[::-1])
    assert {group.scenario for group in by_published(rows)} >= {"normal", "fouling", "leak"}


def test_a_study_gets_the_papers_tables_and_heat_maps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_dataset(tmp_path / DATASET, campaign(range(1, 3)))
    assert main([str(tmp_path)]) == 0
    names = {Path(line).name for line in capsys.readouterr().out.splitlines()}
    assert names == {path.name for path in (tmp_path / FOLDER).iterdir()}
    assert {"paper_cstr.md", "paper_cstr.tex", "latency_mixing_module.csv", "success_cstr.svg"} <= names
    with (tmp_path / FOLDER / "paper_cstr.csv").open(encoding="utf-8") as file:
        theirs = {row["figures"]: row["proposer"] for row in csv.DictReader(file)}
    assert {theirs[origin] for origin in ORIGINS.values()} == {"GPT-4o-mini"}
    picture = tmp_path / FOLDER / "success_cstr.svg"
    before = picture.read_bytes()
    assert main([str(tmp_path)]) == 0
    assert picture.read_bytes() == before


def test_the_page_of_campaigns_has_the_papers_tables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / campaign_results.PAPER).mkdir()
    write_dataset(tmp_path / campaign_results.PAPER / DATASET, campaign(range(1, 3)))
    monkeypatch.setattr(campaign_results, "RUNS", tmp_path)
    text = campaign_results.tables(campaign_results.PAPER, campaign_results.SHOWN[campaign_results.PAPER])
    titles = [line.removeprefix("### ") for line in text.splitlines() if line.startswith("### ")]
    assert titles[:2] == ["mixing_module: the paper's table", "cstr: the paper's table"] and len(titles) == 4
    assert "published rerun" in text


def test_names_of_files_lead_nowhere_else() -> None:
    assert file_name("paper", "../../etc/x y") == "paper_etc_x_y"
    assert file_name("…") == "table"
    names = [table.name for table in distinct([Table("name", letter, "", (), ()) for letter in "abc"])]
    assert names == ["name", "name_2", "name_3"]
