"""Each fault does what its table says: from its onset on, as much as its severity says, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.plants.mixing_module.layout import S
from tests.plants.mixing_module.module import (
    FAULTS,
    MODEL,
    NOMINAL,
    RANGE,
    SEVERITY,
    Run,
    batch,
    inputs,
    rows,
    run,
    start,
    timed,
)

BEFORE, ONSET_S, STEPS = 30, 30.0, 120
ROW = int(ONSET_S)
"""First row, a second after the onset, in which a fault of the process can show."""
BUSY = inputs(VI1=0.7, VI2=0.7, VI3=0.7, VO1=0.7, VO2=0.7, VO3=0.7, VI4=0.7, VO4=0.7, P1=0.8, P2=0.95)
"""Everything half way, so that every fault has something to change."""
HEALTHY = run(batch(STEPS, u=BUSY))
READINGS = {MODEL.states[i] for i in range(S.LT1, S.ST2 + 1)} | {"idle1", "idle2"}
SENSORS = tuple(f for f in FAULTS if f.startswith("sensor_"))
PLANT = tuple(f for f in FAULTS if not f.startswith("sensor_"))


def faulty(steps: int = STEPS, onset_s: float = ONSET_S, **severities: float) -> Run:
    """The busy plant with faults from ``onset_s`` on."""
    return run(batch(steps, u=BUSY, faults={f: (s, onset_s) for f, s in severities.items()}))


def differing(one: Run, other: Run) -> set[str]:
    """States that are not the same, bit by bit."""
    return {n for i, n in enumerate(MODEL.states) if not np.array_equal(one.record[..., i], other.record[..., i])}


def test_the_table_has_the_faults_of_the_layout() -> None:
    assert [r["id"] for r in rows("faults")] == list(FAULTS)
    assert set(SEVERITY) == set(FAULTS) and all(low <= SEVERITY[f] <= high for f, (low, high) in RANGE.items())


@pytest.mark.parametrize("fault", FAULTS)
def test_nothing_before_the_onset_and_something_within_five_seconds(fault: str) -> None:
    result = faulty(**{fault: SEVERITY[fault]})
    # The reading of the second that ends at the onset is the first that a transmitter's fault may be in.
    begin = ROW - (fault in SENSORS)
    assert np.array_equal(result.record[0, :begin], HEALTHY.record[0, :begin])
    assert not np.array_equal(result.record[0, begin : begin + 5], HEALTHY.record[0, begin : begin + 5])


@pytest.mark.parametrize("fault", FAULTS)
def test_severity_zero_and_no_onset_are_health_bit_by_bit(fault: str) -> None:
    assert np.array_equal(faulty(**{fault: 0.0}).record, HEALTHY.record)
    assert np.array_equal(faulty(onset_s=np.inf, **{fault: SEVERITY[fault]}).record, HEALTHY.record)


@pytest.mark.parametrize("fault", FAULTS)
def test_an_instrument_sees_each_fault(fault: str) -> None:
    """By three times its noise, at the latest when the pumps stop at 90 s: a stuck flow meter shows by that alone."""
    u = np.tile(BUSY, (STEPS, 1))
    u[90:, 8:] = 0.0
    ill, well = (run(batch(STEPS, u=u, faults=f)).record[0] for f in ({fault: (SEVERITY[fault], ONSET_S)}, {}))
    moved = np.abs(ill - well).max(axis=0)
    noise = {"LT": NOMINAL["sd_LT"], "PT": NOMINAL["sd_PT"], "FT": 0.005, "ST": NOMINAL["sd_ST"]}
    assert {n for i, n in enumerate(MODEL.states) if n in READINGS and moved[i] > 3.0 * noise.get(n[:2], 0.1)}


@pytest.mark.parametrize("fault", SENSORS)
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_fault_of_a_transmitter_changes_its_reading_alone(fault: str, share: float) -> None:
    """The flow meter's reading is what the drives count idle seconds by; nothing else follows from a reading."""
    result = faulty(**{fault: share * SEVERITY[fault]})
    own = {"FT", "idle1", "idle2"} if fault.endswith("flow") else {f"LT{fault[-1]}"}
    assert differing(result, HEALTHY) <= own
    truth = [MODEL.truth(r.record, np.tile(BUSY, (1, STEPS, 1))) for r in (result, HEALTHY)]
    for name in truth[0]:
        assert np.array_equal(truth[0][name], truth[1][name]), name


@pytest.mark.parametrize("fault", [f for f in SENSORS if "stuck" in f])
def test_a_stuck_transmitter_keeps_its_last_reading(fault: str) -> None:
    name = "FT" if fault.endswith("flow") else f"LT{fault[-1]}"
    noisy = run(batch(STEPS, u=BUSY, faults={fault: (1.0, ONSET_S)}, process=1.0, sensor=1.0))
    shown = noisy.of(name)
    assert (shown[ROW - 1 :] == shown[ROW - 2]).all() and len(set(shown[: ROW - 1])) == ROW - 1


@pytest.mark.parametrize("tank", [1, 2, 3, 4])
def test_bias_is_constant_and_drift_grows_linearly(tank: int) -> None:
    age = np.maximum(np.arange(1, STEPS + 1) - ONSET_S, 0.0)
    drift = faulty(**{f"sensor_drift_B20{tank}": -0.002})
    bias = faulty(**{f"sensor_bias_B20{tank}": 0.04})
    true = HEALTHY.of(f"L{tank}")
    assert drift.of(f"LT{tank}") - true == pytest.approx(-0.002 * age, abs=1e-12)
    assert bias.of(f"LT{tank}") - true == pytest.approx(0.04 * (np.arange(1, STEPS + 1) >= ONSET_S), abs=1e-12)


