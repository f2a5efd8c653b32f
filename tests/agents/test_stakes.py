"""Stakes: what knowing is worth, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.agents.probing.stakes import Stakes

HALF = np.array([0.5, 0.5])


def test_where_each_forbids_what_the_other_asks_for_knowing_saves_the_fallback() -> None:
    stakes = Stakes.of(np.array([[0.1, 20.0], [30.0, 0.3]]), HALF)
    assert stakes.value == pytest.approx(1.0 - 0.2) and stakes.opposed[0, 1] and not stakes.opposed[0, 0]


def test_where_one_answer_is_best_for_both_there_is_nothing_to_know() -> None:
    stakes = Stakes.of(np.array([[0.1, 0.2], [0.3, 0.3]]), HALF)
    assert stakes.value == pytest.approx(0.0) and not stakes.opposed.any()


def test_answers_that_hardly_differ_are_no_opposites() -> None:
    stakes = Stakes.of(np.array([[0.100, 0.205], [0.105, 0.200]]), HALF)
    assert not stakes.opposed.any() and stakes.value < 0.01


def test_a_safe_answer_that_costs_little_makes_knowing_worth_little() -> None:
    stakes = Stakes.of(np.array([[0.1, 20.0], [30.0, 0.3], [0.35, 0.35]]), HALF)
    assert stakes.value == pytest.approx(0.35 - 0.2)


def test_two_that_nothing_helps_are_not_opposed() -> None:
    stakes = Stakes.of(np.array([[5.0, 20.0], [30.0, 9.0]]), HALF)
    assert stakes.value == 0.0 and not stakes.opposed.any()


def test_what_cannot_be_judged_is_forbidden() -> None:
    stakes = Stakes.of(np.array([[np.nan, 0.1], [np.inf, 0.2], [0.5, 0.5]]), HALF)
    assert stakes.value == pytest.approx(0.5 - 0.3)


def test_without_any_answer_there_is_the_fallback() -> None:
    stakes = Stakes.of(np.empty((0, 2)), HALF)
    assert stakes.value == 0.0


def test_evidence_decides_its_share_and_only_between_opposites() -> None:
    stakes = Stakes.of(np.array([[0.1, 20.0, 0.1], [30.0, 0.3, 30.0]]), np.array([0.4, 0.3, 0.3]))
    assert stakes.opposed.tolist() == [[False, True, False], [True, False, True], [False, True, False]]
    nats = np.zeros((3, 3))
    assert stakes.told_apart(nats) == 0.0
    nats[0, 2] = nats[2, 0] = 100.0
    assert stakes.told_apart(nats) == 0.0, "these two ask for the same"
    nats[:] = 4.0
    assert stakes.told_apart(nats) == pytest.approx(math.erf(1.0))
    nats[0, 1] = 0.0
    assert stakes.told_apart(nats) < math.erf(1.0), "the weaker direction counts"


def test_regret_is_what_is_lost_against_the_right_answer() -> None:
    stakes = Stakes.of(np.array([[0.1, 20.0], [30.0, 0.3]]), HALF)
    assert stakes.regret(np.array([0.1, 0.3])) == 0.0
    assert stakes.regret(np.array([0.1, 50.0])) == pytest.approx(0.35), "no more than the fallback"
