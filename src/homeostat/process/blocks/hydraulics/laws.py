"""What flows through a branch of a network at a difference of heads, and how that grows (compiled).

Resistances K in m/(L/s)^2 for turbulent flow, R in m/(L/s) for the laminar flow that is left near zero; flows in L/s,
heads in m of the liquid. Each law is inverted in closed form, and what flows grows with the difference of heads.

Hand check: K = 92.8 m/(L/s)^2 and 1.57 m give 0.130 L/s without the laminar part.
"""

import math
from typing import TypeAlias

from homeostat.process.compiled import compiled

Pair: TypeAlias = tuple[float, float]
LAMINAR = 0.02
"""Linear resistance of every branch [m/(L/s)]."""
SHUT = 1e7
"""Linear resistance of a non-return valve against its direction [m/(L/s)]."""


@compiled
def through_pipe(resistance: float, head: float) -> Pair:
    """Flow [L/s] that ``head`` [m] drives through K q|q| + R q, and its slope [L/s per m]."""
    root = math.sqrt(LAMINAR * LAMINAR + 4.0 * resistance * abs(head))
    return 2.0 * head / (LAMINAR + root), 1.0 / root


@compiled
def through_check_valve(resistance: float, head: float) -> Pair:
    """The same behind a non-return valve, which against its direction is the linear resistance :data:`SHUT`."""
    if head < 0.0:
        return head / SHUT, 1.0 / SHUT
    return through_pipe(resistance, head)


@compiled
def through_pump(a: float, b: float, resistance: float, speed: float, head: float) -> Pair:
    """The same through a pump and its non-return valve; ``head`` is what drives beside the pump, mostly negative.

    The pump gives a n^2 + b n q - c q^2 at the speed n from 0 to 1 (affinity laws); ``resistance``: c and that of its
    pipe. Left of the top of its curve the head stays what it is at the top, so that every head belongs to one flow.
    """
    top = b * speed / (2.0 * resistance)
    above = head + a * speed * speed + 0.5 * b * speed * top
    if above < 0.0:
        return above / SHUT, 1.0 / SHUT
    if above <= top * LAMINAR:
        return above / LAMINAR, 1.0 / LAMINAR
    linear = b * speed - LAMINAR
    root = math.sqrt(linear * linear + 4.0 * resistance * (a * speed * speed + head))
    return (linear + root) / (2.0 * resistance), 1.0 / root
