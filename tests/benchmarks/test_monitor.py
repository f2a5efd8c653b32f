"""The study of the detectors counts as the benchmark does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.monitor.data import HEALTHY, ONSET, Experiment, faults, recording, skab
from benchmarks.monitor.on_skab import Score, score
from benchmarks.monitor.on_tep import at_equal_rate
from homeostat.detectors.tables.table import SignalTable


def experiment(name: str, labelled: slice, rows: int = HEALTHY + 100) -> Experiment:
    table = SignalTable(name, ("a",), np.arange(float(rows)), np.zeros((rows, 1)))
    anomalous = np.zeros(rows, dtype=bool)
    anomalous[labelled] = True
    return Experiment(name, table, anomalous)


def test_rows_after_the_first_400_of_every_file_are_counted_together() -> None:
    first, second = experiment("a", slice(HEALTHY, HEALTHY + 50)), experiment("b", slice(0, HEALTHY + 10))
    said = np.zeros(HEALTHY + 100, dtype=bool)
    said[HEALTHY - 100 : HEALTHY + 25] = True
    assert score([first, second], {"a": said, "b": said}) == Score(25 + 10, 15, 25, 125)


def test_f1_false_alarms_and_misses() -> None:
    told = Score(hits=30, false_alarms=10, misses=20, rejections=90)
    assert (told.f1, told.far, told.mar) == (60 / 90, 0.1, 0.4)


def test_no_label_reaches_a_detector(tmp_path: Path) -> None:
    rows = "".join(f"2026-01-01 00:{k // 60:02d}:{k % 60:02d};{k % 7};{int(k > 50)};0\n" for k in range(100))
    for name in ("valve1/0", "anomaly-free/anomaly-free"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / f"{name}.csv").write_text("datetime;Current;anomaly;changepoint\n" + rows)
    (only,), _ = skab(tmp_path)
    assert only.name == "valve1/0" and only.table.signals == ("Current",) and only.anomalous.sum() == 49


def test_a_delay_is_the_time_to_six_rows_in_a_row(tmp_path: Path) -> None:
    drawn = np.random.default_rng(1)
    np.savez(tmp_path / "d00.npz", train=drawn.normal(size=(500, 3)), test=drawn.normal(size=(960, 3)))
    test = drawn.normal(size=(960, 3))
    test[ONSET + 10 :, 0] += 20.0
    np.savez(tmp_path / "d07.npz", train=test[:480], test=test)
    assert faults(tmp_path) == [7] and recording(tmp_path, 7)[1].shape == (960, 3)
    found = at_equal_rate(tmp_path, ["three-sigma"], 0.01)
    assert found.delays_min[7] == 33.0 and found.rates[7] == pytest.approx(790 / 800, abs=0.01)
    assert found.false_alarms < 0.05
