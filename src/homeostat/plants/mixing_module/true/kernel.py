"""The Mixing Module as it truly is in a simulated run: the model's equations, and what no twin knows (compiled).

Beside what :mod:`~homeostat.process.departures` puts before the actuators and behind the instruments:

    pipes    head loss k (q/q_d)^(n-2) q^2 with q_d = 0.15 L/s: smooth pipe has n = 1.75 (Blasius), the model n = 2
    supply   each further open inlet takes a share of the supply's flow from the others
    seats    a closed inlet valve lets a share of its flow by

All three change the parameters of a second by the flows and positions at its start. Neutral values (0 everywhere) are
the model to the bit. Source: Perry's Chemical Engineers' Handbook, 8th ed., section 6 (friction factors).

Hand check: n = 1.75 and q = 0.05 L/s give 3^0.25 = 1.316 times the resistance at 0.15 L/s.
"""

from collections import namedtuple

from homeostat.plants.mixing_module import kernel as model
from homeostat.plants.mixing_module.hydraulics import ROOM
from homeostat.plants.mixing_module.instruments import measure_line, measure_tanks
from homeostat.plants.mixing_module.layout import FEEDS, F, P, S, U
from homeostat.process.compiled import compiled
from homeostat.process.departures import ACTUATOR_STATES, BEFORE_ACTUATOR, NOISE_LAW, Departures, reached, restore, show
from homeostat.process.kernel import Columns, kernel
from homeostat.process.types import Cube, Indices, Table, Vec

Structure = namedtuple(
    "Structure",
    "friction_exponent "  # n - 2 [1]
    "supply_droop "  # share of the supply that each further open inlet takes [1]
    "seat_leak",  # share of its flow that a closed inlet valve lets by [1]
)
"""Parameters that the process model does not have."""
_TANKS = ("B201", "B202", "B203", "B204")
DEPARTURES = Departures(
    actuators=("VI201", "VI202", "VI203", "VO201", "VO202", "VO203", "VI204", "VO204", "P101", "P102"),
    instruments=(
        *(f"{what}_{tank}" for what in ("L", "P") for tank in _TANKS),
        *("P_main", "P_header", "flow"),
        *(f"{what}_{tank}" for what in ("LSL", "LSM", "LSH") for tank in _TANKS),
        *("speed_P101", "speed_P102"),
    ),
    structure=Structure._fields,
)
SHOWN = tuple(range(S.LT1, S.ST2 + 1))
"""Columns of the instruments, in the order of their names."""
COMMANDS = len(U)
BEFORE = len(P) + len(NOISE_LAW)
"""First parameter of the first actuator; before it stands the noise law."""
BEHIND = BEFORE + len(BEFORE_ACTUATOR) * COMMANDS
"""First parameter of the first instrument."""
OWN = len(P) + len(DEPARTURES.parameters)
Q = Structure(*range(OWN - len(Structure._fields), OWN))
INSTRUMENTS = len(S) + ACTUATOR_STATES * COMMANDS
"""First state of the first instrument."""
DESIGN_FLOW = 0.15
LEAST_FLOW = 0.02
"""Flow below which friction grows no more [L/s]."""
LINE = 18 + ROOM
"""Numbers of room that the model's step takes."""


@compiled
def friction(flow: float, exponent: float) -> float:
    """Factor on a resistance at ``flow`` [L/s]."""
    return float((max(abs(flow), LEAST_FLOW) / DESIGN_FLOW) ** exponent)


