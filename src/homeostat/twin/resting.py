"""Actuators at rest that nobody has seen move: a relief that never opened, a standby valve, a drain.

One that is stuck there shows nothing, so that no diagnosis names it, and its twin moves as it should.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from homeostat.domain.plant.description import PlantDescription, Relation

SEEN: Final = 0.05
"""Share of its range that an actuator has to have moved by for anybody to know that it moves [1]."""
LEFT: Final = 0.01
"""Share of its range by which a command leaves its rest [1]."""


@dataclass(frozen=True, slots=True)
class Resting:
    """One actuator that stands at an end of its range, as it has in everything that was read."""

    actuator: str
    """Name of the component."""
    manual: str
    """Tag by which it is commanded by hand."""
    command: str
    """Tag of its command."""
    rest: float
    """Where it stands, in the command's unit."""
    leaves: float
    """What its command is off by once it leaves its rest, in the command's unit."""


def resting(plant: PlantDescription, reached: Mapping[str, tuple[float, float]]) -> tuple[Resting, ...]:
    """Those of ``plant`` that a command by hand can hold; ``reached``: variable -> lowest and highest ever read.

    Both its command and, where that is measured, its position have to have moved: an outlier of one is no movement.
    """
    found, positions, variables = [], plant.positions, plant.variables
    driven = {s.tag.name: s.component for s in plant.signals if s.relation is Relation.DRIVES}
    for manual, command in plant.overridden.items():
        shown = [plant.tag(name) for name in (command, positions.get(driven[command], command))]
        own = shown[0].range
        for tag in shown:
            low, high = reached.get(variables[tag.name], (math.nan, math.nan))
            rests = [end for end in (own.low, own.high) if max(abs(low - end), abs(high - end)) <= SEEN * own.span]
            if rests and tag.unit == shown[0].unit:
                found.append(Resting(driven[command], manual, command, rests[0], LEFT * own.span))
                break
    return tuple(found)
