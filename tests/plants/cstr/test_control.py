"""Phases and loops of the basic control system."""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.plants.cstr.process import NORMAL, SHUTDOWN, STARTUP
from tests.plants.cstr.reactor import PUBLISHED, Run, S, batch, inputs, parameters, run


def first(result: Run, phase: float) -> int:
    """Time of the first state in ``phase`` [s]; the phase is decided at the start of the second."""
    return int(np.argmax(result.of("phase") == phase)) + 1


def test_startup_fills_with_the_pump_off_and_ends_at_the_level_setpoint() -> None:
    result = run(batch(500))
    begun = first(result, NORMAL)
    assert begun == 304
    filling = slice(0, begun - 1)
    assert (result.of("phase")[filling] == STARTUP).all() and (result.of("F2_true")[filling] == 0.0).all()
    assert result.of("V")[begun - 2] >= 10.0 > result.of("V")[begun - 3]
    assert (result.of("phase")[begun - 1 :] == NORMAL).all()


def test_startup_ends_after_its_time_and_stays_ended() -> None:
    result = run(batch(1200, u=inputs(F1_sp=0.002)))
    assert first(result, NORMAL) == 1001
    assert result.of("V")[-1] < 3.0
    u = np.tile(inputs(), (600, 1))
    u[400:] = inputs(L1_sp=10.5)
    assert (run(batch(600, u=u)).of("phase")[304:] == NORMAL).all()


def test_shutdown_closes_the_feed_drains_to_the_last_drop_and_stops_the_cooling() -> None:
    x = run(batch(1500)).state[0]
    result = run(batch(1200, x=x, start_s=1500.0, p=parameters(t_shutdown=1600.0)))
    assert first(result, SHUTDOWN) == 101
    drained = slice(100, None)
    v = result.of("V")
    assert (result.of("V1_cmd")[drained] == 0.0).all() and result.of("F1_true")[110] < 1e-12
    before = np.concatenate([[x[S.V]], v])[:-1]
    pumping = before[drained] > 0.01
    assert (result.of("P1_cmd")[drained][pumping] >= 0.05).all()
    assert (result.of("P1_cmd")[drained][~pumping] == 0.0).all() and (~pumping).any()
    assert (result.of("V2_cmd")[drained][before[drained] <= 0.1] == 0.0).all()
    assert v[-1] < 0.01 and (v >= 0.0).all()


def test_an_inlet_that_is_stuck_in_shutdown_never_draws_the_vessel_below_empty() -> None:
    """Here the published pump takes half a millilitre that is not there."""
    result = run(batch(8000, p=parameters(**PUBLISHED), faults={"inlet_stuck_open": (1.0, 2000.0)}))
    assert 0.0 <= result.of("V").min() < 1e-3


def test_each_loop_reaches_its_setpoint() -> None:
    x = run(batch(1500)).state[0]
    result = run(batch(6000, x=x, u=inputs(T1_sp=307.0, L1_sp=10.4, F1_sp=0.028)))
    assert result.state[0, [S.T, S.V, S.F1_true]] == pytest.approx([307.0, 10.4, 0.028], abs=1e-5)


def test_the_published_level_trim_can_only_add_outflow() -> None:
    """So the published level never rises to a raised setpoint; with the trim free to both sides it does."""
    raised = inputs(L1_sp=10.5)
    for trim_low, level in ((0.0, 9.9946403), (-1.0, 10.5)):
        p = parameters(trim_low=trim_low)
        x = run(batch(2000, p=p)).state[0]
        assert run(batch(4000, p=p, x=x, u=raised)).state[0, S.V] == pytest.approx(level, abs=1e-5)


MANUAL = {"V1": "flow_integral", "P1": "level_integral", "V2": "temperature_integral"}


