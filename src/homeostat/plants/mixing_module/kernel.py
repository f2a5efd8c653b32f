"""The Mixing Module, one simulated second at a time (compiled).

States: liquid V [L] of the feed tanks B201-B203 and the collecting tank B204, valve positions u [1], pump speeds n [1]:

    dV_i/dt = F_in - q_i - over_i           i = 1..3; F_in = F_fill u_in at constant supply pressure
    dV_4/dt = q_transfer - q_drain - over_4 q_drain = Cd a u sqrt(2 g h)  (orifice, Torricelli)
    du/dt   = +-1/travel towards the command;   dn/dt = (command - n)/tau

Where every outlet is closed and both pumps stand, nothing moves and the lines are without pressure.

q_i and q_transfer by :mod:`~homeostat.plants.mixing_module.hydraulics` from the present levels; over_i is what stands
above the brim. Four steps per second, flows held in each; a tank gives no more than it holds, and what the leaks and
B204 get is what the tanks gave, so that no liquid is made or lost:
V + delivered + spilled + overflowed = V(0) + supplied.

By hand and not from blocks, for what these cannot say: valves that travel at constant speed, a network that is solved
four times a second between two moves of them, and flows between tanks that are corrected by what the tanks hold.

Hand check: B204 drains from h1 to h2 in (A / (Cd a)) sqrt(2/g) (sqrt(h1) - sqrt(h2)) = 50 s for 0.65 m to 0.122 m with
A = 143 cm2, a = 0.950 cm2 and Cd = 0.62.
"""

import math
from typing import TypeAlias

from homeostat.plants.mixing_module.hydraulics import ROOM, clogged, solve, throttled
from homeostat.plants.mixing_module.instruments import level, measure_line, measure_tanks, supervise_pumps, tank_height
from homeostat.plants.mixing_module.layout import FEEDS, TANKS, VALVES, F, P, S, U
from homeostat.process.compiled import compiled
from homeostat.process.equipment import clip, first_order
from homeostat.process.kernel import Columns, kernel
from homeostat.process.noise import normal
from homeostat.process.types import Cube, Indices, Table, Vec

Scratch: TypeAlias = tuple[Vec, Vec, Vec]
"""Room for resistances and speeds of the line, for its flows, and for their solver."""
PARTS = 4
"""Steps per second."""


@compiled
def acting(sev: Vec, onset: Vec, t: float, slot: int) -> float:
    """Severity of fault ``slot`` at ``t`` [s]; 0 before its onset."""
    return sev[slot] if t >= onset[slot] else 0.0


@compiled
def move_actuators(x: Vec, p: Vec, sev: Vec, onset: Vec, u: Vec, t: float, dt: float) -> None:
    """Valves travel at constant speed, pumps follow with a lag; faults act on what reaches the actuator."""
    for i in range(VALVES):
        target = clip(u[U.VI1 + i], 0.0, 1.0)
        if acting(sev, onset, t, F.stuck_closed_VI201 + i) > 0.0:
            target = 0.0
        stuck = acting(sev, onset, t, F.stuck_open_VI201 + i)
        if stuck > 0.0:
            target = stuck
        fastest = dt / (p[P.travel] * p[P.slow_VI1 + i])
        step = clip(target - x[S.VI1_pos + i], -fastest, fastest)
        x[S.VI1_pos + i] = clip(x[S.VI1_pos + i] + step, 0.0, 1.0)
    main, bypass = u[U.P1] * (1.0 - acting(sev, onset, t, F.pump_degradation)), u[U.P2]
    if acting(sev, onset, t, F.pump_failure) > 0.0:
        main = 0.0
    if acting(sev, onset, t, F.pump_failure_P102) > 0.0:
        bypass = 0.0
    x[S.N1] = first_order(x[S.N1], main, p[P.tau_pump], dt)
    x[S.N2] = first_order(x[S.N2], bypass, p[P.tau_pump], dt)


@compiled
def describe_line(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, rough: float, line: Vec) -> bool:
    """Resistances and speeds for :func:`solve` with the faults at ``t`` [s]; whether anything can flow at all.

    ``rough``: relative disturbance of the pump speeds in this second [1]. A tank that is nearly empty gives as through
    a closing valve.
    """
    moving = False
    for i in range(FEEDS):
        base = clogged(p[P.k_tank], p[P.k_clog], acting(sev, onset, t, F.clogging_B201 + i))
        opening = x[S.VO1_pos + i] * min(1.0, level(x, p, i) / p[P.dry_level])
        line[i] = throttled(base, opening)
        moving = moving or opening > 1e-6
    line[3] = clogged(p[P.k_main], p[P.k_clog], acting(sev, onset, t, F.clogging_main))
    common = clogged(p[P.k_transfer], p[P.k_clog], acting(sev, onset, t, F.clogging_common))
    line[4] = throttled(common, x[S.VI4_pos])
    line[5] = 1.0 / max(p[P.leak_size] * acting(sev, onset, t, F.leakage_main), 1e-12) ** 2
    line[6] = 1.0 / max(p[P.leak_size] * acting(sev, onset, t, F.leakage_common), 1e-12) ** 2
    line[7] = x[S.N1] * (1.0 + rough)
    line[8] = x[S.N2] * (1.0 + rough) * p[P.bypass_size]
    back = x[S.VI4_pos] > 1e-6 and acting(sev, onset, t, F.leakage_common) > 0.0
    return moving or back or x[S.N1] > 1e-3 or x[S.N2] > 1e-3


