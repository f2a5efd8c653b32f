"""Flows and heads against hand computation: one line, two lines, affinity, clogging, leaks, non-return valves."""

from __future__ import annotations

import math

import pytest

from tests.plants.mixing_module.module import CLOSED, batch, inputs, network, parameters, run, start

HAND = {
    "area": 14.31355, "floor_B204": 0.1, "floor_leak": 0.25, "pump_a": 2.141, "pump_b": 2.728, "pump_c": 28.82,
    "bypass_size": 0.85, "k_tank": 23.2, "k_suction": 11.6, "k_main": 23.2, "k_bypass": 46.4, "k_transfer": 34.8,
    "k_clog": 10.0, "leak_size": 0.06,
}  # fmt: skip
"""The numbers of the hand computations, whatever the table says."""
P = parameters(**HAND)
A, B, C, R = 2.141, 2.728, 28.82, 0.02
"""Head curve a n^2 + b n q - c q^2, and the laminar resistance of every branch [m/(L/s)]."""
LIFT_LEVELS = (0.2, 0.0, 0.0, 0.122)
"""B201 at 0.2 m, B204 at 0.122 m: B204's surface is 0.1 + 0.122 - 0.2 = 0.022 m above that of B201."""
ONE = (1.0, CLOSED, CLOSED)


def root(square: float, linear: float, constant: float) -> float:
    """The positive q of square q^2 - linear q - constant = 0."""
    return (linear + math.sqrt(linear**2 + 4.0 * square * constant)) / (2.0 * square)


@pytest.mark.slow
@pytest.mark.parametrize("n", [0.5, 0.75, 0.9013, 1.0])
def test_the_operating_point_of_the_main_line_is_the_root_of_a_quadratic(n: float) -> None:
    """a n^2 + b n q - c q^2 = lift + (23.2 + 11.6 + 23.2 + 34.8) q^2 + 4 R q, that is
    121.62 q^2 - (b n - 0.08) q = a n^2 - 0.022."""
    by_hand = root(92.8 + C, B * n - 4 * R, A * n * n - 0.022)
    assert network(P, LIFT_LEVELS, outlets=ONE, n=(n, 0.0)).flows[6] == pytest.approx(by_hand, abs=1e-6)
    if n == 0.9013:
        # The description's hand check, 0.130 L/s at 150 rpm, has neither lift nor laminar resistance.
        assert by_hand == pytest.approx(0.130, abs=1e-3)


def test_the_operating_point_of_the_bypass_is_the_root_of_a_quadratic() -> None:
    """At reference 1 the smaller pump has the curve of the other at 0.85:
    (23.2 + 46.4 + 34.8 + 28.82) q^2 - (0.85 b - 0.06) q = 0.7225 a - 0.022."""
    by_hand = root(104.4 + C, 0.85 * B - 3 * R, 0.7225 * A - 0.022)
    assert network(P, LIFT_LEVELS, outlets=ONE, n=(0.0, 0.85)).flows[5] == pytest.approx(by_hand, abs=1e-6)
    x = start(P, B201=0.2, B204=0.122, VO1=1.0, VI4=1.0, n=(0.0, 1.0))
    seen = run(batch(1, p=P, x=x, u=inputs(VO1=1.0, VI4=1.0, P2=1.0))).of("q_bypass")[-1]
    # The levels move by 0.09 L / 14.3 L/m = 6 mm in that second, each; that is 0.5 % of the head.
    assert seen == pytest.approx(by_hand, rel=5e-3)


def test_heads_along_the_main_line_are_those_of_the_hand_computation() -> None:
    q = root(92.8 + C, B * 0.9 - 4 * R, A * 0.81 - 0.022)
    suction, main, discharge = network(P, LIFT_LEVELS, outlets=ONE, n=(0.9, 0.0)).heads
    assert suction == pytest.approx(0.2 - 23.2 * q * q - R * q, abs=1e-5)
    assert discharge == pytest.approx(0.222 + 34.8 * q * q + R * q, abs=1e-5)
    assert main == pytest.approx(discharge + 23.2 * q * q + R * q, abs=1e-5)
    gained = A * 0.81 + B * 0.9 * q - (C + 11.6) * q * q - R * q
    assert main - suction == pytest.approx(gained, abs=1e-5)


