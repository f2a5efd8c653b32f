"""Flows through the pipes of the Mixing Module (compiled).

Three junctions with unknown heads [m above the floor of the feed tanks]: S, where the feed tanks' outlets join; M,
behind P101; D, where main and bypass line join again. Every branch has a law: the head that it takes, as a function
that grows with its flow q [L/s]. Resistances K in m/(L/s)^2 (turbulent pipe flow with the friction factor of the design
flow, Blasius f = 0.028 at Re = 1.6e4), R in m/(L/s) for the laminar flow that is left near zero:

    tank i -> S     K q |q| + R q, K = K_tank + clogging, divided by the opening squared; tanks may level out
    S -> M          K q^2 - head of P101, n = speed / rated speed: a n^2 + b n q - c q^2 (affinity laws)
    M -> D          K q^2 of the main pipe + clogging; non-return valve
    S -> D          K q^2 - head of P102; non-return valve
    D -> B204       K q |q| of valve and pipe, divided by the opening squared
    M, D -> tray    (q / C)^2 up to the height of the leak; nothing is drawn in

Head curve a = 2.141 m, b = 2.728 m s/L, c = 28.82 m s^2/L^2 at 166.43 rpm: fitted through the three flows that the
plant's data sheet gives for its pump. The heads follow from what flows into a junction flowing out of it, by the global
gradient method (Todini and Pilati, 1988): laws are linearised at the present flows, heads and flows solved for, and so
on; what comes out closes every balance exactly.

Hand check: no lift, K = 92.8 m/(L/s)^2 in all (4 m of 10 mm pipe), n = 0.9013 (150 rpm): 1.739 + 2.459 q = 121.6 q^2
gives q = 0.130 L/s.
"""

from homeostat.plants.mixing_module.layout import FEEDS, P, S
from homeostat.process.blocks.hydraulics.laws import LAMINAR, SHUT
from homeostat.process.blocks.hydraulics.solver import COLUMNS, ONE_WAY, PIPE, PUMP, room, solve_network
from homeostat.process.compiled import compiled
from homeostat.process.types import Vec

ENOUGH = 1e-11
"""Flows are iterated until they change by less than this [L/s]."""
MOST = 30
"""Most iterations; what has not arrived by then is solved heads first, by the solver of the blocks."""
NO_LEAK = 1e23
"""Resistance above which a leak is none [m/(L/s)^2]."""
BRANCHES = 9
"""Tank outlets (3), P101, main pipe, bypass, into B204, leaks at M and D."""
JUNCTIONS = 3
"""S, M and D."""
NETWORK = 39
"""Where the numbers of the solver of the blocks begin."""
ROOM = NETWORK + room(JUNCTIONS, BRANCHES)
"""Numbers of room that :func:`solve` takes."""


@compiled
def pipe(resistance: float, flow: float) -> tuple[float, float]:
    """Head that a pipe takes [m] and its slope [m/(L/s)]."""
    return resistance * flow * abs(flow) + LAMINAR * flow, 2.0 * resistance * abs(flow) + LAMINAR


@compiled
def one_way(resistance: float, flow: float) -> tuple[float, float]:
    """The same behind a non-return valve."""
    if flow < 0.0:
        return SHUT * flow, SHUT
    return pipe(resistance, flow)


@compiled
def pump(a: float, b: float, resistance: float, speed: float, flow: float) -> tuple[float, float]:
    """Head that a pump takes (negative: gives) behind a non-return valve [m] and its slope [m/(L/s)].

    ``resistance``: the curve's own c plus that of the pipe. Left of the top of its curve the head stays what it is at
    the top, so that every head belongs to one flow.
    """
    top = b * speed / (2.0 * resistance)
    if flow < 0.0:
        return SHUT * flow - a * speed * speed - 0.5 * b * speed * top, SHUT
    right = max(flow, top)
    head = resistance * right * right - b * speed * right - a * speed * speed + LAMINAR * flow
    return head, 2.0 * resistance * right - b * speed + LAMINAR


@compiled
def clogged(base: float, k_clog: float, severity: float) -> float:
    """Resistance [m/(L/s)^2] of a line with a clogging of ``severity`` 0 (none) to 1 (closed).

    A clogging acts as a valve of resistance ``k_clog`` that is closed by that share: K (1/(1 - s)^2 - 1) is added.
    Check: K = 10 m/(L/s)^2, s = 0.5 adds 30 m/(L/s)^2.
    """
    free = max(1.0 - severity, 1e-6)
    return base + k_clog * (1.0 / (free * free) - 1.0)


@compiled
def throttled(resistance: float, opening: float) -> float:
    """Resistance [m/(L/s)^2] behind a valve that is open by ``opening`` [1]."""
    wide = max(opening, 1e-6)
    return resistance / (wide * wide)


@compiled
def laws(p: Vec, line: Vec, flows: Vec, heads: Vec, slopes: Vec) -> None:
    """Head of every branch at its flow, and its slope; ``line`` as in :func:`solve`."""
    for i in range(FEEDS):
        heads[i], slopes[i] = pipe(line[i], flows[i])
    heads[3], slopes[3] = pump(p[P.pump_a], p[P.pump_b], p[P.pump_c] + p[P.k_suction], line[7], flows[3])
    heads[4], slopes[4] = one_way(line[3], flows[4])
    heads[5], slopes[5] = pump(p[P.pump_a], p[P.pump_b], p[P.pump_c] + p[P.k_bypass], line[8], flows[5])
    heads[6], slopes[6] = pipe(line[4], flows[6])
    heads[7], slopes[7] = one_way(line[5], flows[7])
    heads[8], slopes[8] = one_way(line[6], flows[8])


