"""The reactor as it truly is in a simulated run: the model's equations, and what no twin of it knows (compiled).

Beside what :mod:`~homeostat.process.departures` puts before the actuators and behind the instruments:

    valves      flow = Cv (R^u - 1)/(R - 1) instead of Cv u: equal percentage with rangeability R
    pump        flow = K u (1 + a (V - 10 L)): more under more liquid
    jacket      UA u_d (u/u_d)^n (T - Tc) with u_d = 0.5: a film coefficient that grows with Re^n; the model has n = 1
    wall        C dTw/dt = k (T - Tw): steel that is warmed and cooled with the liquid
    agitator    W of stirring, which end as heat

Wall and agitator act for one second after the balances have. Neutral values are the model to the bit. Sources: Perry's
Chemical Engineers' Handbook, 8th ed., sections 8 (valve characteristics) and 11 (film coefficients in jackets).

Hand check: R = 30 and u = 0.5 give (30^0.5 - 1)/29 = 0.154 of the flow; n = 0.8 and u = 1 give 2^-0.2 = 0.871 of UA.
"""

from collections import namedtuple

from homeostat.plants.cstr import kernel as model
from homeostat.plants.cstr.layout import F, P, S, U
from homeostat.process.compiled import compiled
from homeostat.process.departures import ACTUATOR_STATES, BEFORE_ACTUATOR, NOISE_LAW, Departures, reached, restore, show
from homeostat.process.kernel import Columns, kernel
from homeostat.process.types import Cube, Indices, Table, Vec

Structure = namedtuple(
    "Structure",
    "V1_rangeability V2_rangeability "  # R of the valves; 0 for linear [1]
    "P1_head "  # a: change of the pump's flow per litre above 10 L [1/L]
    "jacket_exponent "  # n - 1 [1]
    "wall_J_K wall_W_K "  # C and k; 0 for no wall
    "agitator_W",  # heat of stirring [W]
)
"""Parameters that the process model does not have."""
DEPARTURES = Departures(
    actuators=("V1", "P1", "V2"),
    instruments=("T1", "L1", "F1", "F2", "F3", "T2", "T3", "V1_zt", "P1_zt", "V2_zt"),
    structure=Structure._fields,
)
COMMANDS = (S.V1_cmd, S.P1_cmd, S.V2_cmd)
SHOWN = (S.T1, S.L1, S.F1, S.F2, S.F3, S.T2, S.T3, S.V1_zt, S.P1_zt, S.V2_zt)
BEFORE = len(P) + len(NOISE_LAW)
"""First parameter of the first actuator; before it stands the noise law."""
BEHIND = BEFORE + len(BEFORE_ACTUATOR) * len(COMMANDS)
"""First parameter of the first instrument."""
OWN = len(P) + len(DEPARTURES.parameters)
Q = Structure(*range(OWN - len(Structure._fields), OWN))
INSTRUMENTS = len(S) + ACTUATOR_STATES * len(COMMANDS)
"""First state of the first instrument."""
WALL = len(S) + DEPARTURES.states
"""Temperature of the wall [K]."""
DESIGN_DUTY = 0.5
DESIGN_VOLUME = 10.0


@compiled
def characteristic(position: float, rangeability: float) -> float:
    """Share of the full flow at ``position`` [1] of an equal-percentage valve; ``rangeability`` 0 for a linear one."""
    if rangeability <= 1.0:
        return position
    return float((rangeability**position - 1.0) / (rangeability - 1.0))


@compiled
def duty(position: float, exponent: float) -> float:
    """What the jacket takes at ``position`` [1], as the position at which the model's jacket takes as much [1]."""
    if exponent == 0.0 or position <= 0.0:
        return position
    return float(position * (position / DESIGN_DUTY) ** exponent)


@compiled
def move(x: Vec, p: Vec, sev: Vec, onset: Vec, u: Vec, t: float, dt: float, share: model.Shares) -> None:
    """Actuators follow what reaches them of their commands; what is read back is the command itself."""
    v1, p1, v2 = x[S.V1_cmd], x[S.P1_cmd], x[S.V2_cmd]
    for i in range(len(COMMANDS)):
        own, to = len(S) + ACTUATOR_STATES * i, BEFORE + len(BEFORE_ACTUATOR) * i
        x[COMMANDS[i]] = reached(x[COMMANDS[i]], x, own, p, to, dt)
    model.move_actuators(x, sev, onset, u, t, dt, share)
    x[S.V1_cmd], x[S.P1_cmd], x[S.V2_cmd] = v1, p1, v2


