"""From tables to alarms: what is out of the ordinary, since when, and in which signal."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from homeostat.detectors.alarms import LASTING, alarms
from homeostat.detectors.error import DetectionError
from homeostat.detectors.figure import draw, shown_signals
from homeostat.detectors.learning import Judged
from homeostat.detectors.tables.reading import read_table
from homeostat.detectors.tables.table import SignalTable
from homeostat.detectors.watching import Watching, watch
from tests.detectors.tables import NAMES, written


@pytest.fixture
def fault_free(tmp_path: Path) -> SignalTable:
    return read_table(written(tmp_path / "well.csv", 2_000))


@pytest.fixture
def faulty(tmp_path: Path) -> SignalTable:
    return read_table(written(tmp_path / "ill.csv", 900, seed=2, shifted=slice(500, 700)))


def judged(scores: list[float]) -> Judged:
    column = np.array(scores)[:, None]
    return Judged(column, column)


def test_a_fault_is_found_where_it_is(fault_free: SignalTable, faulty: SignalTable) -> None:
    (course,) = watch([faulty], [fault_free], Watching())
    assert len(course.alarms) == 1
    alarm = course.alarms[0]
    assert 500 <= alarm.first <= 503 and 695 <= alarm.last <= 715
    assert alarm.signals[0][0] == NAMES[0] and set(alarm.detectors) == {"ewma", "cva"}
    assert course.over[500:700].mean() > 0.95 and course.over[:500].mean() < 0.05


def test_a_table_that_is_well_raises_no_alarm(tmp_path: Path, fault_free: SignalTable) -> None:
    (course,) = watch([read_table(written(tmp_path / "other.csv", 900, seed=3))], [fault_free], Watching())
    assert course.alarms == () and course.share < 0.05


def test_a_table_by_itself_is_judged_by_its_first_rows_which_is_said(faulty: SignalTable) -> None:
    said: list[str] = []
    (course,) = watch([faulty], [], Watching(), said.append)
    assert course.healthy == 300 and said == [
        "the first 300 rows are taken to be fault-free; --healthy or --baseline says which are"
    ]
    assert [alarm.signals[0][0] for alarm in course.alarms] == [NAMES[0]]


def test_no_alarm_is_raised_in_what_is_fault_free_by_order(faulty: SignalTable) -> None:
    (course,) = watch([faulty], [], Watching(healthy=600))
    assert all(alarm.first >= 600 for alarm in course.alarms)


def test_a_signal_that_stands_still_is_left_out_and_named(fault_free: SignalTable, faulty: SignalTable) -> None:
    still = replace(fault_free, values=np.where(np.arange(4) == 1, 7.0, fault_free.values))
    said: list[str] = []
    (course,) = watch([faulty], [still], Watching(), said.append)
    assert said == ["constant in the fault-free rows, and left out: 'level'"]
    assert course.table.signals == (NAMES[0], NAMES[2], NAMES[3])


@pytest.mark.parametrize(
    ("rows", "how", "words"),
    [
        (900, Watching(healthy=900), "has 900 rows; none is left to judge after 900 fault-free ones"),
        (900, Watching(healthy=20), "20 fault-free rows are too few to judge by; at least 120"),
        (900, Watching(healthy=-5), "-5 fault-free rows are too few"),
        (100, Watching(), "has 100 rows; none is left to judge after 120"),
        (900, Watching(("nothing",)), "'nothing' is no detector"),
    ],
)
def test_what_cannot_be_judged_is_refused(tmp_path: Path, rows: int, how: Watching, words: str) -> None:
    with pytest.raises(DetectionError, match=words):
        watch([read_table(written(tmp_path / "t.csv", rows))], [], how)


def test_nothing_moves(fault_free: SignalTable) -> None:
    with pytest.raises(DetectionError, match=r"every signal is constant in the fault-free rows"):
        watch([fault_free], [replace(fault_free, values=np.ones_like(fault_free.values))], Watching())


def test_another_unit_is_no_fault(fault_free: SignalTable, faulty: SignalTable) -> None:
    kelvin = replace(faulty, values=faulty.values + np.array([0.0, 0.0, 273.15, 0.0]))
    with pytest.raises(DetectionError, match=r"'temperature' is between .*: another unit"):
        watch([kelvin], [fault_free], Watching())


def test_fewer_rows_than_last_are_no_alarm() -> None:
    scores = [0.0] * 10 + [2.0] * (LASTING - 1) + [0.0] * 10 + [2.0] * LASTING + [0.5] * 10
    (alarm,) = alarms(judged(scores), ["ewma"], ["a"])
    assert (alarm.first, alarm.rows, alarm.peak) == (20 + LASTING - 1, LASTING, 2.0)


def test_a_short_gap_does_not_part_an_alarm() -> None:
    scores = [2.0] * 8 + [0.5] * (LASTING - 1) + [3.0] * 8 + [0.5] * LASTING + [2.0] * 8
    assert [(a.first, a.last) for a in alarms(judged(scores), ["ewma"], ["a"])] == [(0, 20), (27, 34)]


@pytest.mark.slow
def test_the_picture_has_the_signals_of_the_alarms_first(fault_free: SignalTable, faulty: SignalTable) -> None:
    named = replace(faulty, name="pump $x_1$.csv")
    (course,) = watch([named], [fault_free], Watching())
    assert shown_signals(course)[0] == NAMES[0]
    picture = draw(course)
    assert picture.startswith(b"\x89PNG") and picture == draw(course)


def test_equal_tables_are_judged_equally(fault_free: SignalTable, faulty: SignalTable) -> None:
    (first,), (second,) = (watch([faulty], [fault_free], Watching()) for _ in range(2))
    assert np.array_equal(first.judged.scores, second.judged.scores) and first.alarms == second.alarms


def test_too_many_signals_are_refused() -> None:
    many = SignalTable("wide", tuple(f"s{k}" for k in range(1_001)), np.arange(200.0), np.zeros((200, 1_001)))
    with pytest.raises(DetectionError, match=r"wide has 1001 signals; at most 1000"):
        watch([many], [], Watching())


def test_values_that_nobody_measured_do_no_harm(fault_free: SignalTable, faulty: SignalTable) -> None:
    values = faulty.values.copy()
    values[100, 0], values[110, 1], values[120, 2] = 1e308, -np.inf, 1e90
    (course,) = watch([replace(faulty, values=values)], [fault_free], Watching())
    assert np.isfinite(course.judged.scores).all() and course.over[120] and not course.over[100]