@compiled
def junctions(g: Vec, e: Vec, feeds: Vec, top: float, leak: float) -> tuple[float, float, float]:
    """Heads of S, M and D [m] for branches q = g (difference of heads) + e; ``feeds``: heads of the tanks [m]."""
    ss, fs = g[3] + g[5], -e[3] - e[5]
    for i in range(FEEDS):
        ss += g[i]
        fs += g[i] * feeds[i] + e[i]
    mm, fm = g[3] + g[4] + g[7], e[3] - e[4] - e[7] + g[7] * leak
    dd, fd = g[4] + g[5] + g[6] + g[8], e[4] + e[5] - e[6] - e[8] + g[6] * top + g[8] * leak
    # Elimination of S, then of M; the off-diagonal entries are -g3 (S M), -g5 (S D), -g4 (M D).
    mm, dd, md = mm - g[3] * g[3] / ss, dd - g[5] * g[5] / ss, g[4] + g[3] * g[5] / ss
    fm, fd = fm + g[3] * fs / ss, fd + g[5] * fs / ss
    head_d = (fd + md * fm / mm) / (dd - md * md / mm)
    head_m = (fm + md * head_d) / mm
    return (fs + g[3] * head_m + g[5] * head_d) / ss, head_m, head_d


@compiled
def hopeless(line: Vec, flows: Vec) -> bool:
    """Whether iterating from ``flows`` cannot arrive in time, because a leak that is not there is thought to flow.

    Where K q^2 is far above every head, the linearised law takes q to q/2: a guess q closes by q / 2^(k + 1) in
    iteration k. Check: 0.05 L/s still changes by 4.7e-11 L/s in the last of 30.
    """
    most = ENOUGH * 2.0 ** (MOST + 1)
    return bool((line[5] > NO_LEAK and flows[7] > most) or (line[6] > NO_LEAK and flows[8] > most))


@compiled
def branch(work: Vec, i: int, place: tuple[float, float, float, float, float], resistance: float) -> None:
    """Write branch ``i`` down for the solver of the blocks: its kind and ends, and its resistance."""
    for k in range(5):
        work[NETWORK + COLUMNS * i + k] = place[k]
    work[NETWORK + COLUMNS * i + 5] = resistance


@compiled
def solve(x: Vec, p: Vec, line: Vec, flows: Vec, work: Vec) -> float:
    """Flows of the nine branches [L/s] from the levels in ``x``; what they are still wrong by [L/s].

    ``line``: resistances of the tank outlets (3), main pipe, line to B204 and leaks at M and D [m/(L/s)^2], speeds of
    P101 and P102 [1]. ``flows`` holds a guess and is replaced. ``work``: :data:`ROOM` numbers.
    """
    heads, slopes, g, e = work[0:9], work[9:18], work[18:27], work[27:36]
    feeds = work[36:39]
    for i in range(FEEDS):
        feeds[i] = x[S.V1 + i] / p[P.area]
    top, leak = p[P.floor_B204] + x[S.V4] / p[P.area], p[P.floor_leak]
    for _ in range(0 if hopeless(line, flows) else MOST):
        laws(p, line, flows, heads, slopes)
        for j in range(BRANCHES):
            g[j] = 1.0 / slopes[j]
            e[j] = flows[j] - heads[j] * g[j]
        hs, hm, hd = junctions(g, e, feeds, top, leak)
        x[S.head_suction], x[S.head_main], x[S.head_discharge] = hs, hm, hd
        change = 0.0
        for j in range(BRANCHES):
            up = feeds[j] if j < FEEDS else (hs if j == 3 or j == 5 else (hm if j == 4 or j == 7 else hd))
            down = hs if j < FEEDS else (hm if j == 3 else (hd if j == 4 or j == 5 else (top if j == 6 else leak)))
            step = g[j] * (up - down) + e[j] - flows[j]
            flows[j] += step
            change = max(change, abs(step))
        if change <= ENOUGH:
            return change
    for i in range(FEEDS):
        branch(work, i, (PIPE, -1.0, 0.0, feeds[i], 0.0), line[i])
    branch(work, 3, (PUMP, 0.0, 1.0, 0.0, 0.0), p[P.pump_c] + p[P.k_suction])
    branch(work, 4, (ONE_WAY, 1.0, 2.0, 0.0, 0.0), line[3])
    branch(work, 5, (PUMP, 0.0, 2.0, 0.0, 0.0), p[P.pump_c] + p[P.k_bypass])
    branch(work, 6, (PIPE, 2.0, -1.0, 0.0, top), line[4])
    branch(work, 7, (ONE_WAY, 1.0, -1.0, 0.0, leak), line[5])
    branch(work, 8, (ONE_WAY, 2.0, -1.0, 0.0, leak), line[6])
    for k in range(2):
        at = NETWORK + COLUMNS * (3 + 2 * k) + 6
        work[at], work[at + 1], work[at + 2] = p[P.pump_a], p[P.pump_b], line[7 + k]
    left = solve_network(work, NETWORK, JUNCTIONS, BRANCHES)
    found = NETWORK + COLUMNS * BRANCHES
    x[S.head_suction], x[S.head_main], x[S.head_discharge] = work[found], work[found + 1], work[found + 2]
    for j in range(BRANCHES):
        flows[j] = work[found + JUNCTIONS + j]
    return left
