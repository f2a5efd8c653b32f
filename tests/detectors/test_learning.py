"""Limits keep the rate that was stated, and what has no level is known."""

from __future__ import annotations

import re

import numpy as np
import pytest

from homeostat.detectors.catalogue import detectors
from homeostat.detectors.detector import Values
from homeostat.detectors.error import DetectionError
from homeostat.detectors.learning import Baseline
from homeostat.detectors.level import LEVEL, WALK, WANDERS, departures, levelled
from homeostat.detectors.splits import FOLDS, folds, pairs
from tests.contracts.detector import course


def walk(rows: int, seed: int) -> Values:
    """A random walk, shape (rows, 1)."""
    return np.cumsum(np.random.default_rng(seed).normal(size=(rows, 1)), axis=0)


@pytest.mark.parametrize("names", [("ewma", "cva"), ("pca",), ("three-sigma", "cusum", "ewma", "pca", "cva")], ids=str)
@pytest.mark.parametrize("stated", [0.01, 0.05])
def test_fresh_fault_free_rows_are_beyond_the_limit_at_about_the_stated_rate(
    names: tuple[str, ...], stated: float
) -> None:
    baseline = Baseline.of([course(3_000, seed=k) for k in range(3)], detectors(names, 1), stated)
    rates = [(baseline.judge(course(3_000, seed=k)).scores.max(axis=1) > 1.0).mean() for k in range(10, 16)]
    assert 0.3 * stated < np.mean(rates) < 2.0 * stated


def test_detectors_have_equal_shares_in_the_false_alarms() -> None:
    baseline = Baseline.of([course(6_000)], detectors(("three-sigma", "pca"), 1), 0.05)
    share = (baseline.judge(course(6_000, seed=2)).scores > 1.0).mean(axis=0)
    assert share[0] == pytest.approx(share[1], rel=0.6)


def test_a_table_is_judged_by_its_own_level() -> None:
    runs = [course(400, seed=k) + 100.0 * k for k in range(6)]
    baseline = Baseline.of(runs, detectors(("ewma",), 1), 0.02, healthy=400)
    rows = course(1_000, seed=9) - 5_000.0
    assert (baseline.judge(rows, 400).scores > 1.0).mean() < 0.1
    rows[600:, 1] += 6.0
    assert (baseline.judge(rows, 400).scores[620:] > 1.0).mean() > 0.9


def test_a_level_that_departs_from_table_to_table_is_given_the_room() -> None:
    """What signals do between fault-free pieces is no alarm in the next table."""
    shifts = np.random.default_rng(1).normal(scale=2.0, size=60)
    pieces = [course(200, seed=k) + shift for k, shift in enumerate(shifts)]
    runs = [np.concatenate(pieces[2 * k : 2 * k + 2]) for k in range(30)]
    judged = Baseline.of(runs, detectors(("ewma",), 1), 0.05, healthy=400)
    told = [judged.judge(np.concatenate([course(400, seed=k), course(200, seed=k + 1) + 2.0]), 400) for k in range(5)]
    assert np.mean([(t.scores[430:] > 1.0).mean() for t in told]) < 0.3


def test_a_walk_is_told_from_a_level() -> None:
    runs = [np.concatenate([walk(4_000, k), course(4_000, 1, seed=k)], axis=1) for k in range(60)]
    found = departures(runs)
    assert found[0] == pytest.approx(WALK, rel=0.5) and found[1] == pytest.approx(LEVEL, rel=0.1)
    assert (found > WANDERS).tolist() == [True, False]


def test_that_a_signal_was_switched_in_one_run_does_not_make_it_wander() -> None:
    switched = course(400, 1)
    switched[200:] += 1_000.0
    runs = [switched, *(course(400, 1, seed=k) for k in range(2, 20))]
    assert LEVEL < departures(runs)[0] < WANDERS < departures([switched])[0]


