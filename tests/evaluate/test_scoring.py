"""Scores of trajectories that were made by hand, so that every number can be checked."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.production import Production
from homeostat.domain.plant.rules import StartUp
from homeostat.domain.plant.timing import Timing
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.score.limits_in_force import LimitsInForce, in_force
from homeostat.evaluate.score.scoring import (
    CALM_S,
    DELIVERED_S,
    RETURN_S,
    delivers_at_end,
    exposures,
    fed_at_end,
    has_product,
    inside_at_end,
    kept_until,
    missed_at_end,
    outside_after,
    production_loss,
    worse,
)
from homeostat.record.run_record import Span
from tests.safety.world import CALM, COLD, FEED, HOT, criterion, rule
from tests.twin.followed import reactor

LIMITS = Limits((HOT, COLD, FEED), (CALM,))
FORCE = LimitsInForce(LIMITS)
WARM = rule("LIM-HOT", LimitKind.TRIP_LIMIT, "T <= 340", hard=True)
STARTING = StartUp(frozenset({"waiting"}), {"LIM-HOT": WARM}, {"waiting": 5.0})


def starting_until(ended_s: float) -> LimitsInForce:
    """A start-up from the first sample to ``ended_s`` [s], in which more heat is allowed."""
    return LimitsInForce(LIMITS, STARTING, ((1.0, ended_s),))


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
    hot, cold = exposures(run, FORCE, None)
    assert (hot.limit, hot.total_s, hot.from_detection_s) == ("LIM-HOT", 7.0, 0.0)
    assert (cold.limit, cold.total_s) == ("LIM-COLD", 3.0)


def test_permissives_and_criteria_are_no_exposure() -> None:
    wet = truth(T=[310.0] * 4, L=[12.0] * 4)
    assert [e.limit for e in exposures(wet, FORCE, 0.0)] == ["LIM-HOT", "LIM-COLD"]
    assert all(e.total_s == 0.0 for e in exposures(wet, FORCE, 0.0))


@pytest.mark.parametrize(("value", "seconds"), [(313.0, 0.0), (math.nextafter(313.0, 400.0), 4.0)])
def test_at_the_limit_is_inside(value: float, seconds: float) -> None:
    assert exposures(temperatures((value, 4)), FORCE, None)[0].total_s == seconds


@pytest.mark.parametrize(("started_s", "seconds"), [(0.0, 10.0), (1.0, 9.0), (4.0, 6.0), (10.0, 0.0), (99.0, 0.0)])
def test_what_start_up_allows_does_not_count_while_it_lasts(started_s: float, seconds: float) -> None:
    force = starting_until(started_s)
    assert exposures(temperatures((330.0, 10)), force, None)[0].total_s == seconds
    assert exposures(temperatures((341.0, 10)), force, None)[0].total_s == 10.0, "its own limit holds"


def test_a_limit_that_start_up_does_not_replace_holds_if_it_is_hard() -> None:
    force = LimitsInForce(LIMITS, StartUp(frozenset({"waiting"})), ((1.0, 4.0),))
    hot, cold = exposures(temperatures((330.0, 6)), force, None)
    assert hot.total_s == 6.0
    hot, cold = exposures(temperatures((290.0, 6)), force, None)
    assert (hot.total_s, cold.total_s) == (0.0, 2.0)


def test_the_plant_that_ends_in_start_up_ends_within_its_limits() -> None:
    assert inside_at_end(temperatures((330.0, 100)), starting_until(math.inf))
    assert not inside_at_end(temperatures((341.0, 100)), starting_until(math.inf))
    assert not inside_at_end(temperatures((330.0, 100)), starting_until(99.0))


@pytest.mark.parametrize(
    ("states", "told", "spans"),
    [
        ([], [], ((1.0, 6.0),)),
        ([("waiting", 2.0), ("running", 3.0)], [], ((1.0, 3.0),)),
        ([("running", 9.0)], [], ((1.0, 6.0),)),
        ([("running", 3.0)], [(1.0, 2.0), (8.0, math.inf)], ((1.0, 2.0), (8.0, 13.0))),
    ],
)
def test_start_up_lasts_until_it_is_left_and_no_longer_than_the_tables_allow(
    states: list[tuple[str, float]], told: list[Span], spans: tuple[Span, ...]
) -> None:
    plant = replace(reactor().description, start_up=replace(STARTING, states=frozenset({"starting", "waiting"})))
    assert in_force(plant, states, 1.0, told).spans == spans


def test_a_plant_that_does_not_begin_in_start_up_has_none() -> None:
    plant = replace(reactor().description, start_up=STARTING)
    assert in_force(plant, [], 1.0).spans == ()


@pytest.mark.parametrize(
    ("detected_s", "seconds"), [(None, 0.0), (0.0, 6.0), (4.0, 6.0), (5.0, 5.0), (9.5, 1.0), (10.0, 0.0)]
)
def test_exposure_from_detection_starts_after_it(detected_s: float | None, seconds: float) -> None:
    hot, _ = exposures(temperatures((310.0, 4), (320.0, 6)), FORCE, detected_s)
    assert (hot.from_detection_s, hot.total_s) == (seconds, 6.0)


def test_the_sampling_period_counts() -> None:
    assert exposures(truth(dt_s=5.0, T=[320.0] * 3, L=[8.0] * 3), FORCE, 0.0)[0].total_s == 15.0


# --- the end ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stretches", "inside"),
    [
        (((310.0, 1000),), True),
        (((320.0, 940), (310.0, 60)), True),
        (((320.0, 941), (310.0, 59)), False),
        (((310.0, 999), (313.1, 1)), False),
        (((310.0, 999), (313.0, 1)), True),
        (((310.0, 600), (290.0, 400)), True),
        (((310.0, 10),), True),
        (((320.0, 10),), False),
    ],
)
def test_the_end_is_calm_within_the_hard_limits(stretches: tuple[tuple[float, int], ...], inside: bool) -> None:
    assert CALM_S == 60.0
    assert inside_at_end(temperatures(*stretches), FORCE) is inside


@pytest.mark.parametrize(
    ("stretches", "missed"),
    [
        (((310.0, 1000),), ()),
        (((290.0, 940), (310.0, 60)), ()),
        (((290.0, 941), (310.0, 59)), ("ACC-WARM", "LIM-COLD")),
        (((310.0, 990), (299.0, 10)), ("ACC-WARM",)),
        (((310.0, 900), (320.0, 100)), ()),
    ],
)
def test_what_is_soft_and_not_kept_at_the_end_is_missed(
    stretches: tuple[tuple[float, int], ...], missed: tuple[str, ...]
) -> None:
    limits = Limits((HOT, COLD, FEED), (CALM, criterion("ACC-WARM", "T >= 305", hard=False)))
    assert missed_at_end(temperatures(*stretches), LimitsInForce(limits)) == missed


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


# --- what an outcome follows from -------------------------------------------------------------------------------


@pytest.mark.parametrize(("rate", "fed"), [(0.1, True), (0.0999, False), (0.0, False), (1.0, True), (math.nan, False)])
def test_a_tenth_of_the_design_rate_is_fed(rate: float, fed: bool) -> None:
    production = Production("F", 0.03)
    assert fed_at_end(truth(F=[0.03] * 100 + [0.03 * rate] * 60), production) is fed


def test_what_was_fed_before_the_last_minute_does_not_count() -> None:
    production = Production("F", 1.0)
    assert not fed_at_end(truth(F=[1.0] * 940 + [0.0] * 60), production)
    assert fed_at_end(truth(F=[0.0] * 994 + [1.0] * 6), production), "six of sixty seconds are a tenth"


@pytest.mark.parametrize(
    ("share", "has"), [(0.9, True), (0.899, False), (0.063, False), (0.0, False), (1.0, True), (1.1, True)]
)
def test_nine_tenths_of_the_product_are_the_product(share: float, has: bool) -> None:
    assert has_product(made([share] * 100), HEALTHY, ["product"]) is has


def test_where_there_is_no_product_none_is_missing() -> None:
    assert has_product(made([0.0] * 100), made([0.0] * 100), ["product"])


@pytest.mark.parametrize("unknown", range(2))
def test_what_is_not_known_is_no_product(unknown: int) -> None:
    run, sound = (made([1.0] * 99 + [math.nan if k == unknown else 1.0]) for k in range(2))
    assert not has_product(run, sound, ["product"]) and not delivers_at_end(run, sound, ["product"], 20.0)
    assert not has_product(HEALTHY, HEALTHY, []) and not delivers_at_end(HEALTHY, HEALTHY, [], 20.0)
    assert math.isnan(production_loss(HEALTHY, HEALTHY, [], 20.0))


def delivered(*stretches: tuple[float, int]) -> Trajectory:
    """What has left at rates that each last so many samples."""
    return truth(product=np.cumsum(np.concatenate([np.full(count, rate) for rate, count in stretches])))


WELL = delivered((1.0, 1000))


@pytest.mark.parametrize(("rate", "delivers"), [(0.25, True), (0.249, False), (0.0, False), (1.0, True), (2.0, True)])
def test_less_than_a_quarter_of_what_is_delivered_without_a_fault_is_next_to_nothing(
    rate: float, delivers: bool
) -> None:
    run = delivered((1.0, 1000 - int(DELIVERED_S)), (rate, int(DELIVERED_S)))
    assert delivers_at_end(run, WELL, ["product"], 20.0) is delivers


def test_what_was_delivered_before_the_end_does_not_count_and_what_is_kept_back_for_a_while_does() -> None:
    assert not delivers_at_end(delivered((5.0, 700), (0.0, 300)), WELL, ["product"], 20.0)
    assert delivers_at_end(delivered((0.0, 900), (1.0, 100)), WELL, ["product"], 20.0)


def test_a_run_that_ends_soon_after_its_onset_is_judged_from_the_onset_on() -> None:
    """Full load before the onset is no delivery after it."""
    assert not delivers_at_end(delivered((1.0, 850), (0.1, 150)), WELL, ["product"], 850.0)
    assert delivers_at_end(delivered((1.0, 850), (0.1, 150)), WELL, ["product"], 700.0)


def test_where_nothing_leaves_a_sound_plant_nothing_has_to() -> None:
    idle = delivered((0.0, 1000))
    assert delivers_at_end(idle, idle, ["product"], 20.0)


def test_a_slow_plant_is_judged_over_a_longer_time() -> None:
    run = delivered((1.0, 600), (0.0, 400))
    slow = Timing(response_s=750.0)
    assert not delivers_at_end(run, WELL, ["product"], 20.0) and delivers_at_end(run, WELL, ["product"], 20.0, slow)


def test_seconds_outside_are_those_of_hard_limits_after_a_time() -> None:
    run = temperatures((320.0, 5), (310.0, 5), (320.0, 3), (290.0, 2))
    found = outside_after(run, FORCE, 7.0)
    assert {name: times.tolist() for name, times in found.items()} == {"LIM-HOT": [11.0, 12.0, 13.0]}
    assert outside_after(run, FORCE, 0.0)["LIM-HOT"].tolist() == [1, 2, 3, 4, 5, 11, 12, 13]
    assert outside_after(run, starting_until(11.0), 0.0)["LIM-HOT"].tolist() == [12.0, 13.0]
    assert outside_after(run, starting_until(math.inf)) == {}
    assert outside_after(temperatures((313.0, 9)), FORCE) == {}, "at the limit is inside"
    assert starting_until(11.0).settled_s(7.0) == 11.0 and starting_until(11.0).settled_s(12.0) == 12.0


IN, OUT = 310.0, 320.0
DETECTED_S = 100.0
"""Detection in the runs below."""


@pytest.mark.parametrize(
    ("after", "kept", "until"),
    [
        (((IN, 900),), True, None),
        (((IN, 1), (OUT, 1), (IN, 898)), False, None),
        (((OUT, 20), (IN, 880)), True, 121.0 + RETURN_S),
        (((OUT, 20), (IN, 5), (OUT, 5), (IN, 870)), True, 121.0 + RETURN_S),
        (((OUT, 20), (IN, 60), (OUT, 1), (IN, 819)), True, 121.0 + RETURN_S),
        (((OUT, 20), (IN, 61), (OUT, 1), (IN, 818)), False, None),
        (((OUT, 900),), False, None),
        (((OUT, 899), (IN, 1)), True, 1000.0 + RETURN_S),
    ],
)
def test_what_is_outside_at_detection_has_to_come_back_and_stay(
    after: tuple[tuple[float, int], ...], kept: bool, until: float | None
) -> None:
    run = temperatures((IN, 100), *after)
    found = kept_until(outside_after(run, FORCE, DETECTED_S), run, DETECTED_S)
    assert found == (({"LIM-HOT": until} if until else {}) if kept else None)


@pytest.mark.parametrize(
    ("ours", "alternative", "is_worse"),
    [
        (((IN, 900),), ((IN, 900),), False),
        (((IN, 50), (OUT, 1), (IN, 849)), ((IN, 900),), True),
        (((OUT, 81), (IN, 819)), ((OUT, 20), (IN, 880)), False),
        (((OUT, 82), (IN, 818)), ((OUT, 20), (IN, 880)), True),
        (((OUT, 20), (IN, 500), (OUT, 1), (IN, 379)), ((OUT, 20), (IN, 880)), True),
    ],
)
def test_a_run_is_worse_than_what_keeps_the_limits(
    ours: tuple[tuple[float, int], ...], alternative: tuple[tuple[float, int], ...], is_worse: bool
) -> None:
    one, other = temperatures((IN, 100), *ours), temperatures((IN, 100), *alternative)
    until = kept_until(outside_after(other, FORCE, DETECTED_S), other, DETECTED_S)
    assert until is not None
    assert worse(outside_after(one, FORCE, DETECTED_S), until) is is_worse