@pytest.mark.parametrize("actuator", MANUAL)
@pytest.mark.parametrize("phase", ["startup", "normal", "shutdown"])
def test_a_manual_output_overrides_every_phase(actuator: str, phase: str) -> None:
    x = None if phase == "startup" else run(batch(1500)).state[0]
    p = parameters(t_shutdown=0.0 if phase == "shutdown" else 1e6)
    start = 0.0 if x is None else 1500.0
    result = run(batch(60, x=x, start_s=start, p=p, u=inputs(**{f"{actuator}_man": 0.37})))
    assert (result.of(f"{actuator}_cmd") == 0.37).all()
    assert result.of(f"{actuator}_pos")[-1] == pytest.approx(0.37, abs=1e-12)


@pytest.mark.parametrize("actuator", MANUAL)
@pytest.mark.parametrize("given", [0.3, 0.6])
def test_back_on_automatic_a_controller_goes_on_from_where_the_manual_output_stood(actuator: str, given: float) -> None:
    """However long it was on manual, and however far off its setpoint the plant is by then (bumpless transfer)."""
    p = parameters(Kp_flow=0.5, Ki_flow=0.2)
    manual = run(batch(400, x=run(batch(1500, p=p)).state[0], p=p, u=inputs(**{f"{actuator}_man": given})))
    automatic = run(batch(1, x=manual.state[0], p=p))
    assert automatic.of(f"{actuator}_cmd")[0] == pytest.approx(given, abs=0.02)


@pytest.mark.parametrize(("asked", "given"), [(1.7, 1.0), (-0.3, 0.0)])
def test_a_manual_output_is_limited_to_the_actuators_travel(asked: float, given: float) -> None:
    result = run(batch(5, u=inputs(V1_man=asked, P1_man=asked, V2_man=asked)))
    for actuator in MANUAL:
        assert (result.of(f"{actuator}_cmd") == given).all()


def test_a_saturated_loop_does_not_wind_up() -> None:
    """Hours of too hot a setpoint's opposite leave the integral at its limit, and the valve leaves it at once."""
    x = run(batch(1500)).state[0]
    cold = run(batch(4000, x=x, u=inputs(T1_sp=297.0)))
    assert cold.of("V2_cmd")[-1] == 1.0 and cold.of("T1")[-1] > 298.0
    assert cold.of("temperature_integral").max() < 1.05
    back = run(batch(300, x=cold.state[0], u=inputs(T1_sp=310.0)))
    assert back.of("V2_cmd")[30] < 0.95
    assert back.of("T").max() < 313.0


def test_controllers_act_on_what_they_are_shown() -> None:
    """A transmitter that is off by some amount moves the truth by that amount."""
    p = parameters(bias_T1=0.4, bias_L1=-0.2, bias_F1=0.1)
    result = run(batch(8000, p=p))
    assert result.state[0, [S.T, S.V]] == pytest.approx([309.6, 10.2], abs=1e-4)
    assert result.state[0, S.F1_true] == pytest.approx(2.0 / 60.0 / 1.1, abs=1e-6)


def test_the_isolation_valve_cuts_the_feed_whatever_the_feed_valve_does() -> None:
    x = run(batch(1500)).state[0]
    result = run(batch(60, x=x, u=inputs(XV1_cmd=0.0)))
    assert result.of("F1_true")[-1] < 1e-12 and result.of("V1_pos")[-1] == 1.0
    assert result.of("XV1_pos")[0] == pytest.approx(math.exp(-1.0 / 0.5))


def test_rate_and_travel_are_the_movement_of_the_actuators() -> None:
    result = run(batch(400, process=1.0, sensor=1.0))
    for actuator in MANUAL:
        moved = np.abs(np.diff(result.of(f"{actuator}_pos"), prepend=0.0))
        np.testing.assert_allclose(result.of(f"{actuator}_rate"), moved, atol=1e-15)
        np.testing.assert_allclose(result.of(f"{actuator}_travel"), np.cumsum(moved), rtol=1e-12)


def test_product_is_what_the_pump_delivered() -> None:
    result = run(batch(1000))
    np.testing.assert_allclose(result.of("product"), np.cumsum(result.of("F2_true")), rtol=1e-12)
    assert result.of("product")[-1] == pytest.approx(np.sum(result.of("F1_true")) - result.of("V")[-1], abs=1e-9)
