"""The reactor's equations by hand, one simulated second at a time (compiled): what the one from blocks is measured by.

States V [L], CA CB CC CD [mol/L], T [K]; A + D -> B with R1 = k1 CA CD, A -> C with R2 = k2 CA [mol/(L s)]:

    dV/dt  = F1 - Fo                    Fo = F2 + leak + overflow
    dC/dt  = (F1/V) (C_feed - C) + r    r = (-R1 - R2, +R1, +R2, -R1) for A, B, C, D
    dT/dt  = (F1/V) (T_feed - T) + (-dH1 R1 - dH2 R2)/cp - UA u (T - Tc)/(V cp) - UAamb (T - Tamb)/(V cp)

With ``published_balance`` = 1 the species follow the published form (F1/V) C_feed - (Fo/V) C + r, which does not
conserve matter while V changes; V and T are the same in both up to the small heat of reaction.
Denominators are held at V >= 0.1 L (feed, jacket) and V >= 1 L (ambient loss), as in the published model.

Hand check: F1 = 1/30 L/s, UA u = 500 * 0.5076 W/K gives T = (4180 F1 350 + 290 UAu + 50 300)/(4180 F1 + UAu + 50)
= 310.0 K in steady state (reaction heat, 2.7 W of 5573 W, neglected).
"""

import math
from typing import NamedTuple, TypeAlias

from benchmarks.plants.by_hand.layout import F, P, S, U
from homeostat.process.compiled import compiled
from homeostat.process.equipment import (
    approach,
    arrhenius,
    clip,
    jacket_heat,
    lag_share,
    linear_valve,
    overflow,
    pid_integral,
    pid_output,
    pid_tracking,
    pump_flow,
)
from homeostat.process.kernel import Columns, kernel
from homeostat.process.noise import normal
from homeostat.process.types import Cube, Indices, Table, Vec

STARTUP, NORMAL, SHUTDOWN = 0.0, 1.0, 2.0
Held: TypeAlias = tuple[float, float, float, float, float]
Rates: TypeAlias = tuple[float, float, float, float, float]


class Shares(NamedTuple):
    """Share of its way that each first-order lag goes in one second [1]; worked out once per member."""

    V1: float
    P1: float
    V2: float
    XV1: float
    feed: float


class Holdup(NamedTuple):
    """What the slopes need to know of the volume; the same for every slope at one volume."""

    feed: float  # F1 over V [1/s]
    out: float  # what each species leaves with, F1 over V or, in the published balance, Fo over V [1/s]
    heat: float  # V cp [J/K], the liquid that the jacket cools
    ambient: float  # UAamb / (V cp), loss to the ambient [1/s]


@compiled
def measure(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, seed: int, sensor: float) -> None:
    """Sensor readings at ``t`` [s]: true value + bias + noise; ``sensor`` scales all noise (0 or 1)."""
    k = math.floor(t + 0.5)
    late = 1.0 if t >= onset[F.temp_bias] else 0.0
    x[S.T1_ideal] = x[S.T] + p[P.bias_T1] + late * sev[F.temp_bias]
    x[S.T1] = x[S.T1_ideal]
    late = 1.0 if t >= onset[F.level_bias] else 0.0
    x[S.L1_ideal] = x[S.V] + p[P.bias_L1] - late * sev[F.level_bias]
    x[S.L1] = x[S.L1_ideal]
    x[S.F1] = x[S.F1_true] * (1.0 + p[P.bias_F1])
    x[S.F2] = x[S.F2_true] * (1.0 + p[P.bias_F2])
    x[S.F3] = x[S.F3_true] * (1.0 + p[P.bias_F3])
    x[S.T2] = x[S.T2_true] + p[P.bias_T2]
    x[S.T3] = x[S.T3_true] + p[P.bias_T3]
    x[S.V1_zt] = x[S.V1_pos] + p[P.bias_ZT1]
    x[S.P1_zt] = x[S.P1_pos] + p[P.bias_ZTP]
    x[S.V2_zt] = x[S.V2_pos] + p[P.bias_ZT2]
    if sensor > 0.0:
        x[S.T1] += sensor * p[P.sd_T1] * normal(seed, k, 0)
        x[S.L1] += sensor * p[P.sd_L1] * normal(seed, k, 1)
        x[S.F1] *= 1.0 + sensor * p[P.rel_F1] * normal(seed, k, 2)
        x[S.F2] *= 1.0 + sensor * p[P.rel_F2] * normal(seed, k, 3)
        x[S.F3] *= 1.0 + sensor * p[P.rel_F3] * normal(seed, k, 4)
        x[S.T2] += sensor * p[P.sd_T2] * normal(seed, k, 5)
        x[S.T3] += sensor * p[P.sd_T3] * normal(seed, k, 6)
        x[S.V1_zt] += sensor * p[P.sd_ZT] * normal(seed, k, 7)
        x[S.P1_zt] += sensor * p[P.sd_ZT] * normal(seed, k, 8)
        x[S.V2_zt] += sensor * p[P.sd_ZT] * normal(seed, k, 9)


