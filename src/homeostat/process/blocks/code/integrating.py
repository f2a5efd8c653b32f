"""Lines of a kernel that integrate: a step of ``h`` [s] by Runge-Kutta 4, or a tick in stages for fast motions.

States that are many stand in the kernel's room and not in variables; they are the first columns there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from homeostat.process.blocks.stabilised import Stage


def runge_kutta(ys: Sequence[str], given: Sequence[str]) -> Iterator[str]:
    """A step of ``h`` of the states ``ys``, each in a variable of its own; ``given``: what is held."""
    held = ", ".join(given)
    for k, (before, share) in {"a": ("", ""), "b": ("a", "0.5 * h"), "c": ("b", "0.5 * h"), "d": ("c", "h")}.items():
        at = [y if not before else f"{y} + {share} * {before}{i}" for i, y in enumerate(ys)]
        made = ", ".join(f"{k}{i}" for i in range(len(ys)))
        yield f"{made}, = slopes({', '.join(at)}{', ' + held if held else ''})"
    for i, y in enumerate(ys):
        yield f"{y} += h / 6.0 * (a{i} + 2.0 * b{i} + 2.0 * c{i} + d{i})"


def runge_kutta_in_place(count: int, at: int, given: Sequence[str]) -> Iterator[str]:
    """A step of ``count`` states, which are the first columns, with room from ``at`` on for three numbers of each."""
    held = "".join(f", {each}" for each in given)
    yield f"for j in range({count}):"
    yield f"    work[{at + count} + j], work[{at + 2 * count} + j] = 0.0, 0.0"
    yield "for stage in range(4):"
    yield "    share = 0.0 if stage == 0 else h if stage == 3 else 0.5 * h"
    yield "    times = 2.0 if stage == 1 or stage == 2 else 1.0"
    yield f"    for j in range({count}):"
    yield f"        work[{at} + j] = xm[j] + share * work[{at + count} + j]"
    yield f"    slopes(work{held})"
    yield f"    for j in range({count}):"
    yield f"        work[{at + 2 * count} + j] += times * work[{at + count} + j]"
    yield f"for j in range({count}):"
    yield f"    xm[j] += h / 6.0 * work[{at + 2 * count} + j]"


def stabilised_in_place(count: int, at: int, given: Sequence[str], stages: Sequence[Stage]) -> Iterator[str]:
    """All ``stages`` of a tick, with room for four numbers of each state: Y, its rate, the Y before, the first rate.

    See :mod:`homeostat.process.blocks.stabilised`. The rates stand once: what is called twice is compiled twice.
    """
    held = "".join(f", {each}" for each in given)
    here, rate, before, first = (f"work[{at + k * count} + j]" for k in range(4))
    rows = tuple(tuple(stage) for stage in stages)
    yield f"for j in range({count}):"
    yield f"    {here} = xm[j]"
    yield f"for fresh, of_here, of_before, of_rate, of_first in {rows!r}:"
    yield f"    slopes(work{held})"
    yield f"    for j in range({count}):"
    yield "        if fresh > 0.0:"
    yield f"            xm[j], {before}, {first} = {here}, 0.0, {rate}"
    yield f"        next_y = (1.0 - of_here - of_before) * xm[j] + of_here * {here} + of_before * {before}"
    yield f"        {before} = {here}"
    yield f"        {here} = next_y + of_rate * {rate} + of_first * {first}"
    yield f"for j in range({count}):"
    yield f"    xm[j] = {here}"
