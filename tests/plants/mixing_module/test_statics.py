"""Tanks, valves and pump speeds against hand computation: what levels out, fills, drains, travels and lags."""

from __future__ import annotations

import math

import numpy as np
import pytest

from homeostat.plants.mixing_module.instruments import pressure
from homeostat.plants.mixing_module.layout import P, S
from tests.plants.mixing_module.module import MODEL, Run, batch, inputs, network, parameters, run, start, timed

HAND = {
    "area": 14.31355, "height_feed": 0.22, "height_B204": 1.22, "floor_B204": 0.1, "pump_a": 2.141, "pump_b": 2.728,
    "pump_c": 28.82, "bypass_size": 0.85, "k_tank": 23.2, "k_suction": 11.6, "fill_rate": 0.14, "drain_cd": 0.62,
    "drain_area": 9.503e-5, "tau_pump": 1.0, "travel": 1.5, "density": 998.0,
}  # fmt: skip
HERE = parameters(**HAND)
AREA = 14.31355


def test_two_tanks_that_are_joined_level_out_in_the_time_of_the_hand_computation() -> None:
    """0.2 m and 0.05 m meet at 0.125 m. Difference z: dz/dt = -2 q / A, z = 46.4 q^2, so it takes
    A sqrt(46.4) (sqrt(0.15) - sqrt(0.01)) = 28.0 s from 0.15 m to 0.01 m; the laminar resistance adds less than 5 %."""
    x = start(HERE, B201=0.2, B202=0.05, VO1=1.0, VO2=1.0)
    result = run(batch(120, p=HERE, x=x, u=inputs(VO1=1.0, VO2=1.0)))
    one, two = result.of("L1"), result.of("L2")
    assert one[-1] == pytest.approx(0.125, abs=1e-4) and two[-1] == pytest.approx(0.125, abs=1e-4)
    by_hand = AREA * math.sqrt(46.4) * (math.sqrt(0.15) - math.sqrt(0.01))
    assert by_hand == pytest.approx(28.0, abs=0.1)
    assert 1 + int(np.argmax(one - two < 0.01)) == pytest.approx(by_hand, rel=0.05, abs=1.0)
    assert result.of("V3")[-1] == pytest.approx(AREA * 0.022, abs=1e-4)


def test_a_feed_tank_and_b204_level_out_through_standing_pumps_and_only_forward() -> None:
    """B201 at 0.2 m gives to B204 until 0.1 + L4 = L1: with 0.02 m there they meet at 0.16 m above the floor. The other
    way round the non-return valves hold."""
    u = inputs(VO1=1.0, VI4=1.0)
    down = run(batch(400, p=HERE, x=start(HERE, B201=0.2, B204=0.02, VO1=1.0, VI4=1.0), u=u))
    assert down.of("L1")[-1] == pytest.approx(0.16, abs=2e-4)
    assert down.of("L4")[-1] == pytest.approx(0.06, abs=2e-4)
    up = run(batch(400, p=HERE, x=start(HERE, B201=0.02, B204=0.8, VO1=1.0, VI4=1.0), u=u))
    assert up.of("L1")[-1] == pytest.approx(0.02, abs=1e-4) and up.of("L4")[-1] == pytest.approx(0.8, abs=1e-4)


@pytest.mark.parametrize("n", [0.5, 0.9, 1.0])
def test_a_pump_against_a_closed_valve_gives_its_shut_off_head_and_next_to_no_flow(n: float) -> None:
    """Above the suction by a n^2, and by what the curve rises to its top at q = b n / (2 (c + 11.6)), where it is held:
    b^2 n^2 / (4 (c + 11.6)) = 0.046 n^2."""
    now = network(HERE, (0.2, 0.0, 0.0, 0.1), outlets=(1.0, 0.0, 0.0), into_B204=0.0, n=(n, 0.0))
    assert now.heads[0] == pytest.approx(0.2, abs=1e-5)
    assert now.heads[1] - 0.2 == pytest.approx(n * n * (2.141 + 2.728**2 / (4.0 * 40.42)), abs=1e-4)
    assert now.heads[1] - 0.2 == pytest.approx(2.141 * n * n, rel=0.025)
    assert now.heads[2] == pytest.approx(now.heads[1], abs=1e-4)
    assert abs(now.flows[3]) < 1e-6


def test_a_tank_fills_in_the_time_of_the_hand_computation() -> None:
    """14.31355 L/m x 0.176 m / 0.14 L/s = 18.0 s. The valve opens in six quarter seconds by 1/6 each, which yields
    (1 + ... + 6) / 6 / 4 = 0.875 s of full flow in 1.5 s: 0.625 s are lost."""
    result = run(batch(21, p=HERE, u=inputs(VI1=1.0)))
    v, t = result.of("V1"), np.arange(1, 22)
    expected = AREA * 0.022 + 0.14 * (t - 0.625)
    assert v[2:18] == pytest.approx(expected[2:18], abs=1e-12)
    assert 1 + int(np.argmax(result.of("L1") >= 0.198)) == math.ceil(AREA * 0.176 / 0.14 + 0.625) == 19
    assert result.of("V2")[-1] == result.of("V3")[-1] == AREA * 0.1 * 0.22


def test_what_does_not_fit_goes_over_the_brim() -> None:
    result = run(batch(60, p=HERE, u=inputs(VI2=1.0), x=start(HERE, B202=0.2, VI2=1.0)))
    assert result.of("L2")[-1] == pytest.approx(0.22, abs=1e-12)
    assert result.of("q_over")[-1] == pytest.approx(0.14, abs=1e-12)
    assert result.of("overflowed")[-1] == pytest.approx(60 * 0.14 - AREA * 0.02, abs=1e-9)


