"""On recordings of others: the bars that the page of results states, which nothing here may lower."""

from __future__ import annotations

import pytest

from benchmarks.monitor.data import DATA, skab
from benchmarks.monitor.on_skab import found, score
from benchmarks.monitor.on_tep import at_equal_rate, at_stated_rate
from homeostat.detectors.catalogue import USUAL

SKAB = pytest.mark.reference("SKAB", DATA / "skab")
TEP = pytest.mark.reference("recordings of the Tennessee Eastman process", DATA / "tep")


@SKAB
def test_more_is_found_on_skab_than_was_published_with_fewer_false_alarms() -> None:
    experiments, free = skab(DATA / "skab")
    measured = score(experiments, found(experiments, free, USUAL, 0.135))
    assert measured.f1 > 0.80 and measured.far < 0.14
    alone = score(experiments, found(experiments, free, ("ewma",), 0.10))
    assert alone.f1 > 0.80 and alone.far < 0.10


@TEP
def test_disturbances_are_detected_at_the_rate_of_false_alarms_of_plain_pca() -> None:
    together, plain = (at_equal_rate(DATA / "tep", names, 0.01) for names in (USUAL, ("pca",)))
    assert together.mean >= 0.95 > plain.mean
    assert all(rate > plain.rates[n] - 0.02 for n, rate in together.rates.items())
    assert together.delays_min[16] < plain.delays_min[16] / 10


@TEP
def test_the_stated_rate_is_near_in_rows_from_which_nothing_was_learned() -> None:
    stated = at_stated_rate(DATA / "tep", USUAL, 0.01)
    assert stated.mean >= 0.95 and stated.false_alarms < 0.03
