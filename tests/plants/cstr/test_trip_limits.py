"""The reactor's trip limits, carrier, start-up limits and qualities, on simulated readings."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.guard.watch.falls import Falls
from tests.plants.cstr.reactor import MODEL, TABLES, VARIABLES, Run, S, batch, inputs, parameters, run
from tests.plants.watching import Readings, described, mistaken, trips_after, worst_sum

PLANT = described(TABLES.parent)
TRIP = PLANT.trips["LIM-T-HIGH"]
STARTED_S = 400
"""Every start of the reactor has ended by then [s]."""
PROCESS_FAULTS = {
    "fouling": 0.95, "pump_degrade": 0.95, "cool_stuck_closed": 1.0, "cool_stuck_open": 1.0, "outlet_block": 1.0,
    "inlet_stuck_open": 1.0, "leak": 0.02,
}  # fmt: skip


def readings(found: Run) -> Readings:
    """What the instruments say; setpoints and commands are not among it."""
    return {tag: found.record[:, :, MODEL.shown[v]] for tag, v in VARIABLES.items() if v in MODEL.shown}


def with_setpoints(found: Run) -> Readings:
    """Readings and design setpoints."""
    shape = found.record.shape[:2]
    return {**readings(found), "F1.sp": np.full(shape, 1.0 / 30.0), "T1.sp": np.full(shape, 310.0)}


@pytest.fixture(scope="module")
def healthy() -> Run:
    return run(batch(1500, members=20, process=1.0, sensor=1.0))


def test_no_noise_trips_a_temperature_that_is_a_little_below_its_limit() -> None:
    noise = np.random.default_rng(1).standard_normal((100, 6000))
    assert worst_sum(0.5 * noise - 0.3).max() <= TRIP.cusum


@pytest.mark.parametrize(("over", "longest_s"), [(3.0, 5), (2.0, 9), (1.0, 20)])
def test_a_step_over_the_limit_trips_soon(over: float, longest_s: float) -> None:
    noise = np.random.default_rng(2).standard_normal((5000, 60))
    assert trips_after(over + 0.5 * noise, TRIP.cusum).max() <= longest_s


def test_a_step_that_is_first_too_fast_to_be_true_trips_within_ten_seconds() -> None:
    assert PLANT.qualities["T1"].grace_s + 5.0 <= 10.0


def test_no_healthy_reading_trips(healthy: Run) -> None:
    after = {tag: values[:, STARTED_S:] for tag, values in with_setpoints(healthy).items()}
    for limit in PLANT.limits.hard:
        assert worst_sum(-limit.formula.margins(after, 1.0)).max() <= PLANT.trips[limit.name].cusum


def test_no_start_trips_by_the_limits_of_start_up_but_would_by_the_others(healthy: Run) -> None:
    start = {tag: values[:, :200] for tag, values in with_setpoints(healthy).items()}
    for name, limit in PLANT.start_up.limits.items():
        assert worst_sum(-limit.formula.margins(start, 1.0)).max() <= PLANT.trips[name].cusum
    for limit in PLANT.limits.hard:
        tripped = worst_sum(-limit.formula.margins(start, 1.0)) > PLANT.trips[limit.name].cusum
        assert tripped.all() == (limit.name in PLANT.start_up.limits)


def test_a_start_without_cooling_trips() -> None:
    hot = run(batch(400, members=5, faults={"cool_stuck_closed": (1.0, 0.0)}, process=1.0, sensor=1.0))
    margins = PLANT.start_up.limits["LIM-T-HIGH"].formula.margins(readings(hot), 1.0)
    assert np.isfinite(trips_after(-margins, TRIP.cusum)).all()


def in_operation(found: Run) -> Readings:
    """What the instruments say once start-up, which has limits of its own, is over."""
    return {tag: values[:, STARTED_S:] for tag, values in readings(found).items()}


def test_no_true_reading_is_taken_for_frozen_or_too_fast(healthy: Run) -> None:
    assert mistaken(PLANT.qualities, in_operation(healthy)) == []


@pytest.mark.parametrize("fault", PROCESS_FAULTS)
def test_no_fault_of_the_process_is_taken_for_one_of_an_instrument(fault: str) -> None:
    faulty = run(batch(1200, members=3, faults={fault: (PROCESS_FAULTS[fault], 600.0)}, process=1.0, sensor=1.0))
    assert mistaken(PLANT.qualities, in_operation(faulty)) == []


def test_a_shut_down_reactor_has_no_frozen_reading() -> None:
    closed = np.tile(inputs(), (1500, 1))
    closed[600:] = inputs(F1_sp=0.0, XV1_cmd=0.0, V2_man=1.0, L1_sp=2.5)
    found = run(batch(1500, members=3, u=closed, process=1.0, sensor=1.0))
    assert mistaken(PLANT.qualities, in_operation(found)) == []


def carried(found: Run) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    """When the carrier holds, shape (members, seconds)."""
    assert TRIP.carrier is not None
    return np.asarray(TRIP.carrier.margins(readings(found), 1.0) >= 0.0)


def test_the_balance_carries_the_temperature_of_a_healthy_reactor(healthy: Run) -> None:
    assert carried(healthy)[:, 600:].mean() >= 0.999


def test_the_balance_carries_a_reactor_whose_transmitter_reads_high() -> None:
    lying = run(batch(1400, members=3, faults={"temp_bias": (5.0, 1000.0)}, process=1.0, sensor=1.0))
    assert carried(lying)[:, 1000:].mean() >= 0.999


@pytest.mark.parametrize(
    ("fault", "severity", "seconds"),
    [("cool_stuck_closed", 0.8, 1500), ("inlet_stuck_open", 1.0, 1500), ("fouling", 0.9, 5000)],
)
def test_the_balance_carries_nothing_where_the_reactor_is_truly_too_hot(
    fault: str, severity: float, seconds: int
) -> None:
    """But for a vessel that cools down already: a balance without storage is ahead of it, by less than a kelvin."""
    faulty = run(batch(seconds, members=2, faults={fault: (severity, 800.0)}, process=1.0, sensor=1.0))
    true, holds = faulty.record[:, 800:, S.T], carried(faulty)[:, 800:]
    assert (true > 313.0).any() and not (holds & (true > 314.0)).any()
    assert (holds & (true > 313.0)).mean() <= 0.02


def fallen(found: Run, since_s: int) -> list[int]:
    """Members in which the margin of the temperature falls faster than the tables permit from ``since_s`` [s] on."""
    shown = {tag: values[:, STARTED_S:] for tag, values in readings(found).items()}
    (limit,) = (each for each in PLANT.limits.hard if each.name == "LIM-T-HIGH")
    seen = []
    for member, series in enumerate(limit.watched.margins(shown, 1.0)):
        falls = Falls(TRIP.fastest, 1.0)
        for k, margin in enumerate(series.tolist()):
            values = {tag: float(column[member, k]) for tag, column in shown.items()}
            if falls.take(margin, values) and k + STARTED_S >= since_s:
                seen.append(member)
                break
    return seen


@pytest.mark.parametrize("fault", PROCESS_FAULTS)
def test_no_fault_of_the_process_makes_the_temperature_fall_faster_than_it_can(fault: str) -> None:
    faulty = run(batch(1500, members=3, faults={fault: (PROCESS_FAULTS[fault], 800.0)}, process=1.0, sensor=1.0))
    assert fallen(faulty, 800) == []


def test_a_transmitter_that_jumps_does() -> None:
    lying = run(batch(1000, members=3, faults={"temp_bias": (5.0, 800.0)}, process=1.0, sensor=1.0))
    assert fallen(lying, 800) == [0, 1, 2]


def test_a_saturated_valve_carries_a_reactor_whose_transmitter_jumped() -> None:
    """By 8 K: control cools as far as it can; the balance with half the jacket still keeps the limit, nearly always."""
    lying = run(batch(2500, members=3, faults={"temp_bias": (8.0, 1000.0)}, process=1.0, sensor=1.0))
    assert TRIP.fallen is not None
    margins = TRIP.fallen.margins(readings(lying), 1.0)[:, 1000:]
    assert (margins >= 0.0).mean() >= 0.97 and carried(lying)[:, 1000:].mean() < 0.9


def test_the_balance_sees_cooling_water_that_is_too_warm() -> None:
    """Ten kelvin more: the true temperature passes the limit unseen by a transmitter that is said to read high."""
    start = run(batch(1000, members=2, process=1.0, sensor=1.0)).state
    warm = run(batch(1500, members=2, p=parameters(T_coolant=300.0), x=start, start_s=1000.0, process=1.0, sensor=1.0))
    hot = warm.record[:, :, S.T] > 313.0
    assert not (hot & carried(warm))[:, 30:].any()
