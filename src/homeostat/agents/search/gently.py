"""Gently: the way back to ordinary operation, as fast as controlled variables stay near their setpoints.

What ordinary operation is commanded is fixed; what is chosen is how long the setpoints take to come there. What was
repaired moves the plant by itself: that is waited for, so that both do not come together, but not for ever: a twin that
says that the plant comes to rest soon may be wrong each time that it says so.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from homeostat.agents.roles import Situation
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.process.types import Cube, Table, Vec

RAMPS_S = (0.0, 60.0, 180.0, 420.0, 700.0, 1000.0, 1500.0)
"""How long setpoints may take; 0 for as fast as their tags may change [s]."""
FAR = 0.5
"""How far from its setpoint a controlled variable is no more near it, in scales [1]: the twin is off by as much."""
SAME = 0.1
"""Excess that is as good as none, in scales [1]."""
LEAVES = 2.0
"""How much further what is near its setpoint now may be off in the end, where it does not go on, in scales [1]."""
SOON_S = 600.0
"""What settles by itself within this time is waited for [s]: longer, the plant would be kept from producing."""


class Rest:
    """How long it has been waited for that the plant comes to rest."""

    def __init__(self) -> None:
        """Nothing has been waited for."""
        self._began_s = self._last_s = -math.inf

    def awaited(self, now_s: float, most_s: float) -> bool:
        """Whether it may be waited any more at ``now_s``: for ``most_s`` in all, after as long a pause anew [s]."""
        if now_s - self._last_s > most_s:
            self._began_s = now_s
        self._last_s = now_s
        return now_s - self._began_s <= most_s


def leads_back(plant: PlantDescription, situation: Situation, path: RecoveryPath) -> bool:
    """Whether ``path`` is that of a plant in which nothing is wrong any more, and no step of it is awaited."""
    ordinary = plant.machine.ordinary
    healthy = not situation.diagnosis.faulty
    return healthy and situation.state not in ordinary and path.target in ordinary and not path.awaited


def ramped(
    actions: ActionSet, values: Mapping[str, float], seconds: float, tags: Collection[str] | None = None
) -> ActionSet:
    """``actions`` whose setpoints take ``seconds`` from their present ``values``, or longer where they must [s].

    ``tags``: those that do, all of them where None.
    """
    return replace(
        actions,
        commands=tuple(
            _ramped(c, values.get(c.tag), seconds) if tags is None or c.tag in tags else c for c in actions.commands
        ),
    )


def _ramped(command: Command, present: float | None, seconds: float) -> Command:
    if command.value is None or command.rate is None or present is None or not seconds:
        return command
    way = abs(command.value - present)
    return replace(command, rate=min(way / seconds, command.rate)) if way > 0.0 else command


def excess(plant: PlantDescription, signals: Mapping[str, Cube], count: int) -> Vec:
    """By how much controlled variables are further than :data:`FAR` from their setpoints, summed over the loops.

    ``signals``: tag -> values, shape (count * members, times). Mean over members at their worst times, in scales, shape
    (count,).
    """
    return np.asarray(by_loop(plant, signals, count).sum(axis=0))


def by_loop(plant: PlantDescription, signals: Mapping[str, Cube], count: int) -> Table:
    """The same as :func:`excess` of each loop, shape (loops, count)."""
    found = np.zeros((len(plant.loops), count))
    for k, loop in enumerate(plant.loops):
        scale = plant.tag(loop.process_variable).scale
        off = np.abs(signals[loop.process_variable] - signals[loop.setpoint]) / scale
        found[k] = np.fmax(off - FAR, 0.0).max(axis=1).reshape(count, -1).mean(axis=1)
    return found


def gentlest(ways: Sequence[ActionSet], excesses: Vec, admitted: Sequence[bool]) -> ActionSet:
    """The first of ``ways``, the fastest first, that is ``admitted`` and as good as the best; else the fastest."""
    open_ways = [(way, off) for way, off, fine in zip(ways, excesses.tolist(), admitted, strict=True) if fine]
    if not open_ways:
        return ways[0]
    least = min(off for _, off in open_ways)
    return next(way for way, off in open_ways if off <= least + SAME)


def settles(plant: PlantDescription, signals: Mapping[str, Cube], rows: int) -> bool:
    """Whether a plant that is left alone leaves its setpoints, and is near them from so many ``rows`` on.

    What is near its setpoint now may end a little off it: an actuator that is left by hand does not hold it.
    ``signals``: tag -> values, shape (members, times).
    """
    read = [signals[tag] for loop in plant.loops for tag in (loop.process_variable, loop.setpoint)]
    if not all(np.isfinite(values).all() for values in read):
        return False
    if not 0 < rows < min(values.shape[1] for values in signals.values()):
        return False

    def off(first: int | None, last: int | None) -> Vec:
        return np.asarray(by_loop(plant, {tag: v[:, first:last] for tag, v in signals.items()}, 1)[:, 0])

    now, early, late, end = off(0, 1), off(0, rows), off(rows, None), off(-1, None)
    rests, drifts = late <= SAME, (now <= SAME) & (late <= LEAVES) & (end <= off(rows, rows + 1) + SAME)
    return bool(((early > SAME) & rests).any() and (rests | drifts).all())