@compiled
def set_flows(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, dt: float) -> None:
    """Flows [L/s] of this second by the true characteristics; positions stay as they are."""
    v1, p1, v2 = x[S.V1_pos], x[S.P1_pos], x[S.V2_pos]
    x[S.V1_pos] = characteristic(v1, p[Q.V1_rangeability])
    x[S.V2_pos] = characteristic(v2, p[Q.V2_rangeability])
    if p[Q.P1_head] != 0.0:
        x[S.P1_pos] = p1 * (1.0 + p[Q.P1_head] * (x[S.V] - DESIGN_VOLUME))
    model.set_flows(x, p, sev, onset, t, dt)
    x[S.V1_pos], x[S.P1_pos], x[S.V2_pos] = v1, p1, v2


@compiled
def integrate(x: Vec, p: Vec, dt: float) -> None:
    """Balances over ``dt`` [s] with the true duty of the jacket; then wall and agitator."""
    v2 = x[S.V2_pos]
    x[S.V2_pos] = duty(characteristic(v2, p[Q.V2_rangeability]), p[Q.jacket_exponent])
    model.integrate(x, p, dt)
    x[S.V2_pos] = v2
    heat = p[Q.agitator_W]
    if p[Q.wall_J_K] > 0.0:
        from_wall = p[Q.wall_W_K] * (x[WALL] - x[S.T])
        x[WALL] -= from_wall * dt / p[Q.wall_J_K]
        heat += from_wall
    if heat != 0.0:
        x[S.T] += heat * dt / (max(x[S.V], 1.0) * p[P.cp])


@compiled
def observe(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, seed: int, sensor: float, ideal: Vec) -> None:
    """Readings at ``t`` [s] by the true instruments; ``ideal``: room for readings without noise."""
    restore(x, SHOWN, INSTRUMENTS)
    model.measure(x, p, sev, onset, t, seed, 0.0)
    for i in range(len(SHOWN)):
        ideal[i] = x[SHOWN[i]]
    restore(x, SHOWN, INSTRUMENTS)
    model.measure(x, p, sev, onset, t, seed, sensor)
    show(x, SHOWN, ideal, INSTRUMENTS, p, BEHIND, len(P), seed, int(t + 0.5))
    x[S.T1_ideal], x[S.L1_ideal] = ideal[0], ideal[1]


@compiled
def step(
    x: Vec, p: Vec, sev: Vec, onset: Vec, u: Vec, t: float, seed: int, process: float, sensor: float,
    share: model.Shares, ideal: Vec,
) -> None:  # fmt: skip
    """One second of the true plant in place, in the order of the model's."""
    dt = 1.0
    model.advance_phase(x, p, u, t)
    model.control_feed(x, p, u, dt)
    model.control_level(x, p, u, dt)
    model.control_temperature(x, p, u, dt)
    move(x, p, sev, onset, u, t, dt, share)
    set_flows(x, p, sev, onset, t, dt)
    model.disturb_feed(x, p, u, t, seed, process, share.feed)
    integrate(x, p, dt)
    observe(x, p, sev, onset, t + dt, seed, sensor, ideal)


@kernel(Columns(WALL + 1, OWN, len(F), len(U)), scratch=len(U) + len(SHOWN), parts=model)
def advance(
    first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
    begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
    broken_at: Vec, room: Vec,
) -> None:  # fmt: skip
    """Advance members ``first`` to ``last`` - 1 to second ``steps``; see :class:`homeostat.process.batch.Kernel`."""
    now, ideal = room[0 : len(U)], room[len(U) : len(U) + len(SHOWN)]
    for m in range(first, last):
        if not model.physical(x[m]):
            broken_at[m] = t0 + begin[m]
            continue
        row, share = begin[m] // stride, model.shares(p[m], 1.0)
        xm, pm, sm, om, um = x[m], p[m], sev[m], onset[m], u[u_of[m]]
        for k in range(begin[m], steps):
            for j in range(len(U)):
                now[j] = um[k, j]
            step(xm, pm, sm, om, now, t0 + k, seeds[m], process[m], sensor[m], share, ideal)
            if not model.physical(xm):
                broken_at[m] = t0 + k + 1.0
                break
            if k % stride == stride - 1:
                for j in range(picks.shape[0]):
                    out[m, row, j] = xm[picks[j]]
                row += 1
