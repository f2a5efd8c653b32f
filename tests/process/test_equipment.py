"""Every equipment function against numbers worked out by hand, as plain Python and compiled."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.process import equipment
from homeostat.process.compiled import machine_code

HAND = [
    # Limits.
    ("clip", (0.5, 0.0, 1.0), 0.5),
    ("clip", (-0.5, 0.0, 1.0), 0.0),
    ("clip", (1.5, 0.0, 1.0), 1.0),
    ("clip", (math.inf, 0.0, 1.0), 1.0),
    # After one time constant 1 - 1/e of the way, after ln 2 of them half of it, after none nothing.
    ("first_order", (0.0, 1.0, 2.0, 2.0), 0.6321205588285577),
    ("first_order", (1.0, 0.0, 1.0, math.log(2.0)), 0.5),
    ("first_order", (0.3, 0.9, 5.0, 0.0), 0.3),
    ("first_order", (0.3, 0.9, 1e-3, 1.0), 0.9),
    ("first_order", (0.9, 5.0, 1e-3, 1.0), 1.0),
    ("first_order", (0.1, -5.0, 1e-3, 1.0), 0.0),
    # The published actuators: a = 0.964326 for the valves, 0.993262 for the pump.
    ("first_order", (0.0, 1.0, 0.3, 1.0), 0.9643260066527476),
    ("first_order", (0.0, 1.0, 0.2, 1.0), 0.9932620530009145),
    # The same in two parts: the share of the way, and the way.
    ("lag_share", (2.0, 2.0), 0.6321205588285577),
    ("lag_share", (1.0, math.log(2.0)), 0.5),
    ("lag_share", (5.0, 0.0), 0.0),
    ("approach", (0.2, 0.6, 0.5), 0.4),
    ("approach", (0.9, 5.0, 1.0), 1.0),
    ("approach", (0.1, -5.0, 1.0), 0.0),
    # 0.06 L/s at full opening gives the design feed of 2 L/min at 5/9.
    ("linear_valve", (0.06, 5.0 / 9.0), 1.0 / 30.0),
    ("linear_valve", (0.06, 0.0), 0.0),
    # 0.08 L/s at full speed; 0.01 L in the tank and 0.02 L/s coming in leave 0.03 L/s for a second.
    ("pump_flow", (0.08, 0.5, 10.0, 0.03, 1.0), 0.04),
    ("pump_flow", (0.08, 1.0, 0.01, 0.02, 1.0), 0.03),
    ("pump_flow", (0.08, 1.0, 0.01, 0.02, 2.0), 0.025),
    ("pump_flow", (0.08, 1.0, 0.0, -0.01, 1.0), 0.0),
    # A fifth of a litre above the weir.
    ("overflow", (11.2, 11.0, 0.05), 0.01),
    ("overflow", (11.0, 11.0, 0.05), 0.0),
    ("overflow", (3.0, 11.0, 0.05), 0.0),
    ("jacket_heat", (500.0, 0.5, 310.0, 290.0), 5000.0),
    ("jacket_heat", (500.0, 0.5, 280.0, 290.0), -2500.0),
    # E = R T gives k0 / e; the reactor's A -> C at 310 K: 0.1 exp(-5000 / 2577.34).
    ("arrhenius", (0.1, 8.314 * 310.0, 310.0), 0.1 / math.e),
    ("arrhenius", (0.1, 5000.0, 310.0), 0.014370616),
    ("arrhenius", (0.05, 0.0, 310.0), 0.05),
    ("pid_output", (0.02, 0.3, 10.0, 0.0, 1.0), 0.5),
    ("pid_output", (0.2, 0.3, 10.0, 0.0, 1.0), 1.0),
    ("pid_output", (-0.2, 0.3, 10.0, 0.0, 1.0), 0.0),
    ("pid_output", (-0.2, 0.3, 10.0, -1.0, 1.0), -1.0),
    # Behind an output of 0.6 and 0.2 off its setpoint, the integral is what the gain leaves of it.
    ("pid_tracking", (0.2, 0.6, 0.5), 0.5),
    ("pid_tracking", (-2.0, 0.6, 0.5), 1.6),
    # The integral grows by Ki e dt, but not further out of a limit.
    ("pid_integral", (0.02, 0.3, 10.0, 5.0, 0.0, 1.0, 1.0), 0.4),
    ("pid_integral", (0.02, 0.3, 10.0, 5.0, 0.0, 1.0, 2.0), 0.5),
    ("pid_integral", (0.2, 0.3, 10.0, 5.0, 0.0, 1.0, 1.0), 0.3),
    ("pid_integral", (-0.2, 0.3, 10.0, 5.0, 0.0, 1.0, 1.0), 0.3),
    ("pid_integral", (-0.02, 1.5, 10.0, 5.0, 0.0, 1.0, 1.0), 1.4),
    ("pid_integral", (0.02, -0.5, 10.0, 5.0, 0.0, 1.0, 1.0), -0.4),
]


def both(name: str) -> tuple[Callable[..., float], Callable[..., float]]:
    """The function as plain Python and compiled."""
    function = getattr(equipment, name)
    return function.py_func, machine_code(function)


@pytest.mark.parametrize(("name", "arguments", "expected"), HAND)
def test_by_hand(name: str, arguments: tuple[float, ...], expected: float) -> None:
    plain, quick = both(name)
    assert plain(*arguments) == pytest.approx(expected, rel=1e-6, abs=1e-15)
    assert quick(*arguments) == pytest.approx(plain(*arguments), rel=1e-15, abs=0.0)


def test_every_function_has_a_hand_check() -> None:
    made_here = {n for n, f in vars(equipment).items() if hasattr(f, "py_func")}
    assert made_here == {name for name, _, _ in HAND}


@pytest.mark.parametrize("place", [0, 1])
@pytest.mark.parametrize(
    ("name", "arguments"), [("clip", (0.5, 0.0, 1.0)), ("first_order", (0.5, 0.6, 0.3, 1.0)),
                            ("approach", (0.5, 0.6, 0.9)), ("lag_share", (0.3, 1.0)),
                            ("pump_flow", (0.08, 0.5, 10.0, 0.03, 1.0)), ("pid_output", (0.1, 0.1, 1.0, 0.0, 1.0)),
                            ("pid_integral", (0.1, 0.1, 1.0, 0.1, 0.0, 1.0, 1.0))],
)  # fmt: skip
def test_nan_is_not_swallowed_by_a_limit(name: str, arguments: tuple[float, ...], place: int) -> None:
    """A limit that turned NaN into a number would hide a broken member from the engine."""
    if name == "clip" and place == 1:
        return
    poisoned = [*arguments]
    poisoned[place] = math.nan
    plain, quick = both(name)
    assert math.isnan(plain(*poisoned)) and math.isnan(quick(*poisoned))


UNIT = st.floats(0.0, 1.0)


@given(UNIT, UNIT, st.floats(0.05, 100.0), st.floats(0.0, 50.0), st.floats(0.0, 50.0))
def test_an_actuator_is_the_same_in_one_step_or_two(u: float, to: float, tau: float, a: float, b: float) -> None:
    once = equipment.first_order(u, to, tau, a + b)
    twice = equipment.first_order(equipment.first_order(u, to, tau, a), to, tau, b)
    assert once == pytest.approx(twice, abs=1e-12)
    assert min(u, to) - 1e-15 <= once <= max(u, to) + 1e-15


@given(st.floats(0.0, 1.0), UNIT, st.floats(0.0, 20.0), st.floats(-1.0, 1.0))
def test_a_pump_never_takes_more_than_there_is(capacity: float, speed: float, volume: float, inflow: float) -> None:
    flow = equipment.pump_flow(capacity, speed, volume, inflow, 1.0)
    assert 0.0 <= flow <= capacity * speed
    assert flow <= max(volume + inflow, 0.0)


@given(st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=40), st.floats(0.01, 20.0), st.floats(0.001, 5.0))
def test_the_integral_never_winds_up(errors: list[float], gain: float, reset: float) -> None:
    """While the output is at a limit and the error drives it out, the integral rests; then it comes back at once."""
    integral = 0.0
    for error in errors:
        before = integral
        integral = equipment.pid_integral(error, integral, gain, reset, 0.0, 1.0, 1.0)
        raw = gain * error + before
        if (raw > 1.0 and error > 0.0) or (raw < 0.0 and error < 0.0):
            assert integral == before
        else:
            assert integral == before + reset * error