@compiled
def parameters_now(x: Vec, p: Vec, now: Vec) -> None:
    """The model's parameters of this second, into ``now``."""
    for i in range(len(P)):
        now[i] = p[i]
    if p[Q.friction_exponent] != 0.0:
        widest = max(x[S.q_out1], x[S.q_out2], x[S.q_out3])
        now[P.k_tank] *= friction(widest, p[Q.friction_exponent])
        now[P.k_suction] *= friction(x[S.q_main], p[Q.friction_exponent])
        now[P.k_main] *= friction(x[S.q_main], p[Q.friction_exponent])
        now[P.k_bypass] *= friction(x[S.q_bypass], p[Q.friction_exponent])
        now[P.k_transfer] *= friction(x[S.q_transfer], p[Q.friction_exponent])
    if p[Q.supply_droop] > 0.0:
        others = max(x[S.VI1_pos] + x[S.VI2_pos] + x[S.VI3_pos] - 1.0, 0.0)
        now[P.fill_rate] *= max(1.0 - p[Q.supply_droop] * others, 0.0)


@compiled
def commands_now(x: Vec, p: Vec, u: Vec, now: Vec, dt: float) -> None:
    """What of the commands ``u`` reaches the actuators, into ``now``."""
    for i in range(COMMANDS):
        own, to = len(S) + ACTUATOR_STATES * i, BEFORE + len(BEFORE_ACTUATOR) * i
        now[i] = reached(u[i], x, own, p, to, dt)
    if p[Q.seat_leak] > 0.0:
        for i in range(FEEDS):
            now[i] = max(now[i], p[Q.seat_leak])


@compiled
def observe(x: Vec, p: Vec, sev: Vec, onset: Vec, t: float, seed: int, raw: Vec, ideal: Vec) -> None:
    """Turn what the model's instruments show at ``t`` [s] into what the true ones do; ``raw``, ``ideal``: room."""
    for i in range(len(SHOWN)):
        raw[i] = x[SHOWN[i]]
    restore(x, SHOWN, INSTRUMENTS)
    measure_tanks(x, p, sev, onset, t, seed, 0.0)
    measure_line(x, p, sev, onset, t, seed, 0.0)
    for i in range(len(SHOWN)):
        ideal[i] = x[SHOWN[i]]
        x[SHOWN[i]] = raw[i]
    show(x, SHOWN, ideal, INSTRUMENTS, p, BEHIND, len(P), seed, int(t + 0.5))


@kernel(
    Columns(len(S) + DEPARTURES.states, OWN, len(F), len(U)),
    scratch=LINE + len(P) + COMMANDS + 2 * len(SHOWN),
    parts=model,
)
def advance(
    first: int, last: int, x: Table, p: Table, sev: Table, onset: Table, u: Cube, u_of: Indices, t0: float,
    begin: Indices, steps: int, stride: int, seeds: Indices, process: Vec, sensor: Vec, picks: Indices, out: Cube,
    broken_at: Vec, room: Vec,
) -> None:  # fmt: skip
    """Advance members ``first`` to ``last`` - 1 to second ``steps``; see :class:`homeostat.process.batch.Kernel`."""
    line, pn = (room[0:9], room[9:18], room[18:LINE]), room[LINE : LINE + len(P)]
    rest = room[LINE + len(P) :]
    un, raw, ideal = rest[0:COMMANDS], rest[COMMANDS : COMMANDS + len(SHOWN)], rest[COMMANDS + len(SHOWN) :]
    for m in range(first, last):
        if not model.physical(x[m]):
            broken_at[m] = t0 + begin[m]
            continue
        row = begin[m] // stride
        for k in range(begin[m], steps):
            commands_now(x[m], p[m], u[u_of[m], k], un, 1.0)
            parameters_now(x[m], p[m], pn)
            restore(x[m], SHOWN, INSTRUMENTS)
            left = model.step(x[m], pn, sev[m], onset[m], un, t0 + k, seeds[m], process[m], sensor[m], line)
            observe(x[m], p[m], sev[m], onset[m], t0 + k + 1.0, seeds[m], raw, ideal)
            if left > 1e-6 or not model.physical(x[m]):
                broken_at[m] = t0 + k + 1.0
                break
            if k % stride == stride - 1:
                for j in range(picks.shape[0]):
                    out[m, row, j] = x[m, picks[j]]
                row += 1