@compiled
def integrate(x: Vec, p: Vec, flows: Vec, supply: float, dt: float) -> None:
    """Balances over ``dt`` [s]; ``supply``: factor on the fill rate [1]; ``flows`` as from :func:`solve` [L/s]."""
    out, into = 0.0, 0.0
    for i in range(FEEDS):
        fill = p[P.fill_rate] * supply * x[S.VI1_pos + i]
        x[S.q_in1 + i], x[S.q_out1 + i] = fill, min(flows[i], x[S.V1 + i] / dt + fill)
        out += max(x[S.q_out1 + i], 0.0)
        into -= min(x[S.q_out1 + i], 0.0)
    # Tanks fill each other; what a non-return valve lets by in the solution does not flow.
    share = min(1.0, out / into) if into > 0.0 else 1.0
    given = 0.0
    for i in range(FEEDS):
        if x[S.q_out1 + i] < 0.0:
            x[S.q_out1 + i] *= share
        given += x[S.q_out1 + i]
    given = max(given, 0.0)
    for i in range(FEEDS):
        x[S.V1 + i] = max(x[S.V1 + i] + (x[S.q_in1 + i] - x[S.q_out1 + i]) * dt, 0.0)
        x[S.supplied] += x[S.q_in1 + i] * dt
    # What the leaks and B204 get is what the tanks gave, and B204 gives back no more than it holds.
    transfer = max(given - max(flows[7], 0.0) - max(flows[8], 0.0), -x[S.V4] / dt)
    leak = given - transfer
    head = level(x, p, TANKS - 1)
    drain = 1000.0 * p[P.drain_cd] * p[P.drain_area] * x[S.VO4_pos] * math.sqrt(2.0 * 9.80665 * head)
    drain = min(drain, max(x[S.V4] / dt + transfer, 0.0))
    x[S.V4] = max(x[S.V4] + (transfer - drain) * dt, 0.0)
    over = 0.0
    for i in range(TANKS):
        above = max(x[S.V1 + i] - p[P.area] * tank_height(p, i), 0.0)
        x[S.V1 + i] -= above
        over += above
    x[S.q_main], x[S.q_bypass], x[S.q_transfer] = flows[3], flows[5], transfer
    x[S.q_drain], x[S.q_leak], x[S.q_over] = drain, leak, over / dt
    x[S.delivered] += drain * dt
    x[S.spilled] += leak * dt
    x[S.overflowed] += over


@compiled
def step(
    x: Vec, p: Vec, sev: Vec, onset: Vec, u: Vec, t: float, seed: int, process: float, sensor: float, scratch: Scratch
) -> float:
    """One second of the plant in place; how much the flows still changed when their iteration ended [L/s]."""
    line, flows, work = scratch
    k, dt, left = math.floor(t + 0.5), 1.0 / PARTS, 0.0
    rough, supply = 0.0, 1.0
    if process > 0.0:
        rough = process * p[P.sd_speed] * normal(seed, k, 12)
        supply += process * p[P.sd_supply] * normal(seed, k, 13)
    flows[:] = 0.05  # where the iteration begins: the same however a run is cut into calls
    for part in range(PARTS):
        now = t + part * dt
        move_actuators(x, p, sev, onset, u, now, dt)
        if describe_line(x, p, sev, onset, now, rough, line):
            left = max(left, solve(x, p, line, flows, work))
        else:
            flows[:] = 0.0
            x[S.head_suction] = x[S.head_main] = x[S.head_discharge] = 0.0
        integrate(x, p, flows, supply, dt)
    measure_tanks(x, p, sev, onset, t + 1.0, seed, sensor)
    measure_line(x, p, sev, onset, t + 1.0, seed, sensor)
    supervise_pumps(x, p, 1.0)
    return left


@compiled
def physical(x: Vec) -> bool:
    """Whether every volume is possible."""
    total = 0.0
    for i in range(TANKS):
        if not 0.0 <= x[S.V1 + i] < 1e6:
            return False
        total += x[S.V1 + i]
    return bool(math.isfinite(total + x[S.head_suction] + x[S.head_discharge] + x[S.N1] + x[S.N2]))


@kernel(Columns(len(S), len(P), len(F), len(U)), scratch=18 + ROOM)
def advance(
    first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
    begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
    broken_at: Vec, room: Vec,
) -> None:  # fmt: skip
    """Advance members ``first`` to ``last`` - 1 to second ``steps``; see :class:`homeostat.process.batch.Kernel`."""
    scratch = room[0:9], room[9:18], room[18 : 18 + ROOM]
    for m in range(first, last):
        if not physical(x[m]):
            broken_at[m] = t0 + begin[m]
            continue
        row = begin[m] // stride
        for k in range(begin[m], steps):
            now = u[u_of[m], k]
            left = step(x[m], p[m], sev[m], onset[m], now, t0 + k, seeds[m], process[m], sensor[m], scratch)
            if left > 1e-6 or not physical(x[m]):
                broken_at[m] = t0 + k + 1.0
                break
            if k % stride == stride - 1:
                for j in range(picks.shape[0]):
                    out[m, row, j] = x[m, picks[j]]
                row += 1