@compiled
def advance_phase(x: Vec, p: Vec, u: Vec, t: float) -> None:
    """STARTUP until the level is reached or ``t_startup`` passed (latched); SHUTDOWN from ``t_shutdown`` on."""
    if x[S.phase] == STARTUP and (x[S.L1] >= u[U.L1_sp] or t >= p[P.t_startup]):
        x[S.phase] = NORMAL
    if t >= p[P.t_shutdown]:
        x[S.phase] = SHUTDOWN


@compiled
def control_feed(x: Vec, p: Vec, u: Vec, dt: float) -> None:
    """Flow loop: V1 holds F1 at F1.sp; closed in SHUTDOWN; the integral follows a manual output."""
    error = u[U.F1_sp] - x[S.F1]
    if not math.isnan(u[U.V1_man]):
        x[S.V1_cmd] = clip(u[U.V1_man], 0.0, 1.0)
        x[S.flow_integral] = pid_tracking(error, x[S.V1_cmd], p[P.Kp_flow])
    elif x[S.phase] == SHUTDOWN:
        x[S.V1_cmd] = 0.0
    else:
        x[S.V1_cmd] = pid_output(error, x[S.flow_integral], p[P.Kp_flow], 0.0, 1.0)
        x[S.flow_integral] = pid_integral(error, x[S.flow_integral], p[P.Kp_flow], p[P.Ki_flow], 0.0, 1.0, dt)


@compiled
def control_level(x: Vec, p: Vec, u: Vec, dt: float) -> None:
    """Level loop: P1 follows the measured feed and a PI trim; the trim may only add where ``trim_low`` is 0."""
    forward = clip(x[S.F1] / p[P.feedforward_P1], 0.0, 1.0)
    error = x[S.L1] - (p[P.L_heel] if x[S.phase] == SHUTDOWN else u[U.L1_sp])
    if not math.isnan(u[U.P1_man]):
        x[S.P1_cmd] = clip(u[U.P1_man], 0.0, 1.0)
        x[S.level_integral] = pid_tracking(error, x[S.P1_cmd] - forward, p[P.Kp_level])
        return
    if x[S.phase] == STARTUP:
        x[S.P1_cmd] = 0.0
        return
    if x[S.phase] == SHUTDOWN and x[S.V] <= 0.01:
        x[S.P1_cmd] = 0.0
        return
    trim = pid_output(error, x[S.level_integral], p[P.Kp_level], p[P.trim_low], 1.0)
    x[S.level_integral] = pid_integral(error, x[S.level_integral], p[P.Kp_level], p[P.Ki_level], p[P.trim_low], 1.0, dt)
    x[S.P1_cmd] = clip(forward + trim, 0.0, 1.0)
    if x[S.phase] == SHUTDOWN:
        x[S.P1_cmd] = max(x[S.P1_cmd], 0.05)


