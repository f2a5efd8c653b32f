"""Scores of trajectories that were made by hand, so that every number can be checked."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from homeostat.campaign.scoring import CALM_S, OutcomeKind, exposures, inside_at_end, outcome, production_loss
from homeostat.domain.limits import Limits
from homeostat.domain.snapshot import Trajectory
from tests.safety.world import CALM, COLD, FEED, HOT

LIMITS = Limits((HOT, COLD, FEED), (CALM,))


def truth(dt_s: float = 1.0, **signals: list[float] | np.ndarray) -> Trajectory:
    """One member; the first sample is at 1 s."""
    rows = {tag: np.atleast_2d(np.asarray(values, dtype=float)) for tag, values in signals.items()}
    return Trajectory(1.0, dt_s, rows)


def temperatures(*stretches: tuple[float, int]) -> Trajectory:
    """Stretches of constant temperature, in samples."""
    values = np.concatenate([np.full(count, value) for value, count in stretches])
    return truth(T=values, L=np.full(values.size, 8.0))


# --- exposure ---------------------------------------------------------------------------------------------------


def test_exposure_counts_the_seconds_outside_each_limit() -> None:
    run = temperatures((310.0, 10), (314.0, 7), (310.0, 5), (290.0, 3), (310.0, 5))
    hot, cold = exposures(run, LIMITS, 0.0, None)
    assert (hot.limit, hot.total_s, hot.from_detection_s) == ("LIM-HOT", 7.0, 0.0)
    assert (cold.limit, cold.total_s) == ("LIM-COLD", 3.0)


def test_permissives_and_criteria_are_no_exposure() -> None:
    wet = truth(T=[310.0] * 4, L=[12.0] * 4)
    assert [e.limit for e in exposures(wet, LIMITS, 0.0, 0.0)] == ["LIM-HOT", "LIM-COLD"]
    assert all(e.total_s == 0.0 for e in exposures(wet, LIMITS, 0.0, 0.0))


@pytest.mark.parametrize(("value", "seconds"), [(313.0, 0.0), (math.nextafter(313.0, 400.0), 4.0)])
def test_at_the_limit_is_inside(value: float, seconds: float) -> None:
    assert exposures(temperatures((value, 4)), LIMITS, 0.0, None)[0].total_s == seconds


@pytest.mark.parametrize(("started_s", "seconds"), [(0.0, 10.0), (1.0, 9.0), (4.0, 6.0), (10.0, 0.0), (99.0, 0.0)])
def test_start_up_does_not_count(started_s: float, seconds: float) -> None:
    assert exposures(temperatures((350.0, 10)), LIMITS, started_s, None)[0].total_s == seconds


@pytest.mark.parametrize(
    ("detected_s", "seconds"), [(None, 0.0), (0.0, 6.0), (4.0, 6.0), (5.0, 5.0), (9.5, 1.0), (10.0, 0.0)]
)
def test_exposure_from_detection_starts_after_it(detected_s: float | None, seconds: float) -> None:
    hot, _ = exposures(temperatures((310.0, 4), (320.0, 6)), LIMITS, 0.0, detected_s)
    assert (hot.from_detection_s, hot.total_s) == (seconds, 6.0)


def test_the_sampling_period_counts() -> None:
    assert exposures(truth(dt_s=5.0, T=[320.0] * 3, L=[8.0] * 3), LIMITS, 0.0, 0.0)[0].total_s == 15.0


# --- the end ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stretches", "inside"),
    [
        (((310.0, 1000),), True),
        (((320.0, 700), (310.0, 300)), True),
        (((320.0, 701), (310.0, 299)), False),
        (((310.0, 999), (313.1, 1)), False),
        (((310.0, 999), (313.0, 1)), True),
        (((310.0, 600), (290.0, 400)), True),
        (((310.0, 10),), True),
        (((320.0, 10),), False),
    ],
)
def test_the_end_is_calm_within_the_hard_limits(stretches: tuple[tuple[float, int], ...], inside: bool) -> None:
    assert CALM_S == 300.0
    assert inside_at_end(temperatures(*stretches), LIMITS) is inside


# --- production -------------------------------------------------------------------------------------------------


def made(rates: list[float]) -> Trajectory:
    return truth(product=np.cumsum(rates), level=np.zeros(len(rates)))


HEALTHY = made([1.0] * 100)


def test_production_loss_is_the_missing_fraction() -> None:
    assert production_loss(HEALTHY, HEALTHY, ["product"], 20.0) == 0.0
    assert production_loss(made([1.0] * 20 + [0.5] * 80), HEALTHY, ["product"], 20.0) == pytest.approx(0.5)
    assert production_loss(made([1.0] * 20 + [0.0] * 80), HEALTHY, ["product"], 20.0) == pytest.approx(1.0)


def test_producing_more_is_a_negative_loss() -> None:
    assert production_loss(made([1.0] * 20 + [1.2] * 80), HEALTHY, ["product"], 20.0) == pytest.approx(-0.2)


def test_what_happened_before_does_not_count() -> None:
    late_start = made([0.0] * 20 + [1.0] * 80)
    assert production_loss(late_start, HEALTHY, ["product"], 20.0) == pytest.approx(0.0)
    assert production_loss(late_start, HEALTHY, ["product"], 1.0) == pytest.approx(19.0 / 99.0)


def test_a_stretch_can_be_scored() -> None:
    dip = made([1.0] * 40 + [0.0] * 20 + [1.0] * 40)
    assert production_loss(dip, HEALTHY, ["product"], 20.0, 40.0) == pytest.approx(0.0)
    assert production_loss(dip, HEALTHY, ["product"], 40.0, 60.0) == pytest.approx(1.0)
    assert production_loss(dip, HEALTHY, ["product"], 20.0, 60.0) == pytest.approx(0.5)


def test_what_is_still_in_the_plant_is_not_lost() -> None:
    """Everything that was held back is in the vessel: nothing is lost where both are counted."""
    count = 100
    kept = truth(product=np.cumsum([1.0] * 20 + [0.4] * 80), level=np.cumsum([0.0] * 20 + [0.6] * 80))
    healthy = truth(product=np.cumsum([1.0] * count), level=np.zeros(count))
    assert production_loss(kept, healthy, ["product", "level"], 20.0) == pytest.approx(0.0)
    assert production_loss(kept, healthy, ["product"], 20.0) == pytest.approx(0.6)


def test_where_nothing_would_have_been_made_there_is_no_fraction() -> None:
    idle = made([0.0] * 100)
    assert math.isnan(production_loss(HEALTHY, idle, ["product"], 20.0))


# --- outcome ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("faulty", "detected", "released", "fallbacks", "inside"),
    list(itertools.product([True, False], [True, False], [0, 1, 3], [0, 1, 2], [True, False])),
)
def test_the_outcome_of_every_combination(
    faulty: bool, detected: bool, released: int, fallbacks: int, inside: bool
) -> None:
    kind = outcome(faulty, detected, released, fallbacks, inside)
    if fallbacks:
        assert kind is OutcomeKind.HANDED_OVER, "handing over is never success"
    elif faulty and not detected:
        assert kind is OutcomeKind.NOT_DETECTED
    elif not inside:
        assert kind is OutcomeKind.HANDED_OVER
    else:
        assert kind is (OutcomeKind.RECOVERED if released else OutcomeKind.NO_ACTION)