def test_what_stands_still_says_nothing_of_a_level() -> None:
    still = np.ones((400, 1))
    assert departures([still]).tolist() == [0.0]
    assert departures([still, walk(400, 1)])[0] == departures([walk(400, 1)])[0]


def test_what_wanders_is_seen_by_its_changes() -> None:
    rows = np.array([[5.0, 5.0], [6.0, 7.0], [9.0, 4.0]])
    assert levelled(rows, np.array([True, False])).tolist() == [[0.0, 5.0], [1.0, 7.0], [3.0, 4.0]]


def test_no_row_is_judged_by_itself() -> None:
    """Rows are their own numbers: what is learned and what is judged share none, and every row is judged once."""
    runs = [np.arange(100.0)[:, None], np.arange(1_000.0, 1_061.0)[:, None]]
    judged: list[float] = []
    for split in folds(runs):
        mine = split.judged[split.context :, 0].tolist()
        assert not set(mine) & {row for part in split.learned for row in part[:, 0].tolist()}
        judged += mine
    assert sorted(judged) == [*np.arange(100.0), *np.arange(1_000.0, 1_061.0)] and len(folds(runs)) == 2 * FOLDS


def test_a_piece_is_judged_by_the_one_before_it() -> None:
    many = pairs([np.arange(2_000.0)[:, None]], 200)
    assert len(many) == 19
    for split in many:
        assert split.learned[0][-1, 0] + 1.0 == split.judged[split.context, 0]
        assert len(split.learned[0]) == len(split.judged) - split.context == 100


def test_few_pieces_are_judged_in_both_directions() -> None:
    firsts = [
        split.judged[split.context, 0] - split.learned[0][-1, 0] for split in pairs([np.arange(500.0)[:, None]], 200)
    ]
    assert firsts == [1.0] * 4 + [-1.0] * 4


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_a_table_alone_keeps_about_the_stated_rate(memory: float) -> None:
    """One table of 400 fault-free rows knows little: three times the stated rate is what it may come to."""
    rates = []
    for seed in range(20):
        rows = np.random.default_rng(seed).normal(size=(1_400, 4))
        for k in range(1, len(rows)):
            rows[k] += memory * rows[k - 1]
        baseline = Baseline.of([rows[:400]], detectors(("ewma", "cva"), 1), 0.01, healthy=400)
        rates.append((baseline.judge(rows, 400).scores[400:].max(axis=1) > 1.0).mean())
    assert np.mean(rates) < 0.03


def test_too_few_rows_are_refused_with_how_many_are_needed() -> None:
    with pytest.raises(DetectionError, match=r"59 fault-free rows are too few to learn from; at least 60"):
        Baseline.of([course(59)], detectors(("ewma",), 1), 0.05)
    with pytest.raises(DetectionError, match=r"cannot be told from 400 .* give 2000 rows, or allow at least 0.005"):
        Baseline.of([course(400)], detectors(("ewma",), 1), 0.001)


@pytest.mark.parametrize(("rows", "share"), [(150, 0.01), (136, 0.01), (150, 0.013), (132, 0.0151), (100, 0.015)])
def test_the_rate_and_the_rows_that_are_told_as_enough_are(rows: int, share: float) -> None:
    with pytest.raises(DetectionError, match=r"cannot be told") as refused:
        Baseline.of([course(rows)], detectors(("ewma",), 1), share)
    told = re.search(r"give (\d+) rows, or allow at least ([\d.]+)", str(refused.value))
    assert told is not None
    Baseline.of([course(rows)], detectors(("ewma",), 1), float(told[2]))
    Baseline.of([course(int(told[1]))], detectors(("ewma",), 1), share)


def test_equal_rows_are_judged_equally() -> None:
    scores = [
        Baseline.of([course(500)], detectors(("ewma", "cva", "pca"), 1), 0.02).judge(course(200, seed=4)).scores
        for _ in range(2)
    ]
    assert np.array_equal(*scores)
