"""A reference policy: the cheapest constant commands of any state that may be recovered to, on the true plant."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.evaluate.reference.best_constant import BestConstant, Grid, best_constant
from homeostat.evaluate.scenario import Scenario
from homeostat.plants.plant import Plant

LEVELS = 7
"""Values of each open setpoint that are tried at first."""
FINER = (5, 5, 5)
"""Values that are tried between the neighbours of the best one, again and again."""


def best_answer(
    plant: Plant, scenario: Scenario, at_s: float, levels: int = LEVELS, finer: Sequence[int] = FINER
) -> BestConstant:
    """The cheapest admissible commands from ``at_s`` on [s], of every state that is a recovery target.

    A state's commands are those that it has by design, and ``levels`` values of each that is open in it; then ``finer``
    ones near the best. What is counted are the points of the first search: where none of these is admissible, nothing
    that a release may command and then leave as it is keeps the plant within its limits, as far as a grid can tell.
    """
    found = [(best_constant(plant, scenario, at_s, grid), grid) for grid in grids(plant, levels)]
    best, grid = min(found, key=lambda each: _cost(each[0]))
    tried = sum(each.admissible for each, _ in found), sum(each.points for each, _ in found)
    for count in finer:
        if best.setpoints is None:
            break
        grid = {tag: _between(values, best.setpoints[tag], count) for tag, values in grid.items()}
        best = min(best, best_constant(plant, scenario, at_s, grid), key=_cost)
    return replace(best, admissible=tried[0], points=tried[1])


def grids(plant: Plant, levels: int) -> list[Grid]:
    """What each recovery target lets be commanded; a target of which another one lets all is not tried."""
    targets = [state for state in plant.description.machine.states if state.recovery_target]
    kept: list[State] = []
    for state in targets:
        if not any(_lets_all(other, state) for other in kept):
            kept = [*(other for other in kept if not _lets_all(state, other)), state]
    return [{r.tag: _values(r, levels) for r in state.setpoints} for state in kept]


def _lets_all(other: State, state: State) -> bool:
    """Whether ``other`` lets everything be commanded that ``state`` lets."""
    theirs = {r.tag: r for r in other.setpoints}
    mine = {r.tag: r for r in state.setpoints}
    return mine.keys() == theirs.keys() and all(_within(each, theirs[tag]) for tag, each in mine.items())


def _within(mine: SetpointRange, theirs: SetpointRange) -> bool:
    if mine.design is None and theirs.design is not None:
        return False  # one is on automatic by design, the other never is
    mine_low, mine_high, low, high = *_span(mine), *_span(theirs)
    return math.isnan(mine_low) or low <= mine_low <= mine_high <= high


def _span(of: SetpointRange) -> tuple[float, float]:
    """Lowest and highest value; NaN where it is on automatic and nothing else."""
    if of.high > of.low:
        return of.low, of.high
    return (math.nan, math.nan) if of.design is None else (of.design, of.design)


def _values(of: SetpointRange, count: int) -> tuple[float | None, ...]:
    return _levels(of.low, of.high, count, of.design) if of.high > of.low else (of.design,)


def _levels(low: float, high: float, count: int, design: float | None) -> tuple[float | None, ...]:
    """``count`` values from ``low`` to ``high``, and ``design``; automatic first where that is the design."""
    values = {*np.linspace(low, high, count).tolist()}
    return (None, *sorted(values)) if design is None else tuple(sorted({*values, design}))


def _between(values: Sequence[float | None], best: float | None, count: int) -> tuple[float | None, ...]:
    """``count`` values between the neighbours of ``best`` in ``values``, and itself; automatic stays what it is."""
    if best is None:
        return (None,)
    ordered = sorted(v for v in values if v is not None)
    at = ordered.index(best)
    low, high = ordered[max(at - 1, 0)], ordered[min(at + 1, len(ordered) - 1)]
    return (best,) if low == high else _levels(low, high, count, best)


def _cost(found: BestConstant) -> float:
    return math.inf if found.setpoints is None else found.cost
