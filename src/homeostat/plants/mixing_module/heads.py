"""The same network, heads first: slower, and certain to arrive (compiled).

Where several non-return valves begin to pass at the same moment, linearised laws may throw the flows from one side to
the other for ever. Here the heads of the junctions are the unknowns; each law is inverted in closed form, so that what
flows grows with the difference of heads. The surplus of every junction is then the slope of a concave function of the
three heads, which Newton's method with a search along each step climbs from anywhere.
"""

import math
from typing import TypeAlias

from homeostat.process.compiled import compiled
from homeostat.process.types import Vec

Pair: TypeAlias = tuple[float, float]
Heads: TypeAlias = tuple[float, float, float]
Curve: TypeAlias = tuple[float, float, float, float]
STEPS = 200
"""Most Newton steps."""
HALVINGS = 60
"""Most tries along one step."""


@compiled
def through_pipe(resistance: float, laminar: float, head: float) -> Pair:
    """Flow [L/s] that ``head`` [m] drives through K q|q| + R q, and its slope [L/s per m]."""
    root = math.sqrt(laminar * laminar + 4.0 * resistance * abs(head))
    return 2.0 * head / (laminar + root), 1.0 / root


@compiled
def through_valve(resistance: float, laminar: float, shut: float, head: float) -> Pair:
    """The same behind a non-return valve, which against its direction is the linear resistance ``shut``."""
    if head < 0.0:
        return head / shut, 1.0 / shut
    return through_pipe(resistance, laminar, head)


@compiled
def through_pump(a: float, b: float, resistance: float, speed: float, laminar: float, shut: float, head: float) -> Pair:
    """The same through a pump and its non-return valve; ``head`` is what drives beside the pump, mostly negative."""
    top = b * speed / (2.0 * resistance)
    above = head + a * speed * speed + 0.5 * b * speed * top
    if above < 0.0:
        return above / shut, 1.0 / shut
    if above <= top * laminar:
        return above / laminar, 1.0 / laminar
    linear = b * speed - laminar
    root = math.sqrt(linear * linear + 4.0 * resistance * (a * speed * speed + head))
    return (linear + root) / (2.0 * resistance), 1.0 / root


@compiled
def branches(
    curve: Curve, fixed: Pair, limits: Pair, line: Vec, ends: Vec, heads: Heads, flows: Vec, slopes: Vec
) -> Heads:
    """Flows of the nine branches at ``heads`` of S, M and D; the surplus of each junction [L/s].

    ``curve``: a and b of the pumps, resistance of P101 and of P102 with their pipes; ``fixed``: head of B204's liquid
    and height of the leaks [m]; ``limits``: laminar and shut resistance; ``ends``: heads of the feed tanks [m].
    """
    hs, hm, hd = heads
    laminar, shut = limits
    for i in range(3):
        flows[i], slopes[i] = through_pipe(line[i], laminar, ends[i] - hs)
    flows[3], slopes[3] = through_pump(curve[0], curve[1], curve[2], line[7], laminar, shut, hs - hm)
    flows[4], slopes[4] = through_valve(line[3], laminar, shut, hm - hd)
    flows[5], slopes[5] = through_pump(curve[0], curve[1], curve[3], line[8], laminar, shut, hs - hd)
    flows[6], slopes[6] = through_pipe(line[4], laminar, hd - fixed[0])
    flows[7], slopes[7] = through_valve(line[5], laminar, shut, hm - fixed[1])
    flows[8], slopes[8] = through_valve(line[6], laminar, shut, hd - fixed[1])
    return (
        flows[0] + flows[1] + flows[2] - flows[3] - flows[5],
        flows[3] - flows[4] - flows[7],
        flows[4] + flows[5] - flows[6] - flows[8],
    )


@compiled
def newton_step(g: Vec, surplus: Heads) -> Heads:
    """Change of the heads that closes linearised balances; the matrix is symmetric and diagonally dominant."""
    ss, mm, dd = g[0] + g[1] + g[2] + g[3] + g[5], g[3] + g[4] + g[7], g[4] + g[5] + g[6] + g[8]
    m2, d2, md = mm - g[3] * g[3] / ss, dd - g[5] * g[5] / ss, g[4] + g[3] * g[5] / ss
    fm, fd = surplus[1] + g[3] * surplus[0] / ss, surplus[2] + g[5] * surplus[0] / ss
    step_d = (fd + md * fm / m2) / (d2 - md * md / m2)
    step_m = (fm + md * step_d) / m2
    return (surplus[0] + g[3] * step_m + g[5] * step_d) / ss, step_m, step_d


@compiled
def solve_heads(curve: Curve, fixed: Pair, limits: Pair, line: Vec, ends: Vec, flows: Vec, slopes: Vec) -> Heads:
    """Heads of S, M and D [m] at which everything balances; writes the flows. Arguments as for :func:`branches`."""
    start = max(ends[0], ends[1], ends[2])
    heads = (start, start, start)
    left = branches(curve, fixed, limits, line, ends, heads, flows, slopes)
    for _ in range(STEPS):
        step = newton_step(slopes, left)
        low, share, high = 0.0, 1.0, 1.0
        tried = heads
        for _ in range(HALVINGS):
            tried = (heads[0] + share * step[0], heads[1] + share * step[1], heads[2] + share * step[2])
            left = branches(curve, fixed, limits, line, ends, tried, flows, slopes)
            uphill = left[0] * step[0] + left[1] * step[1] + left[2] * step[2] >= 0.0
            if (uphill and share == 1.0) or high - low < 1e-3 * low:
                break
            if uphill:
                low = share
            else:
                high = share
            share = 0.5 * (low + high)
        heads = tried
        if (
            max(abs(step[0]), abs(step[1]), abs(step[2])) < 1e-13
            or max(abs(left[0]), abs(left[1]), abs(left[2])) < 1e-15
        ):
            break
    return heads