def test_flow_goes_with_speed_and_head_with_its_square() -> None:
    """Affinity, without lift: B201 at 0.2 m, B204 at 0.1 m. The laminar resistance bends it by less than 1 %."""
    level = (0.2, 0.0, 0.0, 0.1)
    rated = network(P, level, outlets=ONE, n=(1.0, 0.0))
    for n in (0.8, 0.5):
        slow = network(P, level, outlets=ONE, n=(n, 0.0))
        assert slow.flows[3] / rated.flows[3] == pytest.approx(n, rel=0.01)
        gains = [now.heads[1] - now.heads[0] for now in (slow, rated)]
        assert gains[0] / gains[1] == pytest.approx(n * n, rel=0.01)


def test_two_equal_lines_share_the_flow_by_halves() -> None:
    """k_bypass = 34.8 makes the bypass as long as the main line; each carries Q/2. With 2 R and R of the two lines as
    1.5 R each: (58 + (28.82 + 34.8) / 4) Q^2 - (b n / 2 - 2 R - 0.75 R) Q = a n^2 - 0.022."""
    p = parameters(**HAND | {"k_bypass": 34.8})
    both = network(p, LIFT_LEVELS, outlets=ONE, n=(0.9, 0.9))
    total = root(58.0 + 63.62 / 4.0, B * 0.45 - 2 * R - 0.75 * R, A * 0.81 - 0.022)
    assert both.flows[6] == pytest.approx(total, rel=1e-5)
    assert both.flows[3] == pytest.approx(both.flows[5], rel=5e-3)


def test_two_different_lines_share_the_flow_as_a_bisection_says() -> None:
    """For a gain h between S and D each line's flow is a root; the total is right where tank and common line take h."""
    n1, n2 = 0.9, 0.85

    def of_lines(gain: float) -> tuple[float, float]:
        return (root(C + 34.8, B * n1 - 2 * R, A * n1 * n1 - gain), root(C + 46.4, B * n2 - R, A * n2 * n2 - gain))

    low, high = 0.0, A * n2 * n2
    for _ in range(60):
        gain = (low + high) / 2.0
        total = sum(of_lines(gain))
        needed = 0.022 + 58.0 * total**2 + 2 * R * total
        low, high = (gain, high) if needed > gain else (low, gain)
    main, bypass = of_lines(gain)
    both = network(P, LIFT_LEVELS, outlets=ONE, n=(n1, n2))
    assert both.flows[3] == pytest.approx(main, abs=1e-6)
    assert both.flows[5] == pytest.approx(bypass, abs=1e-6)
    alone = network(P, LIFT_LEVELS, outlets=ONE, n=(n1, 0.0)).flows[6]
    assert main < alone < main + bypass < 2.0 * alone


@pytest.mark.parametrize("severity", [0.3, 0.5, 0.8])
@pytest.mark.parametrize("place", ["clogging_main", "clogging_common", "clogging_B201"])
def test_a_clogging_adds_the_resistance_of_a_throttled_valve(place: str, severity: float) -> None:
    """K (1/(1 - s)^2 - 1) with K = 10: s = 0.5 adds 30 m/(L/s)^2. A pond of 1e5 L/m keeps the levels."""
    p = parameters(**HAND | {"area": 1e5})
    x = start(p, B201=0.2, B204=0.122, VO1=1.0, VI4=1.0, n=(0.9, 0.0))
    u = inputs(VO1=1.0, VI4=1.0, P1=0.9)
    added = 10.0 * (1.0 / (1.0 - severity) ** 2 - 1.0)
    by_hand = root(92.8 + added + C, B * 0.9 - 4 * R, A * 0.81 - 0.022)
    seen = run(batch(5, p=p, x=x, u=u, faults={place: (severity, 0.0)})).of("q_transfer")[-1]
    assert seen == pytest.approx(by_hand, abs=1e-6)


def test_a_line_that_is_clogged_up_passes_nothing() -> None:
    x = start(P, B201=0.2, VO1=1.0, VI4=1.0, n=(0.9, 0.0))
    u = inputs(VO1=1.0, VI4=1.0, P1=0.9)
    shut = run(batch(5, p=P, x=x, u=u, faults={"clogging_main": (1.0, 0.0)}))
    assert abs(shut.of("q_main")[-1]) < 1e-6 and abs(shut.of("q_transfer")[-1]) < 1e-6