@compiled
def control_temperature(x: Vec, p: Vec, u: Vec, dt: float) -> None:
    """Temperature loop: more coolant when hot; off in SHUTDOWN once the tank is empty."""
    error = x[S.T1] - u[U.T1_sp]
    if not math.isnan(u[U.V2_man]):
        x[S.V2_cmd] = clip(u[U.V2_man], 0.0, 1.0)
        x[S.temperature_integral] = pid_tracking(error, x[S.V2_cmd], p[P.Kp_temperature])
        return
    if x[S.phase] == SHUTDOWN and x[S.V] <= 0.1:
        x[S.V2_cmd] = 0.0
        return
    x[S.V2_cmd] = pid_output(error, x[S.temperature_integral], p[P.Kp_temperature], 0.0, 1.0)
    x[S.temperature_integral] = pid_integral(
        error, x[S.temperature_integral], p[P.Kp_temperature], p[P.Ki_temperature], 0.0, 1.0, dt
    )


@compiled
def move_actuators(x: Vec, sev: Vec, onset: Vec, u: Vec, t: float, dt: float, share: Shares) -> None:
    """Actuator faults act on the command that reaches the actuator; positions follow with first-order lag."""
    feed, cooling = x[S.V1_cmd], x[S.V2_cmd]
    if sev[F.inlet_stuck_open] > 0.0 and t >= onset[F.inlet_stuck_open]:
        feed = sev[F.inlet_stuck_open]
    if sev[F.cool_stuck_closed] > 0.0 and t >= onset[F.cool_stuck_closed]:
        cooling = 1.0 - sev[F.cool_stuck_closed]
    if sev[F.cool_stuck_open] > 0.0 and t >= onset[F.cool_stuck_open]:
        cooling = sev[F.cool_stuck_open]
    before = x[S.V1_pos]
    x[S.V1_pos] = approach(before, feed, share.V1)
    x[S.V1_rate] = abs(x[S.V1_pos] - before) / dt
    before = x[S.P1_pos]
    x[S.P1_pos] = approach(before, x[S.P1_cmd], share.P1)
    x[S.P1_rate] = abs(x[S.P1_pos] - before) / dt
    before = x[S.V2_pos]
    x[S.V2_pos] = approach(before, cooling, share.V2)
    x[S.V2_rate] = abs(x[S.V2_pos] - before) / dt
    x[S.V1_travel] += x[S.V1_rate] * dt
    x[S.P1_travel] += x[S.P1_rate] * dt
    x[S.V2_travel] += x[S.V2_rate] * dt
    x[S.XV1_pos] = approach(x[S.XV1_pos], u[U.XV1_cmd], share.XV1)


@compiled
def set_flows(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, dt: float) -> None:
    """Flows [L/s] of this second, from positions and the volume at its start."""
    x[S.F1_true] = linear_valve(p[P.Cv_V1], x[S.V1_pos]) * x[S.XV1_pos]
    x[S.F3_true] = linear_valve(p[P.F3_max], x[S.V2_pos])
    x[S.leak] = sev[F.leak] * x[S.V] if t >= onset[F.leak] else 0.0
    x[S.overflow] = overflow(x[S.V], p[P.V_brim], p[P.k_brim])
    capacity = p[P.K_P1]
    if t >= onset[F.pump_degrade]:
        capacity *= 1.0 - sev[F.pump_degrade]
    if t >= onset[F.outlet_block]:
        capacity *= 1.0 - sev[F.outlet_block]
    gain = x[S.F1_true] - x[S.leak] - x[S.overflow]
    x[S.F2_true] = pump_flow(capacity, x[S.P1_pos], x[S.V], gain, dt)
    ua = p[P.UA]
    if t >= onset[F.fouling]:
        lost = sev[F.fouling] * (1.0 - math.exp(-(t - onset[F.fouling]) / p[P.tau_fouling]))
        ua *= 1.0 - min(lost, 0.95)
    x[S.UA] = ua


