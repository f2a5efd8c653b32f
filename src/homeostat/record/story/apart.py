"""Apart: what somebody at the plant would look at where an answer is a set of items."""

from __future__ import annotations

import math
from collections.abc import Iterable

from homeostat.domain.diagnosis import SOMETHING_ELSE, FaultProbability
from homeostat.domain.plant.description import PlantDescription, Relation

NATS: float = 3.0
"""What lies within this of the likeliest belongs to the answer: one in twenty [nats]."""


def told_apart(held: Iterable[FaultProbability], plant: PlantDescription) -> str:
    """What would tell the items of ``held`` apart, one look for each; empty where the answer is one item or none."""
    components = {mode.name: mode.component for mode in plant.fault_modes if mode.name != SOMETHING_ELSE}
    every = [b for b in held if b.faults and all(f.fault in components for f in b.faults)]
    least = max((b.probability for b in every), default=1.0) * math.exp(-NATS)
    accused = [tuple(components[f.fault] for f in b.faults) for b in every if b.probability >= least]
    if len({frozenset(items) for items in accused}) < 2:
        return ""
    shared = frozenset.intersection(*map(frozenset, accused))
    looks = dict.fromkeys(_look(item, plant) for items in accused for item in items if item not in shared)
    return ", ".join(looks)


def _look(item: str, plant: PlantDescription) -> str:
    """How somebody sees whether ``item`` is wrong: an instrument by another reading, an actuator where it stands."""
    signals = [s for s in plant.signals if s.component == item]
    shown = next((s.tag.name for s in signals if s.relation is Relation.MEASURES), "")
    if shown:
        return f"a second reading of {shown}"
    return f"where {item} stands" if any(s.relation is Relation.DRIVES for s in signals) else f"a look at {item}"
