"""Symptoms: what deviates far enough for long enough, on the right side, and comes back before it goes."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.monitoring.symptoms import SymptomWatch
from homeostat.domain.diagnosis import Direction, Symptom, SymptomRule
from homeostat.domain.plant.baseline import Baseline

MEAN, WITHIN, BETWEEN = 10.0, 3.0, 4.0
"""The total deviation is hypot(3, 4) = 5."""
BASELINE = Baseline("F", MEAN, WITHIN, BETWEEN, 0.0, 0.0, MEAN, 0.0, 0.0)


def watch(
    direction: Direction = Direction.HIGH, sigma: float = 2.0, threshold: float = 0.0, on_delay_s: float = 3.0
) -> SymptomWatch:
    """Threshold 2 * 5 = 10 before centring, 2 * 3 = 6 after."""
    return SymptomWatch(SymptomRule("S", "F", direction, sigma, threshold, on_delay_s, (), ""), BASELINE)


def feed(watch: SymptomWatch, *values: float, start_s: float = 0.0) -> list[Symptom | None]:
    return [watch.update(value, start_s + k) for k, value in enumerate(values)]


def active(watch: SymptomWatch, *values: float, start_s: float = 0.0) -> list[bool]:
    return [s is not None for s in feed(watch, *values, start_s=start_s)]


def test_a_deviation_counts_once_it_has_lasted() -> None:
    assert active(watch(on_delay_s=3.0), *[25.0] * 6) == [False, False, False, True, True, True]
    assert active(watch(on_delay_s=0.0), 25.0) == [True]


def test_the_symptom_says_when_how_much_and_against_what() -> None:
    symptom = feed(watch(on_delay_s=2.0), 25.0, 26.0, 27.0, 99.0, start_s=100.0)[-1]
    assert symptom == Symptom("S", 102.0, 17.0, 10.0, 1.7), "it keeps what was seen when it was confirmed"


@pytest.mark.parametrize("value", [20.0, math.nextafter(20.0, 99.0), 1e308])
def test_the_threshold_itself_counts(value: float) -> None:
    assert active(watch(on_delay_s=0.0), value) == [True]


@pytest.mark.parametrize("value", [math.nextafter(20.0, 0.0), 10.0, 0.0, -1e308])
def test_below_the_threshold_nothing_counts(value: float) -> None:
    assert active(watch(on_delay_s=0.0), value) == [False]


def test_a_short_excursion_starts_over() -> None:
    assert active(watch(on_delay_s=2.0), 25.0, 25.0, 10.0, 25.0, 25.0, 25.0) == [False] * 5 + [True]


@pytest.mark.parametrize(
    ("direction", "high", "low"),
    [(Direction.HIGH, True, False), (Direction.LOW, False, True), (Direction.BOTH, True, True)],
)
def test_only_the_side_of_the_rule_counts(direction: Direction, high: bool, low: bool) -> None:
    assert active(watch(direction, on_delay_s=0.0), MEAN + 11.0) == [high]
    assert active(watch(direction, on_delay_s=0.0), MEAN - 11.0) == [low]


def test_the_deviation_keeps_its_sign() -> None:
    (symptom,) = feed(watch(Direction.LOW, on_delay_s=0.0), MEAN - 12.0)
    assert symptom is not None and (symptom.value, symptom.severity) == (-12.0, 1.2)


def test_a_symptom_goes_only_below_the_return_band() -> None:
    one = watch(on_delay_s=0.0)
    assert active(one, 25.0, 19.0, 17.01, 16.99, 19.0) == [True, True, True, False, False]
    assert one.active is None


def test_it_comes_back_only_after_another_delay() -> None:
    assert active(watch(on_delay_s=2.0), 25.0, 25.0, 25.0, 10.0, 25.0, 25.0, 25.0) == [
        False, False, True, False, False, False, True,
    ]  # fmt: skip


def test_the_threshold_is_the_least_that_counts() -> None:
    assert watch(threshold=12.0).threshold == 12.0 and watch(threshold=9.0).threshold == 10.0
    assert active(watch(threshold=12.0, on_delay_s=0.0), 21.0, 22.0) == [False, True]


def test_the_plant_s_own_mean_replaces_the_design_s() -> None:
    one = watch(on_delay_s=0.0)
    one.centre(15.0)
    assert one.threshold == 6.0, "only the spread within a run counts then"
    assert active(one, 20.9, 21.0) == [False, True]


def test_what_was_learned_follows_the_plant_no_further_than_healthy_plants_differ() -> None:
    """They differ by 4: what was learned moves by 8 at most, and comes back."""
    one = watch(on_delay_s=0.0)
    one.follow(40.0, 1.0)
    assert active(one, 20.0) == [True], "nothing was learned yet"
    one.centre(15.0)
    one.follow(19.0, 0.5)
    assert active(one, -99.0, 22.9, 23.0) == [False, False, True]
    for _ in range(100):
        one.follow(40.0, 0.5)
    assert active(one, -99.0, 28.9, 29.0) == [False, False, True]
    for _ in range(100):
        one.follow(-40.0, 0.5)
    assert active(one, -99.0, 12.9, 13.0) == [False, False, True]


PLAUSIBLE = [(30.0, True), (30.001, False), (-10.0, True), (-10.001, False), (1e9, False), (math.nan, False)]


@pytest.mark.parametrize(("mean", "taken"), PLAUSIBLE)
def test_an_implausible_mean_is_refused(mean: float, taken: bool) -> None:
    """A plant that was never healthy must not make its fault the reference: 4 total deviations of 5 are the limit."""
    one = watch()
    one.centre(mean)
    assert (one.threshold == 6.0) is taken
    assert active(watch_centred_at(mean), MEAN) == [taken and abs(MEAN - mean) >= 6.0]


def watch_centred_at(mean: float) -> SymptomWatch:
    one = watch(Direction.BOTH, on_delay_s=0.0)
    one.centre(mean)
    return one


@given(st.lists(st.floats(-100.0, 100.0), max_size=40), st.integers(0, 5), st.sampled_from(Direction))
def test_a_symptom_has_lasted_and_has_not_returned(values: list[float], delay: int, direction: Direction) -> None:
    one = watch(direction, on_delay_s=float(delay))
    excess = [_excess(direction, value) for value in values]
    for k, value in enumerate(values):
        symptom = one.update(value, float(k))
        if symptom is None:
            continue
        confirmed = int(symptom.at_s)
        assert excess[confirmed] >= 1.0 and symptom.severity == excess[confirmed]
        assert min(excess[confirmed : k + 1]) >= 0.7, "it would have gone"
        since = max(0, confirmed - delay)
        assert confirmed - delay >= 0 and min(excess[since : confirmed + 1]) >= 0.7, "it had not lasted"


def _excess(direction: Direction, value: float) -> float:
    deviation = value - MEAN
    return {Direction.HIGH: deviation, Direction.LOW: -deviation, Direction.BOTH: abs(deviation)}[direction] / 10.0