@compiled
def disturb_feed(x: Vec, p: Vec, u: Vec, t: float, seed: int, process: float, share: float) -> None:
    """Feed disturbances of this second; upstream mixing takes up ``share`` [1] of each new one.

    Where temperatures of feed and cooling water were measured, the readings say what they are.
    """
    if process > 0.0:
        k = math.floor(t + 0.5)
        x[S.feed_CA] += share * (process * normal(seed, k, 10) - x[S.feed_CA])
        x[S.feed_CD] += share * (process * normal(seed, k, 11) - x[S.feed_CD])
        x[S.feed_T] += share * (process * normal(seed, k, 12) - x[S.feed_T])
    x[S.T3_true] = p[P.T_coolant] if math.isnan(u[U.T3_in]) else u[U.T3_in] - p[P.bias_T3]
    if math.isnan(u[U.T2_in]):
        x[S.T2_true] = p[P.T_feed] + p[P.sd_T_feed] * x[S.feed_T]
    else:
        x[S.T2_true] = u[U.T2_in] - p[P.bias_T2]
        if p[P.sd_T_feed] > 0.0:
            x[S.feed_T] = (x[S.T2_true] - p[P.T_feed]) / p[P.sd_T_feed]


@compiled
def integrate(x: Vec, p: Vec, dt: float) -> None:
    """Balances over ``dt`` [s] with flows held: Runge-Kutta 4, shorter steps while the tank is nearly empty."""
    parts = 1 if x[S.V] > 2.0 else (8 if x[S.V] > 0.5 else 32)
    h = dt / parts
    f1, fo = x[S.F1_true], x[S.F2_true] + x[S.leak] + x[S.overflow]
    caf = p[P.CA_feed] + p[P.sd_CA_feed] * x[S.feed_CA]
    cdf = p[P.CD_feed] + p[P.sd_CD_feed] * x[S.feed_CD]
    ua = x[S.UA] * x[S.V2_pos]
    v, ca, cb, cc, cd, temp = x[S.V], x[S.CA], x[S.CB], x[S.CC], x[S.CD], x[S.T]
    held = (caf, cdf, x[S.T2_true], ua, x[S.T3_true])
    begin = holdup(v, f1, fo, p)
    for _ in range(parts):
        g = 0.5 * h
        middle = holdup(v + 0.5 * h * (f1 - fo), f1, fo, p)
        v += h * (f1 - fo)
        end = holdup(v, f1, fo, p)
        a1, b1, c1, d1, t1 = slopes(begin, ca, cb, cc, cd, temp, held, p)
        a2, b2, c2, d2, t2 = slopes(middle, ca + g * a1, cb + g * b1, cc + g * c1, cd + g * d1, temp + g * t1, held, p)
        a3, b3, c3, d3, t3 = slopes(middle, ca + g * a2, cb + g * b2, cc + g * c2, cd + g * d2, temp + g * t2, held, p)
        a4, b4, c4, d4, t4 = slopes(end, ca + h * a3, cb + h * b3, cc + h * c3, cd + h * d3, temp + h * t3, held, p)
        ca += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        cb += h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4)
        cc += h / 6.0 * (c1 + 2.0 * c2 + 2.0 * c3 + c4)
        cd += h / 6.0 * (d1 + 2.0 * d2 + 2.0 * d3 + d4)
        temp += h / 6.0 * (t1 + 2.0 * t2 + 2.0 * t3 + t4)
        begin = end
    # What the pump and the leak may take is limited to what is there; rounding may leave -1e-18 L.
    x[S.V] = 0.0 if -1e-12 < v < 0.0 else v
    x[S.CA], x[S.CB], x[S.CC], x[S.CD], x[S.T] = ca, cb, cc, cd, temp
    x[S.product] += x[S.F2_true] * dt


@compiled
def holdup(v: float, f1: float, fo: float, p: Vec) -> Holdup:
    """What follows from the volume ``v`` [L] alone, at flows ``f1`` and ``fo`` [L/s]; see the module docstring."""
    wet = max(v, 0.1)
    feed = f1 / wet
    out = fo / wet if p[P.published_balance] > 0.0 else feed
    return Holdup(feed, out, wet * p[P.cp], p[P.UA_ambient] / (max(v, 1.0) * p[P.cp]))


