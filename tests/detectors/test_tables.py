"""Tables are read however they are written, and what is wrong with one is one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.detectors.error import DetectionError
from homeostat.detectors.tables import reading
from homeostat.detectors.tables.agreement import agreed, refuse_other_units
from homeostat.detectors.tables.reading import read_table
from homeostat.detectors.tables.table import SignalTable
from tests.detectors.tables import NAMES, written


def table(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t", "|"])
def test_whatever_separates_the_values(tmp_path: Path, separator: str) -> None:
    read = read_table(written(tmp_path / "t.csv", 50, separator=separator))
    assert read.signals == NAMES and read.values.shape == (50, 4) and read.step == 1.0
    assert read.told(3) == "2026-11-25 13:00:03"


def test_a_line_of_a_spreadsheet_says_what_separates_the_values(tmp_path: Path) -> None:
    read = read_table(table(tmp_path / "t.csv", "sep=;\ntime;a, in l/s\n0;1,5\n1;2,5\n"))
    assert read.signals == ("a, in l/s",) and read.values[:, 0].tolist() == [1.5, 2.5]


def test_decimal_commas(tmp_path: Path) -> None:
    read = read_table(table(tmp_path / "t.csv", "t;a;b\n0;1,5;-2,25\n1;2,5;3\n"))
    assert read.values.tolist() == [[1.5, -2.25], [2.5, 3.0]]


def test_parquet(tmp_path: Path) -> None:
    rows = pa.table({"at": [0.0, 0.5, 1.0], "a": [1, 2, 3], "b": [True, False, True]})
    pq.write_table(rows, tmp_path / "t.parquet")
    read = read_table(tmp_path / "t.parquet")
    assert read.values.tolist() == [[1.0, 1.0], [2.0, 0.0], [3.0, 1.0]] and read.step == 0.5 and read.told(1) == "0.5 s"


def test_a_byte_order_mark_and_spaces_around_names(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_bytes(b"\xef\xbb\xbftime, a\n0,1\n1,2\n")
    assert read_table(tmp_path / "t.csv").signals == ("a",)


def test_rows_are_counted_where_there_is_no_time(tmp_path: Path) -> None:
    read = read_table(table(tmp_path / "t.csv", "a,b\n1,2\n3,4\n"))
    assert not read.timed and read.told(1) == "row 2"


def test_a_temperature_in_capitals_is_a_signal_and_a_small_t_is_time(tmp_path: Path) -> None:
    counted = read_table(table(tmp_path / "a.csv", "T,p\n300,1\n299,2\n"))
    assert counted.signals == ("T", "p") and not counted.timed
    timed = read_table(table(tmp_path / "b.csv", "T,AT,t\n300,1,0\n299,2,60\n"))
    assert timed.signals == ("T", "AT") and timed.time == "t" and timed.times.tolist() == [0.0, 60.0]


def test_an_ignored_column_is_not_taken_for_the_times(tmp_path: Path) -> None:
    file = table(tmp_path / "t.csv", "Date,time,a\n7,0,1\n7,60,2\n")
    read = read_table(file, ignored=("Date",))
    assert read.time == "time" and read.signals == ("a",)
    assert not read_table(file, ignored=("Date", "time")).timed
    with pytest.raises(DetectionError, match="'time' is both ignored and named for the times"):
        read_table(file, time="time", ignored=("time",))


def test_times_with_an_offset_are_the_same_moments(tmp_path: Path) -> None:
    text = "time,a\n2026-01-01T10:00:00+02:00,1\n2026-01-01T08:00:30Z,2\n"
    read = read_table(table(tmp_path / "t.csv", text))
    assert read.times.tolist() == [0.0, 30.0] and read.told(1) == "2026-01-01 08:00:30Z", "UTC, and said to be"
    here = read_table(table(tmp_path / "u.csv", text.replace("+02:00", "").replace("Z", "").replace("T10", "T07")))
    assert here.told(1) == "2026-01-01 08:00:30"


def test_columns_without_a_name_may_be_ignored(tmp_path: Path) -> None:
    read = read_table(table(tmp_path / "t.csv", ",time,a,\n0,0,1,9\n1,60,2,9\n"), ignored=("",))
    assert read.signals == ("a",) and read.times.tolist() == [0.0, 60.0]


def test_a_column_may_be_ignored_and_another_have_the_times(tmp_path: Path) -> None:
    text = "time,clock,a,label\nx,0,1,good\ny,60,2,bad\n"
    read = read_table(table(tmp_path / "t.csv", text), time="clock", ignored=("time", "label"))
    assert read.signals == ("a",) and read.times.tolist() == [0.0, 60.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty; its first line must name the signals"),
        ("a,b\n", "at least 2 rows are needed .* there are 0"),
        ("a,b\n1,2\n", "at least 2 rows are needed .* there are 1"),
        ("time,a\n0,1\n1\n", "row 2 has 1 cells, and the first line names 2: '1'; mend or cut out this row"),
        ("time;a\n0;1\n1;2;3\n", "row 2 has 3 cells, and the first line names 2: '1;2;3'"),
        ("sep=;\ntime;a\n0;1\n1;2;3\n", "row 2 has 3 cells, and the first line names 2: '1;2;3'"),
        ("sep=;\n", "is empty"),
        (",a\n0,1\n1,2\n", "column 1 has no name; give it one, or leave it out with --ignore ''"),
        ("time,a,,\n0,1,2,3\n1,2,3,4\n", "column 3 has no name"),
        ("time,a,a\n0,1,2\n1,2,3\n", "the column 'a' is there 2 times"),
        ("time,a\n0,1\n1,pump\n", "'pump' in row 2 of 'a' is no number; leave the column out with --ignore 'a'"),
        ("0,1.5\n1,2.5\n2,3.5\n", "the first line has numbers; it must name the signals"),
        ("time\n0\n1\n", "no column of signals is left; there are 'time'"),
        ("time,a\n0,1\n0,2\n", "the time in row 2 of 'time' is not after the one before it"),
        ("time,a\n5,1\n3,2\n", "the time in row 2 of 'time' is not after the one before it .*; sort the rows"),
        (
            "time,a\n01.03.2026 15:44,1\n02.03.2026 15:44,2\n",
            "in row 1 of 'time' is no time; write ISO",
        ),
        ("time,a\n0,1\n,2\n", "row 2 of 'time' has no time"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(DetectionError, match=words):
        read_table(table(tmp_path / "bad.csv", text))


@pytest.mark.parametrize("content", [b"\x89PNG\r\n\x1a\n\x00\x00\x00\xff", b"\xff\xfe\x00a", b"T \xb0C,b\n1,2\n"])
def test_what_is_no_text_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "t.csv").write_bytes(content)
    with pytest.raises(DetectionError, match=r"is no text in UTF-8; save it"):
        read_table(tmp_path / "t.csv")


def test_a_file_that_only_says_that_it_is_parquet_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DetectionError, match=r"is no table of signals"):
        read_table(table(tmp_path / "t.parquet", "a,b\n1,2\n"))


def test_an_unknown_column_of_times_is_named(tmp_path: Path) -> None:
    with pytest.raises(DetectionError, match=r"there is no column 'when' for the times; there are 'time', 'a'"):
        read_table(table(tmp_path / "t.csv", "time,a\n0,1\n1,2\n"), time="when")


def test_a_file_that_is_too_large_is_not_even_read(tmp_path: Path) -> None:
    with (tmp_path / "t.csv").open("wb") as file:
        file.truncate(2 << 30)  # it takes no room: nothing was written
    with pytest.raises(DetectionError, match=r"has 2.0 GiB; at most 1 GiB are read; cut it"):
        read_table(tmp_path / "t.csv")


def test_too_many_values_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "MOST_VALUES", 100)
    with pytest.raises(DetectionError, match=r"50 rows of 4 signals are more than 100 values; leave signals out"):
        read_table(written(tmp_path / "t.csv", 50))


def of(values: list[list[float]], *names: str, step: float = 1.0) -> SignalTable:
    array = np.array(values, dtype=np.float64)
    return SignalTable("mine", names or ("a",), step * np.arange(len(array)), array)


def test_the_last_value_stands_for_a_missing_one() -> None:
    values = [[np.nan]] + [[float(k)] for k in range(1, 60)]
    values[10], values[11] = [np.inf], [np.nan]
    filled = of(values, "a").filled().values[:, 0]
    assert filled[0] == 1.0 and filled[10] == filled[11] == 9.0 and filled[12] == 12.0


def test_too_many_missing_values_are_refused_with_the_first_of_them() -> None:
    values = [[1.0, float(k)] for k in range(20)]
    values[4][1] = values[7][1] = np.nan
    with pytest.raises(DetectionError, match=r"'b' has no value in 10.0% of the rows, first in row 5; at most 5%"):
        of(values, "a", "b").filled()


def test_columns_are_brought_into_the_order_of_the_first() -> None:
    first, other = of([[1, 2], [3, 4]], "a", "b"), of([[9, 2, 1], [9, 4, 3]], "c", "b", "a")
    assert agreed([first, other])[1].values.tolist() == first.values.tolist()


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (of([[1], [2]], "a"), "lacks the column 'T .K.' of mine; add it, or leave it out with --ignore 'T .K.'"),
        (
            of([[1, 2], [2, 3]], "a", "T [degC]"),
            "has 'T .degC.' where mine has 'T .K.': .* another unit",
        ),
        (of([[1, 2], [2, 3]], "a", "T [K]", step=60.0), "has a row every 60 s, mine every 1 s; bring both to the same"),
    ],
)
def test_tables_that_do_not_belong_together_are_refused(other: SignalTable, words: str) -> None:
    with pytest.raises(DetectionError, match=words):
        agreed([of([[1, 2], [2, 3]], "a", "T [K]"), other])


def test_a_signal_in_another_unit_is_refused_and_a_fault_is_not() -> None:
    usual = [np.array([[20.0], [30.0]])]
    with pytest.raises(DetectionError, match=r"'a' is between 293 and 303.*between 20 and 30: another unit"):
        refuse_other_units(of([[293.0], [303.0]], "a"), usual)
    refuse_other_units(of([[25.0], [303.0]], "a"), usual)
    refuse_other_units(of([[5.0]], "a"), [np.array([[1.0], [1.0]])])


def test_nanoseconds_are_times_and_whole_numbers_of_any_length_are_numbers(tmp_path: Path) -> None:
    moments = [1_764_075_600_000_000_001 + k * 1_000_000_000 for k in range(3)]
    whole = {"a": [2**53 + 1, 5, 6], "b": pa.array([2**64 - 1, 1, 2], pa.uint64())}
    pq.write_table(pa.table({"time": pa.array(moments, pa.timestamp("ns")), **whole}), tmp_path / "t.parquet")
    read = read_table(tmp_path / "t.parquet")
    assert read.times.tolist() == [0.0, 1.0, 2.0] and read.told(0) == "2025-11-25 13:00:00"
    assert read.values.tolist() == [[2.0**53, 2.0**64], [5.0, 1.0], [6.0, 2.0]]
    counted = pa.table({"time": [1_764_075_600_000_000_001 + 1000 * k for k in range(3)], "a": [1.0, 2.0, 3.0]})
    pq.write_table(counted, tmp_path / "counted.parquet")
    assert np.diff(read_table(tmp_path / "counted.parquet").times) == pytest.approx(1000.0, abs=300.0)


def test_what_is_no_time_no_number_or_no_name_is_one_line(tmp_path: Path) -> None:
    odd = {
        "fine": pa.table({"time": [0, 1], "when": pa.array([1, 2_000_000_001], pa.timestamp("ns"))}),
        "late": pa.table({"time": ["9999-12-31T23:00:00-05:00", "9999-12-31T23:00:01-05:00"], "a": [1, 2]}),
        "far": pa.table({"time": pa.array([2**52, 2**52 + 1], pa.timestamp("s")), "a": [1, 2]}),
        "days": pa.table({"time": pa.array([2**62, 2**62 + 1], pa.date64()), "a": [1, 2]}),
        "bare": pa.table({"time": pa.array([1, None], pa.timestamp("ns")), "a": [1, 2]}),
    }
    beyond = "beyond what a calendar has"
    words = {"fine": "is no number", "late": "is in no year", "far": beyond, "days": beyond, "bare": "row 2"}
    for name, rows in odd.items():
        pq.write_table(rows, tmp_path / f"{name}.parquet")
        with pytest.raises(DetectionError, match=words[name]):
            read_table(tmp_path / f"{name}.parquet")
    for moment in ("9999-12-31T23:59:00-05:00", "0000-01-01"):
        rows = table(tmp_path / "again.csv", f"time,a\n{moment},1\n{moment},2\n")
        with pytest.raises(DetectionError, match=r"row 2 of 'time' is not after the one before it \(.*0.*\); sort"):
            read_table(rows)
        with pytest.raises(DetectionError, match="is no number"):
            read_table(table(tmp_path / "as_signal.csv", f"time,a\n0,{moment}\n1,{moment}\n"))
    (tmp_path / "latin.csv").write_bytes(b"time,Temp_\xb0C\n" + b"".join(b"%d,1.0000000\n" % k for k in range(7_000)))
    with pytest.raises(DetectionError, match="its names are no text in UTF-8"):
        read_table(tmp_path / "latin.csv")


def test_a_small_file_that_swells_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "MOST_PACKED", 1_000)
    pq.write_table(pa.table({"a": pa.nulls(1_001, pa.float64())}), tmp_path / "t.parquet")
    with pytest.raises(DetectionError, match="1001 rows of 1 columns, 1001 values; at most 1000 are read"):
        read_table(tmp_path / "t.parquet")


def test_what_was_left_out_is_known(tmp_path: Path) -> None:
    read = read_table(table(tmp_path / "t.csv", "time,a,b\n0,1,2\n60,3,4\n"), ignored=("label", "b"))
    assert (read.signals, read.left_out) == (("a",), ("b",))
    again = of([[1.0, 2.0], [3.0, 4.0]], "a", "b").without(("label", "b"))
    assert (again.signals, again.left_out) == (("a",), ("b",))
    with pytest.raises(DetectionError, match="no signal is left; leave out fewer of a"):
        again.without(("a",))


ODD = (
    "", "1", "2.5", "nan", "-inf", "1e400", "0x1F", "true", "1" * 20, "-9223372036854775808", "1_000", "\u202e", "NaT",
    "2026-11-25", "0000-01-01", "9999-12-31", "99999-01-01", "12:00:00", "23:59:60", "2026-11-25T13:00:00.000000001",
    "2026-11-25 13:00:00+05:30", "9999-12-31T23:59:00-05:00", "P1D", "1/2/2026",
)  # fmt: skip


@given(st.lists(st.tuples(*[st.sampled_from(ODD)] * 3), min_size=1, max_size=4), st.sampled_from(["", "time", "a"]))
def test_whatever_stands_in_a_table_it_is_one_or_is_refused_in_one_line(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[str, str, str]], ignored: str
) -> None:
    text = "time,a,b\n" + "".join(",".join(row) + "\n" for row in rows)
    try:
        read = read_table(table(tmp_path_factory.mktemp("odd") / "t.csv", text), ignored=(ignored,) if ignored else ())
        assert read.told(0) and len(read) == len(rows)
    except DetectionError as refused:
        assert len(str(refused).splitlines()) == 1
