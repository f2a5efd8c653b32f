"""Trajectories and texts beside the journal."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from homeostat.journal.beside.artifacts import write_parquet, write_text
from tests.equipment.journals import read_parquet

TIMES = np.array([0.0, 0.5, 1.0])
UNITS = {"T1": "K", "B203.level": "m"}


def test_a_trajectory_comes_back_with_its_units(tmp_path: Path) -> None:
    columns = {"T1": np.array([300.0, 301.5, np.nan]), "B203.level": np.array([0.1, 0.2, 0.3])}
    stored = write_parquet(tmp_path / "plant.parquet", TIMES, columns, UNITS)
    read = read_parquet(tmp_path / "plant.parquet")
    np.testing.assert_array_equal(read.times_s, TIMES)
    assert list(read.columns) == ["T1", "B203.level"] and dict(read.units) == UNITS
    for name, values in columns.items():
        np.testing.assert_array_equal(read.columns[name], values)
    assert stored.name == "plant.parquet"
    assert stored.sha256 == hashlib.sha256((tmp_path / "plant.parquet").read_bytes()).hexdigest()


def test_units_are_metadata_that_any_parquet_reader_sees(tmp_path: Path) -> None:
    values = np.arange(6.0).reshape(2, 3)
    write_parquet(tmp_path / "twin.parquet", TIMES, {"T1": values}, {"T1": "K"})
    schema = pq.read_schema(tmp_path / "twin.parquet")
    assert schema.names == ["t_s", "member", "T1"]
    assert [schema.field(name).metadata[b"unit"] for name in schema.names] == [b"s", b"1", b"K"]
    table = pq.read_table(tmp_path / "twin.parquet").to_pydict()
    assert table["member"] == [0, 0, 0, 1, 1, 1] and table["t_s"] == [0.0, 0.5, 1.0] * 2
    assert table["T1"] == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


@given(
    hnp.arrays(np.float64, st.tuples(st.integers(1, 4), st.integers(1, 7)), elements=st.floats(width=64)),
)
def test_ensembles_round_trip(tmp_path_factory: pytest.TempPathFactory, values: np.ndarray) -> None:
    path = tmp_path_factory.mktemp("ensemble") / "twin.parquet"
    times = np.linspace(0.0, 1.0, values.shape[1])
    first = write_parquet(path, times, {"T1": values, "F": -values}, {"T1": "K", "F": "kg/s"})
    read = read_parquet(path)
    np.testing.assert_array_equal(read.columns["T1"], values)
    np.testing.assert_array_equal(read.columns["F"], -values)
    np.testing.assert_array_equal(read.times_s, times)
    assert write_parquet(path, times, {"T1": values, "F": -values}, {"T1": "K", "F": "kg/s"}) == first


@pytest.mark.parametrize(
    ("times", "columns", "units", "message"),
    [
        (TIMES, {"T1": np.zeros(2)}, UNITS, r"columns have shape \(2,\); with 3 times"),
        (TIMES, {"T1": np.zeros((1, 1, 3))}, UNITS, "columns have shape"),
        (TIMES, {"T1": np.zeros((0, 3))}, UNITS, "columns have shape"),
        (TIMES[:0], {"T1": np.zeros((2, 0))}, UNITS, "columns have shape"),
        (TIMES, {"T1": np.zeros(3), "B203.level": np.zeros((2, 3))}, UNITS, "'B203.level' has shape"),
        (TIMES, {"P": np.zeros(3)}, UNITS, "'P' has no unit; name one, '1' for a fraction"),
        (TIMES, {"t_s": np.zeros(3)}, {"t_s": "s"}, "'t_s' has the name of the time or member column"),
        (TIMES.reshape(1, 3), {"T1": np.zeros(3)}, UNITS, r"times have shape \(1, 3\)"),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_is_written(
    tmp_path: Path, times: np.ndarray, columns: dict[str, np.ndarray], units: dict[str, str], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        write_parquet(tmp_path / "plant.parquet", times, columns, units)
    assert not list(tmp_path.iterdir())


def test_a_text_is_kept_once_under_the_digest_of_its_content(tmp_path: Path) -> None:
    text = "ASK { ?valve :stuck true }  # 20 °C\n"
    first = write_text(tmp_path / "queries", text, ".rq")
    assert write_text(tmp_path / "queries", text, ".rq") == first
    (path,) = (tmp_path / "queries").iterdir()
    assert path.name == first.name == f"{hashlib.sha256(text.encode()).hexdigest()}.rq"
    assert path.read_text("utf-8") == text and first.size_bytes == len(text.encode())
