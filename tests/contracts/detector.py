"""What every detector must do. A test class inherits this and says which detector it is about."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.detectors.detector import Detector, Learned, Values

SIGNALS = 4
SHIFT = 12.0
"""Shift that no detector may overlook [standard deviations]."""


def course(rows: int, signals: int = SIGNALS, seed: int = 1) -> Values:
    """Fault-free rows of signals that have two causes: mean 0 and deviation 1, shape (rows, signals)."""
    drawn = np.random.default_rng(seed)
    mixing = np.random.default_rng(0).normal(size=(2, signals))
    causes = drawn.normal(size=(rows, 2))
    for k in range(1, rows):
        causes[k] += 0.7 * causes[k - 1]
    values: Values = causes @ mixing + 0.5 * drawn.normal(size=(rows, signals))
    return (values - values.mean(axis=0)) / values.std(axis=0)


class DetectorContract:
    """Inherit, and provide the fixture ``detector``."""

    @pytest.fixture
    def learned(self, detector: Detector) -> Learned:
        return detector.learn([course(400), course(200, seed=2)])

    def test_each_row_has_finite_statistics(self, learned: Learned) -> None:
        found = learned.statistics(course(150, seed=3))
        assert found.ndim == 2 and len(found) == 150 and np.isfinite(found).all() and (found >= 0.0).all()

    def test_rows_that_are_far_away_have_finite_statistics(self, learned: Learned) -> None:
        rows = course(50, seed=3)
        rows[10:, 0], rows[30:, 1] = 1e9, -1e9
        assert np.isfinite(learned.statistics(rows)).all()

    def test_a_single_row_has_statistics(self, learned: Learned) -> None:
        assert np.isfinite(learned.statistics(np.zeros((1, SIGNALS)))).all()

    def test_later_rows_change_nothing(self, learned: Learned) -> None:
        rows = course(120, seed=4)
        found = learned.statistics(rows)
        for end in (1, 2, 60, 119):
            assert np.allclose(learned.statistics(rows[:end]), found[:end], rtol=1e-9)

    def test_equal_rows_teach_the_same(self, detector: Detector, learned: Learned) -> None:
        again = detector.learn([course(400), course(200, seed=2)])
        rows = course(100, seed=5)
        assert np.array_equal(learned.statistics(rows), again.statistics(rows))

    def test_nothing_that_it_is_given_is_changed(self, detector: Detector) -> None:
        run, rows = course(200), course(50, seed=3)
        before = run.copy(), rows.copy()
        detector.learn([run]).statistics(rows)
        assert np.array_equal(run, before[0]) and np.array_equal(rows, before[1])

    def test_the_number_of_statistics_depends_on_the_signals_alone(self, detector: Detector, learned: Learned) -> None:
        noise = np.random.default_rng(6).normal(size=(150, SIGNALS))
        rows = course(10, seed=7)
        assert detector.learn([noise]).statistics(rows).shape == learned.statistics(rows).shape

    def test_a_large_shift_of_all_signals_stands_out(self, learned: Learned) -> None:
        rows = course(300, seed=8)
        usual = np.quantile(learned.statistics(rows), 0.99, axis=0)
        rows[150:] += SHIFT
        beyond = (learned.statistics(rows) > usual).any(axis=1)
        assert beyond[170:].mean() > 0.9 and beyond[:150].mean() < 0.1

    @pytest.mark.parametrize("signal", range(SIGNALS))
    def test_a_large_shift_of_any_one_is_seen(self, learned: Learned, signal: int) -> None:
        """A forest says less of one signal among several than the others do: it is in the upper quarter, at least."""
        rows = course(300, seed=8)
        usual = np.quantile(learned.statistics(rows), 0.75, axis=0)
        rows[150:, signal] += SHIFT
        assert (learned.statistics(rows)[170:] > usual).any(axis=1).mean() > 0.7

    @pytest.mark.parametrize("signals", [1, 2])
    def test_few_signals_are_enough(self, detector: Detector, signals: int) -> None:
        learned = detector.learn([course(200, signals)])
        rows = course(100, signals, seed=9)
        usual = np.quantile(learned.statistics(rows), 0.9, axis=0)
        rows[50:] += SHIFT
        found = learned.statistics(rows)
        assert np.isfinite(found).all() and (found[70:] > usual).any(axis=1).mean() > 0.9

    def test_a_signal_that_stands_still_is_borne(self, detector: Detector) -> None:
        run = course(200)
        run[:, 2] = 0.0
        assert np.isfinite(detector.learn([run]).statistics(run)).all()
