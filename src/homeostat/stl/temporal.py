"""Always, eventually and until over sampled signals.

Traces end: a window is clipped to the samples there are, `always` over an empty window is +inf, and `eventually` or
`until` over an empty window is -inf. Only the samples that the asked-for result depends on are computed.
"""

import math
from collections.abc import Callable

from homeostat.stl.signals import View
from homeostat.stl.sliding_extrema import HIGHEST, LOWEST, Decided, better, constant, over_windows, padded
from homeostat.stl.text import render
from homeostat.stl.tree import Always, Eventually, FormulaError, Until

Margins = Callable[[View], Decided]
"""Margins of an operand at the samples of a view."""


def window(node: Always | Eventually, operand: Margins) -> Margins:
    """The worst (``always``) or best (``eventually``) margin of ``operand`` in the window of each sample."""
    extreme = LOWEST if isinstance(node, Always) else HIGHEST

    def margins(view: View) -> Decided:
        low, high = _steps(node, view)
        first, last = view.start + low, min(view.stop - 1 + high, view.signals.samples - 1)
        if first > last:
            return constant(extreme.empty, view.width, view.timed)
        return over_windows(extreme, operand(view.moved(first, last + 1)), high - low + 1, view.width)

    return margins


def until(node: Until, condition: Margins, goal: Margins) -> Margins:
    """Per sample the best goal of the window, held back by the worst condition from the sample to just before it."""

    def margins(view: View) -> Decided:
        low, high = _steps(node, view)
        high = min(high, view.signals.samples - 1 - view.start)
        if low > high:
            return constant(HIGHEST.empty, view.width, view.timed)
        ahead = view.moved(view.start, min(view.stop + high, view.signals.samples))
        held = padded(LOWEST, condition(ahead), view.width + high)
        reached = padded(HIGHEST, goal(ahead), view.width + high)
        return _best_goal(held, reached, low, high, view.width)

    return margins


def _best_goal(held: Decided, reached: Decided, low: int, high: int, width: int) -> Decided:
    best = worst = None
    for ahead in range(high + 1):
        if ahead:
            before = held.cut(ahead - 1, ahead - 1 + width)
            worst = before if worst is None else better(LOWEST, worst, before)
        if ahead >= low:
            here = reached.cut(ahead, ahead + width)
            here = here if worst is None else better(LOWEST, worst, here)
            best = here if best is None else better(HIGHEST, best, here)
    assert best is not None  # low <= high, so the window has at least one sample
    return best


def _steps(node: Always | Eventually | Until, view: View) -> tuple[int, int]:
    """The bounds in samples, no further than the trace is long."""
    return _step(node, node.low_s, view), _step(node, node.high_s, view)


def _step(node: Always | Eventually | Until, bound_s: float, view: View) -> int:
    samples, dt_s = view.signals.samples, view.signals.dt_s
    steps = bound_s / dt_s
    if math.isinf(steps):
        return samples
    if abs(round(steps) * dt_s - bound_s) > 1e-9 * max(bound_s, dt_s):
        raise FormulaError(f"bound {bound_s:g} s of {render(node)!r} is no multiple of the sampling period {dt_s:g} s")
    return min(round(steps), samples)