def test_the_flow_meter_reads_in_proportion() -> None:
    result = faulty(sensor_bias_flow=-0.15)
    assert result.of("FT")[ROW - 1 :] == pytest.approx(0.85 * HEALTHY.of("q_transfer")[ROW - 1 :], rel=1e-12)


VALVES = ("VI201", "VI202", "VI203", "VO201", "VO202", "VO203", "VI204", "VO204")


@pytest.mark.parametrize(("column", "valve"), list(enumerate(VALVES)))
def test_a_stuck_valve_goes_where_its_fault_says_at_its_speed_and_no_other_moves(column: int, valve: str) -> None:
    """From 0.7 at 1/1.5 per second: 0.7 - 2/3 after a second, then closed; to 0.2 within that second."""
    closed, ajar = faulty(**{f"stuck_closed_{valve}": 1.0}), faulty(**{f"stuck_open_{valve}": 0.2})
    seen = closed.record[0, :, S.VI1_pos + column]
    assert seen[ROW - 1 : ROW + 2] == pytest.approx([0.7, 0.7 - 1.0 / NOMINAL["travel"], 0.0], abs=1e-12)
    assert ajar.record[0, ROW:, S.VI1_pos + column] == pytest.approx(0.2, abs=1e-12)
    for result in (closed, ajar):
        others = [S.VI1_pos + i for i in range(8) if i != column]
        assert np.array_equal(result.record[..., others], HEALTHY.record[..., others])
    opened = run(batch(10, faults={f"stuck_open_{valve}": (0.4, 5.0)}))
    assert opened.record[0, 4:6, S.VI1_pos + column] == pytest.approx([0.0, 0.4], abs=1e-12)


def test_a_degraded_pump_turns_slower_and_a_failed_one_stands() -> None:
    slow = faulty(pump_degradation=0.25)
    assert slow.of("N1")[-1] == pytest.approx(0.75 * 0.8, abs=1e-9)
    for fault, own, other in (("pump_failure", "N1", "N2"), ("pump_failure_P102", "N2", "N1")):
        failed = faulty(**{fault: 1.0})
        speed = HEALTHY.of(own)[ROW - 1]
        assert failed.of(own)[ROW:] == pytest.approx(speed * np.exp(-np.arange(1, STEPS - ROW + 1)), abs=1e-12)
        assert np.array_equal(failed.of(other), HEALTHY.of(other))


@pytest.mark.parametrize("place", [1, 2, 3])
def test_a_clogged_outlet_is_felt_by_its_tank_alone(place: int) -> None:
    """The other tanks empty as ever: one after the other through the same pump."""
    line = {"VI4": 1.0, "P1": 0.9}
    u = timed(66, (0, {"VO1": 1.0} | line), (22, {"VO2": 1.0} | line), (44, {"VO3": 1.0} | line))
    x = start(B201=0.2, B202=0.2, B203=0.2)
    healthy, clogged = (run(batch(66, x=x, u=u, faults=f)) for f in ({}, {f"clogging_B20{place}": (0.8, 0.0)}))
    for tank in (1, 2, 3):
        mine = slice(22 * (tank - 1) + 5, 22 * tank)
        ratio = clogged.of("q_transfer")[mine].mean() / healthy.of("q_transfer")[mine].mean()
        assert ratio < 0.65 if tank == place else ratio == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("fault", [f for f in FAULTS if f.startswith(("clogging", "leakage", "pump_deg"))])
def test_more_of_a_fault_is_more_of_its_effect(fault: str) -> None:
    line = inputs(VO1=1.0, VO2=1.0, VO3=1.0, VI4=1.0, P1=0.9)
    x = start(B201=0.2, B202=0.2, B203=0.2, VO1=1.0, VO2=1.0, VO3=1.0, VI4=1.0, n=(0.9, 0.0))
    sizes = (0.0, 0.1, 0.3, 0.6, 0.9)
    arrived = [run(batch(20, x=x, u=line, faults={fault: (s, 0.0)})).of("q_transfer")[-1] for s in sizes]
    assert (np.diff(arrived) < 0.0).all()


def test_onsets_are_each_faults_own() -> None:
    late = {"sensor_bias_B201": (0.05, ONSET_S), "sensor_bias_B202": (0.05, ONSET_S + 40.0)}
    both, one = run(batch(STEPS, u=BUSY, faults=late)), faulty(sensor_bias_B201=0.05)
    assert np.array_equal(both.record[0, : ROW + 39], one.record[0, : ROW + 39])
    assert differing(both, one) == {"LT2"}


def test_a_fault_that_began_before_the_run_acts_from_the_start() -> None:
    half = run(batch(60, u=BUSY)).state[0]
    result = run(batch(3, x=half, u=BUSY, start_s=60.0, faults={"sensor_drift_B204": (0.001, 10.0)}))
    assert result.of("LT4") - result.of("L4") == pytest.approx([0.051, 0.052, 0.053], abs=1e-12)


def test_all_faults_at_once_stay_in_the_physical_world() -> None:
    result = run(batch(600, u=BUSY, faults={f: (SEVERITY[f], ONSET_S) for f in FAULTS}, process=1.0, sensor=1.0))
    assert np.isfinite(result.record).all() and result.record[0, :, : S.V4 + 1].min() >= 0.0