@pytest.mark.parametrize(("high", "low"), [(0.65, 0.122), (1.0, 0.5), (0.3, 0.05)])
def test_b204_drains_in_the_time_of_torricelli(high: float, low: float) -> None:
    """t = A / (Cd a) sqrt(2 / g) (sqrt(h1) - sqrt(h2)); 0.65 m to 0.122 m in 50.2 s. Read between two seconds."""
    by_hand = 0.01431355 / (0.62 * 9.503e-5) * math.sqrt(2.0 / 9.80665) * (math.sqrt(high) - math.sqrt(low))
    if high == 0.65:
        assert by_hand == pytest.approx(50.2, abs=0.1)
    levels = run(batch(150, p=HERE, x=start(HERE, B204=high, VO4=1.0), u=inputs(VO4=1.0))).of("L4")
    taken = float(np.interp(-low, -levels, np.arange(1, 151)))
    assert taken == pytest.approx(by_hand, rel=0.01)


def test_an_empty_tank_gives_nothing() -> None:
    result = run(batch(300, p=HERE, x=start(HERE, B201=0.01, VO1=1.0, VI4=1.0), u=inputs(VO1=1.0, VI4=1.0, P1=0.9)))
    assert result.of("V1").min() >= 0.0 and result.of("L1")[-1] < 0.003
    assert result.of("q_out1")[-1] < 2e-3
    drained = run(batch(300, p=HERE, x=start(HERE, B204=0.05, VO4=1.0), u=inputs(VO4=1.0)))
    assert drained.of("V4").min() == 0.0 and drained.of("q_drain")[-1] == 0.0


def test_valves_travel_from_closed_to_open_in_a_second_and_a_half_and_back() -> None:
    u = timed(6, (0, {f"VO{i}": 1.0 for i in (1, 2, 3, 4)} | {f"VI{i}": 1.0 for i in (1, 2, 3, 4)}), (3, {}))
    result = run(batch(6, p=HERE, u=u))
    for i in range(8):
        seen = result.record[0, :, S.VI1_pos + i]
        assert seen == pytest.approx([2 / 3, 1.0, 1.0, 1 / 3, 0.0, 0.0], abs=1e-12), MODEL.states[S.VI1_pos + i]


def test_pumps_follow_their_reference_with_a_lag() -> None:
    """n(t) = 0.8 (1 - e^-t), then 0.8 (1 - e^-5) e^-(t - 5), however the second is divided."""
    result = run(batch(10, p=HERE, u=timed(10, (0, {"P1": 0.8, "P2": 0.4}), (5, {}))))
    t = np.arange(1, 11)
    up = 1.0 - np.exp(-np.minimum(t, 5.0))
    expected = up * np.exp(-np.maximum(t - 5.0, 0.0))
    assert result.of("N1") == pytest.approx(0.8 * expected, abs=1e-12)
    assert result.of("N2") == pytest.approx(0.4 * expected, abs=1e-12)


def test_instruments_show_levels_pressures_switches_and_speeds() -> None:
    """1 m of water at 998 kg/m3 is 9.787 kPa; switches stand at 10 %, 50 % and 90 % of each tank."""
    assert pressure(HERE, 1.0) == pytest.approx(9.787, abs=5e-4)
    levels = {"B201": 0.021, "B202": 0.111, "B203": 0.199, "B204": 0.7}
    read = MODEL.readings(run(batch(1, p=HERE, x=start(HERE, **levels))).state[0], inputs())
    switches = {"B201": (0.0, 0.0, 0.0), "B202": (1.0, 1.0, 0.0), "B203": (1.0, 1.0, 1.0), "B204": (1.0, 1.0, 0.0)}
    for tank, level in levels.items():
        assert read[f"L_{tank}"] == pytest.approx(level, abs=1e-12)
        assert read[f"P_{tank}"] == pytest.approx(9.787 * level, abs=1e-3)
        assert tuple(read[f"LS{k}_{tank}"] for k in "LMH") == switches[tank]


@pytest.mark.parametrize(("tank", "height"), [("B201", 0.22), ("B202", 0.22), ("B203", 0.22), ("B204", 1.22)])
@pytest.mark.parametrize(("switch", "share"), [("LSL", 0.1), ("LSM", 0.5), ("LSH", 0.9)])
def test_a_switch_stands_at_its_share_of_the_height(tank: str, height: float, switch: str, share: float) -> None:
    for above in (-1e-6, 1e-6):
        state = run(batch(1, p=HERE, x=start(HERE, **{tank: share * height + above}))).state[0]
        assert MODEL.readings(state, inputs())[f"{switch}_{tank}"] == float(above > 0.0)


def test_calibration_errors_are_in_what_is_shown_alone() -> None:
    u, x = inputs(VO1=1.0, VI4=1.0, P1=0.9), start(HERE, B201=0.2)
    p = HERE.copy()
    p[[P.bias_LT1, P.bias_PT2, P.bias_FT, P.bias_ST]] = 0.01, 0.2, 0.02, 0.03
    wrong, right = run(batch(20, p=p, x=x, u=u)), run(batch(20, p=HERE, x=x, u=u))
    shown: dict[str, float] = {"LT1": 0.01, "PT2": 0.2, "ST1": 0.03, "ST2": 0.03}
    for name, bias in shown.items():
        assert wrong.of(name) == pytest.approx(right.of(name) + bias, abs=1e-12)
    assert wrong.of("FT") == pytest.approx(1.02 * right.of("FT"), rel=1e-12)
    unseen(wrong, right, {*shown, "FT"})


def unseen(one: Run, other: Run, readings: set[str]) -> None:
    """Nothing but ``readings`` differs."""
    differ = {n for i, n in enumerate(MODEL.states) if not np.array_equal(one.record[..., i], other.record[..., i])}
    assert differ == readings
