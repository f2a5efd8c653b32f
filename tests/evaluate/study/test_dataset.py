"""The dataset: typed, the same for every reader, and the old or the new one at any time."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import duckdb
import polars
import pyarrow as pa
import pytest
from pyarrow import parquet

from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.ledger import DATASET, read_dataset, schema, write_dataset
from homeostat.record.row import TOTALS, Row, columns_of
from tests.evaluate.study.fake_rows import campaign, plain

ROWS = [*campaign(range(1, 3)), plain(job="Umlaut ü, \"quotes\" and 'more'", reason="a\nb\0c", severity=(), onset_s=())]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("dataset") / "results.parquet"
    write_dataset(path, ROWS)
    return path


def test_rows_come_back_as_they_were(path: Path) -> None:
    assert read_dataset(path) == ROWS


def test_columns_and_types() -> None:
    names = [field.name for field in fields(Row)]
    place = names.index(TOTALS)
    assert schema().names == [*names[:place], *names[place + 1 :]]
    assert schema(["lost_kg", "spilled_L"]).names == [*names[:place], "lost_kg", "spilled_L", *names[place + 1 :]]
    kinds = {str(field.type) for field in schema()}
    assert kinds == {"string", "bool", "int64", "double", "list<element: double>", "list<item: double>"} & kinds
    optional = {field.name for field in schema() if field.nullable}
    assert {"detection_s", "production_loss", "plans", "cost_usd"} <= optional
    assert not {"job", "seed", "success", "exposure_s", "wall_s"} & optional


def test_every_reader_sees_the_same(path: Path) -> None:
    def plain_values(rows: list[dict[str, object]]) -> list[dict[str, object]]:
        return [{k: tuple(v) if isinstance(v, list) else v for k, v in row.items()} for row in rows]

    expected = [{"spilled_L": None, **columns_of(row)} for row in ROWS]
    assert plain_values(polars.read_parquet(path).to_dicts()) == expected
    with duckdb.connect() as database:
        found = database.execute("select * from read_parquet(?)", [str(path)])
        names = [column[0] for column in found.description]
        assert plain_values([dict(zip(names, row, strict=True)) for row in found.fetchall()]) == expected


def test_no_row_is_a_dataset_too(tmp_path: Path) -> None:
    write_dataset(tmp_path / "results.parquet", [])
    assert read_dataset(tmp_path / "results.parquet") == []


def test_the_old_file_stays_until_the_new_one_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "results.parquet"
    write_dataset(path, ROWS[:2])
    before = path.read_bytes()

    def breaks(table: pa.Table, where: Path, **options: str) -> None:
        Path(where).write_bytes(b"half")
        assert path.read_bytes() == before
        raise OSError("the disk is full")

    with monkeypatch.context() as patch, pytest.raises(OSError, match="the disk is full"):
        patch.setattr(parquet, "write_table", breaks)
        write_dataset(path, ROWS)
    assert path.read_bytes() == before and read_dataset(path) == ROWS[:2]
    write_dataset(path, ROWS)
    assert read_dataset(path) == ROWS and [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("content", [b"", b"no parquet", b"PAR1" + b"\0" * 20 + b"PAR1"])
def test_another_file_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.parquet").write_bytes(content)
    with pytest.raises(StudyError, match=r"x\.parquet' is no dataset of a study"):
        read_dataset(tmp_path / "x.parquet")


def test_half_a_file_is_refused(path: Path, tmp_path: Path) -> None:
    whole = path.read_bytes()
    for share in (0.1, 0.5, 0.99):
        (tmp_path / "half.parquet").write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(StudyError, match="is no dataset of a study"):
            read_dataset(tmp_path / "half.parquet")


def test_other_columns_and_other_types_are_refused(path: Path, tmp_path: Path) -> None:
    table = parquet.read_table(path)
    seeds = table.schema.get_field_index("seed")
    others = [
        table.drop_columns(["kind"]), table.append_column("more", pa.array([1] * len(table))),
        table.set_column(seeds, "seed", pa.array([str(row.seed) for row in ROWS])),
    ]  # fmt: skip
    for other in others:
        parquet.write_table(other, tmp_path / "other.parquet")
        with pytest.raises(StudyError, match=r"has other columns than this version writes; run the study again"):
            read_dataset(tmp_path / "other.parquet")


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_dataset(tmp_path / "no.parquet")
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError):
        read_dataset(tmp_path / "folder")


def test_a_value_that_has_no_place_is_refused_before_anything_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "results.parquet"
    write_dataset(path, ROWS)
    with pytest.raises((pa.ArrowInvalid, pa.ArrowTypeError)):
        write_dataset(path, [replace(ROWS[0], seed="one")])  # type: ignore[arg-type]
    assert read_dataset(path) == ROWS
    assert path.name == DATASET


def test_a_total_that_has_the_name_of_another_column_is_refused() -> None:
    with pytest.raises(ValueError, match=r"the plant 'cstr' reports a total 'exposure_s', which is another column"):
        plain(totals={"exposure_s": 1.0})
