"""Equipment building blocks: scalar, compiled, and written so that an engineer can check each by hand.

Every function also runs as plain Python (``first_order.py_func``), which is how the tests check it by hand.
"""

import math

from homeostat.process.compiled import compiled


@compiled
def clip(value: float, low: float, high: float) -> float:
    """``value`` limited to [low, high]."""
    return min(max(value, low), high)


@compiled
def lag_share(tau: float, dt: float) -> float:
    """Share [1] of the way to its command that a first-order lag with ``tau`` [s] goes in ``dt`` [s], 1 - exp(-dt/tau).

    Constant as long as both are: kernels work it out once per member. Check: tau = dt gives 1 - 1/e = 0.632.
    """
    return 1.0 - math.exp(-dt / tau)


@compiled
def approach(position: float, command: float, share: float) -> float:
    """Position [1] of a first-order actuator that goes ``share`` [1] of the way to ``command`` [1]."""
    return clip(position + share * (command - position), 0.0, 1.0)


@compiled
def first_order(position: float, command: float, tau: float, dt: float) -> float:
    """Position [1] of a first-order actuator after ``dt`` [s] towards ``command`` [1], exact for a held command.

    du/dt = (command - u) / tau, so u(dt) = u + (1 - exp(-dt/tau)) (command - u), limited to [0, 1].
    Check: u = 0, command = 1, tau = dt gives 1 - 1/e = 0.632.
    """
    return approach(position, command, lag_share(tau, dt))


@compiled
def linear_valve(coefficient: float, position: float) -> float:
    """Flow [L/s] through a valve with linear inherent characteristic at constant pressure drop.

    F = Cv u; ``coefficient`` is the flow at full opening [L/s].
    """
    return coefficient * position


@compiled
def pump_flow(capacity: float, speed: float, volume: float, inflow: float, dt: float) -> float:
    """Flow [L/s] of a displacement pump, K u, limited to what the tank can give within ``dt`` [s].

    The limit V/dt + inflow is loss of suction: a pump cannot draw liquid that is not there.
    """
    return min(capacity * speed, max(volume / dt + inflow, 0.0))


@compiled
def overflow(volume: float, brim: float, rate: float) -> float:
    """Flow [L/s] over the weir, k (V - V_max) for V > V_max; ``rate`` k [1/s], volumes [L]."""
    return rate * (volume - brim) if volume > brim else 0.0


@compiled
def jacket_heat(ua: float, opening: float, temperature: float, coolant: float) -> float:
    """Heat to the jacket, UA u (T - Tc) [W]; ua [W/K] at full coolant flow, temperatures [K].

    The overall coefficient is taken as proportional to coolant flow and the coolant temperature as constant.
    Check: UA = 500 W/K, u = 0.5, T = 310 K, Tc = 290 K gives 5000 W.
    """
    return ua * opening * (temperature - coolant)


@compiled
def arrhenius(prefactor: float, activation: float, temperature: float) -> float:
    """Rate constant k0 exp(-E/(R T)), R = 8.314 J/(mol K); ``activation`` [J/mol], ``temperature`` [K]."""
    return prefactor * math.exp(-activation / (8.314 * temperature))


@compiled
def pid_output(error: float, integral: float, gain: float, low: float, high: float) -> float:
    """Output of a PI controller before this step's integration, clip(Kp e + I, low, high)."""
    return clip(gain * error + integral, low, high)


@compiled
def pid_tracking(error: float, output: float, gain: float) -> float:
    """Integral term of a PI controller behind a manual ``output``, output - Kp e.

    Handed back to automatic the controller goes on from where the output stands (bumpless transfer).
    """
    return output - gain * error


@compiled
def pid_integral(error: float, integral: float, gain: float, reset: float, low: float, high: float, dt: float) -> float:
    """Integral term after ``dt`` [s] with conditional integration (anti-windup).

    The term grows by Ki e dt unless the output is at a limit and the error would drive it further out.
    """
    raw = gain * error + integral
    if (raw > high and error > 0.0) or (raw < low and error < 0.0):
        return integral
    return integral + reset * error * dt