@compiled
def slopes(hold: Holdup, ca: float, cb: float, cc: float, cd: float, temp: float, held: Held, p: Vec) -> Rates:
    """Time derivatives of CA CB CC CD [mol/(L s)] and T [K/s]; see the module docstring.

    ``held``: feed concentrations of A and D [mol/L], feed temperature [K], UA u of the jacket [W/K], coolant [K].
    """
    caf, cdf, tf, ua, coolant = held
    r1 = arrhenius(p[P.k0_AD], p[P.E_AD], temp) * ca * cd
    r2 = arrhenius(p[P.k0_A], p[P.E_A], temp) * ca
    heat = (
        (-p[P.dH_AD] * r1 - p[P.dH_A] * r2) / p[P.cp]
        - jacket_heat(ua, 1.0, temp, coolant) / hold.heat
        - hold.ambient * (temp - p[P.T_ambient])
    )
    return (
        hold.feed * caf - hold.out * ca - r1 - r2,
        -hold.out * cb + r1,
        -hold.out * cc + r2,
        hold.feed * cdf - hold.out * cd - r1,
        hold.feed * (tf - temp) + heat,
    )


@compiled
def shares(p: Vec, dt: float) -> Shares:
    """Shares of steps of ``dt`` [s]; ``tau_feed`` [s] of upstream mixing filters the feed, 0 leaves it white."""
    feed = 1.0 if p[P.tau_feed] <= 0.0 else lag_share(p[P.tau_feed], dt)
    v1, p1 = lag_share(p[P.tau_V1], dt), lag_share(p[P.tau_P1], dt)
    v2, xv1 = lag_share(p[P.tau_V2], dt), lag_share(p[P.tau_XV1], dt)
    return Shares(v1, p1, v2, xv1, feed)


@compiled
def step(
    x: Vec, p: Vec, sev: Vec, onset: Vec, u: Vec, t: float, seed: int, process: float, sensor: float, share: Shares
) -> None:
    """One second of the plant in place: phase, loops, actuators, flows, feed, balances, measurement."""
    dt = 1.0
    advance_phase(x, p, u, t)
    control_feed(x, p, u, dt)
    control_level(x, p, u, dt)
    control_temperature(x, p, u, dt)
    move_actuators(x, sev, onset, u, t, dt, share)
    set_flows(x, p, sev, onset, t, dt)
    disturb_feed(x, p, u, t, seed, process, share.feed)
    integrate(x, p, dt)
    measure(x, p, sev, onset, t + dt, seed, sensor)


@compiled
def physical(x: Vec) -> bool:
    """Whether volume and temperature are possible and the concentrations finite."""
    matter = x[S.CA] + x[S.CB] + x[S.CC] + x[S.CD]
    return bool(0.0 <= x[S.V] < 1e6 and 0.0 < x[S.T] < 1e6 and math.isfinite(matter))


@kernel(Columns(len(S), len(P), len(F), len(U)), scratch=len(U))
def advance(
    first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
    begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
    broken_at: Vec, now: Vec,
) -> None:  # fmt: skip
    """Advance members ``first`` to ``last`` - 1 to second ``steps``; see :class:`homeostat.process.batch.Kernel`."""
    for m in range(first, last):
        if not physical(x[m]):
            broken_at[m] = t0 + begin[m]
            continue
        row, share = begin[m] // stride, shares(p[m], 1.0)
        xm, pm, sm, om, um = x[m], p[m], sev[m], onset[m], u[u_of[m]]
        for k in range(begin[m], steps):
            t = t0 + k
            for j in range(len(U)):
                now[j] = um[k, j]
            step(xm, pm, sm, om, now, t, seeds[m], process[m], sensor[m], share)
            if not physical(xm):
                broken_at[m] = t + 1.0
                break
            if k % stride == stride - 1:
                for j in range(picks.shape[0]):
                    out[m, row, j] = xm[picks[j]]
                row += 1