@pytest.mark.parametrize("severity", [0.03, 0.3, 1.0])
@pytest.mark.parametrize(("place", "junction"), [("leakage_main", "head_main"), ("leakage_common", "head_discharge")])
def test_a_leak_gives_its_size_times_the_root_of_the_head_above_it(place: str, junction: str, severity: float) -> None:
    """q = C s sqrt(h - 0.25) with C = 0.06; the laminar term takes less than 0.1 % of it."""
    x = start(P, B201=0.2, VO1=1.0, VI4=1.0, n=(0.9, 0.0))
    u = inputs(VO1=1.0, VI4=1.0, P1=0.9)
    result = run(batch(5, p=P, x=x, u=u, faults={place: (severity, 0.0)}))
    above = result.of(junction)[-1] - 0.25
    assert above > 0.1
    assert result.of("q_leak")[-1] == pytest.approx(0.06 * severity * math.sqrt(above), rel=2e-3)
    drawn = result.of("q_out1")[-1]
    assert result.of("q_transfer")[-1] == pytest.approx(drawn - result.of("q_leak")[-1], abs=1e-6)
    healthy = run(batch(5, p=P, x=x, u=u))
    assert drawn > healthy.of("q_out1")[-1] > result.of("q_transfer")[-1]


@pytest.mark.parametrize("place", ["leakage_main", "leakage_common"])
def test_nothing_leaks_and_nothing_is_drawn_in_where_the_head_is_below_the_leak(place: str) -> None:
    """Surfaces at 0.2 m in B201 and 0.1 + 0.1 m in B204; the leak is at 0.25 m."""
    x = start(P, B201=0.2, B204=0.1, VO1=1.0, VI4=1.0)
    result = run(batch(30, p=P, x=x, u=inputs(VO1=1.0, VI4=1.0), faults={place: (1.0, 0.0)}))
    assert abs(result.of("q_leak")).max() < 1e-7 and result.of("spilled")[-1] < 1e-6


def test_b204_empties_through_a_leak_of_the_common_line_and_not_through_one_behind_the_non_return_valve() -> None:
    """B204 at 0.4 m, surface at 0.5 m: 0.25 = 34.8 q^2 + R q + (q / 0.06)^2 + R q."""
    x = start(P, B204=0.4, VI4=1.0)
    common = run(batch(1, p=P, x=x, u=inputs(VI4=1.0), faults={"leakage_common": (1.0, 0.0)}))
    by_hand = -root(34.8 + 1.0 / 0.0036, -2 * R, 0.25)
    assert common.of("q_transfer")[-1] == pytest.approx(by_hand, rel=0.01)
    assert by_hand == pytest.approx(-0.0282, abs=1e-4)
    main = run(batch(30, p=P, x=x, u=inputs(VI4=1.0), faults={"leakage_main": (1.0, 0.0)}))
    assert main.of("spilled")[-1] < 1e-6


@pytest.mark.parametrize(("n", "standing"), [((0.9, 0.0), 5), ((0.0, 0.85), 3)])
def test_no_flow_goes_back_through_the_line_that_stands(n: tuple[float, float], standing: int) -> None:
    """The running pump's header is more than 0.3 m above the suction; the non-return valve holds."""
    now = network(P, LIFT_LEVELS, outlets=ONE, n=n)
    assert now.heads[2] - now.heads[0] > 0.3
    assert now.flows[6] > 0.08 and abs(now.flows[standing]) < 1e-6


def test_a_weak_second_pump_gives_nothing_against_the_header() -> None:
    """At 0.3 it gives no more than a n^2 + b^2 n^2 / (4 (c + 46.4)) = 0.195 m; the header stands above that."""
    now = network(P, LIFT_LEVELS, outlets=ONE, n=(0.9, 0.3))
    assert now.heads[2] - now.heads[0] > A * 0.09 + (B * 0.3) ** 2 / (4.0 * (C + 46.4))
    assert abs(now.flows[5]) < 1e-6 and now.flows[3] == pytest.approx(now.flows[6], abs=1e-6)
