"""Loops that are too fast for the tick: within one of them they answer more than the whole deviation, and ring.

A controller acts once per tick. What its gains make of a deviation, times what the plant makes of that within a tick,
is the share of it that is answered before it is seen again: at 1 it is gone in a tick, at 2 it never goes away.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from homeostat.domain.plant.description import ControlLoop, Relation
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.deep.following import batch_of
from homeostat.evaluate.lint.deep.resting import by_hand
from homeostat.evaluate.lint.finding import Finding, Place, Severity
from homeostat.plants.files.folder import SETTINGS
from homeostat.process.batch import simulate
from homeostat.twin.history import Window

ANSWERED: Final = 1.2
"""Share of a deviation that a loop may answer within one tick [1]. Of the plants that ship it is up to 1.1."""
FAR: Final = 10.0
"""Share from which on no shorter tick is the remedy [1]."""
NUDGE: Final = 0.01
"""Share of its range by which a command is moved to see what comes of it [1]."""


def ticked(bench: Bench) -> Iterator[Finding]:
    """One warning of every loop that the tick is too long for; the most hurried one first."""
    if bench.quiet.broke or not bench.quiet.seen:
        return
    d, found = bench.plant.description, list[tuple[float, ControlLoop]]()
    for loop in d.loops:
        share = 0.0 if by_hand(bench, loop) else answered(bench, loop)
        if share > ANSWERED:
            found.append((share, loop))
    if not found:
        return
    found.sort(key=lambda each: -each[0])
    worst, tick_s = found[0][0], d.timing.tick_s
    rows = [
        f"{loop.name!r} ({bench.places.row('parameters', symbol=loop.gain)}, {share:.2g} times)"
        for share, loop in found
    ]
    what = (
        f"a tick of {tick_s:g} s is long for what loops make of a deviation: within one they answer more than the "
        f"whole of it, {', '.join(rows)}, so that they ring and overshoot from tick to tick"
    )
    remedy = f"give [time] a tick_s of at most {0.2 * tick_s / worst:.2g}, or lower the gains that it names"
    if worst > FAR:
        remedy = "lower the gains that it names, or correct what the plant makes of them (parameters.csv)"
    yield Finding(Severity.WARNING, "causes", Place(SETTINGS, None, "time, tick_s"), what, remedy)


def answered(bench: Bench, loop: ControlLoop) -> float:
    """Share of a small deviation that a loop answers within one tick at the end of the fault-free course [1].

    0 of the outer one of a cascade: it acts through the inner one.
    """
    d, model = bench.plant.description, bench.plant.model
    values = {p.symbol: p.value for p in d.parameters}
    driven = next(s.component for s in d.signals if s.tag.name == loop.manipulated_variable)
    manual = next((s for s in d.signals if s.relation is Relation.OVERRIDES and s.component == driven), None)
    if manual is None or manual.variable not in model.inputs:
        return 0.0
    state, inputs = bench.quiet.end
    column, span = model.inputs.index(manual.variable), manual.tag.range.span
    stands = model.readings(state, inputs)[d.variables[loop.manipulated_variable]]
    if not np.isfinite(stands):
        return 0.0
    step = NUDGE * span * (-1.0 if stands + NUDGE * span > manual.tag.range.high else 1.0)
    shown = [
        _shown(bench, state, inputs, column, stands + by)[d.variables[loop.process_variable]] for by in (0.0, step)
    ]
    gain = abs(values.get(loop.gain, 0.0)) + abs(values.get(loop.reset, 0.0)) * d.timing.tick_s
    return abs(shown[1] - shown[0]) / abs(step) * gain


def _shown(bench: Bench, state: np.ndarray, inputs: np.ndarray, column: int, value: float) -> dict[str, float]:
    """Readings after a tick with one command at ``value``."""
    given = inputs.copy()
    given[column] = value
    at_s = float(bench.quiet.truth.times_s[-1])
    after = simulate(bench.plant.model.kernel, batch_of(bench, Window(at_s, {}, given[None]), state, at_s)).state[0]
    return dict(bench.plant.model.readings(after, given))
