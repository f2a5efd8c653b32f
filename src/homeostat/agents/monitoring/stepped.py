"""Stepped: an instrument that is known to be wrong reads otherwise at once; what it reads next says if it was mended.

No process moves so fast: a step is the instrument's own, which was mended or is wrong by something else. On its
first readings the old error still explains all that was read for minutes, and would be taken off a reading that is
right: a level transmitter that had read 2.8 L low was mended, and its vessel was held to run over.
"""

import math
from collections.abc import Iterable

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.snapshot import Snapshot

READINGS = 11
"""So many readings of it say whether anything is still wrong: the step's own, and a stretch by itself."""
AGAIN = 10
"""One that steps again and again is waited for once in so many times as long."""


class Stepped:
    """Says how long nothing new is concluded from an instrument that has stepped."""

    def __init__(self, plant: PlantDescription) -> None:
        """Nothing has stepped yet."""
        measured: dict[str, set[str]] = {}
        for signal in plant.signals:
            if signal.relation is Relation.MEASURES and signal.tag.name in plant.qualities:
                measured.setdefault(signal.component, set()).add(signal.tag.name)
        self._tags = {mode.name: frozenset(measured.get(mode.component, ())) for mode in plant.fault_modes}
        self._rules = {tag: plant.qualities[tag] for tags in measured.values() for tag in tags}
        self._wait_s = READINGS * plant.timing.tick_s
        self._before: dict[str, tuple[float, float]] = {}
        self._began_s = -math.inf

    def take(self, snapshot: Snapshot, known: Iterable[FaultState]) -> float | None:
        """Until when is waited where an instrument of what is ``known`` steps in this ``snapshot`` [s]; else None."""
        stepped = frozenset(tag for tag in self._rules if self._steps(tag, snapshot))
        of_known = frozenset[str]().union(*(self._tags.get(f.fault, frozenset()) for f in known))
        if not stepped & of_known or snapshot.at_s < self._began_s + AGAIN * self._wait_s:
            return None
        self._began_s = snapshot.at_s
        return self._began_s + self._wait_s

    def waits(self, at_s: float) -> bool:
        """Whether what was read up to ``at_s`` does not say yet what it is [s]."""
        return at_s < self._began_s + self._wait_s

    def _steps(self, tag: str, snapshot: Snapshot) -> bool:
        """Whether ``tag`` reads otherwise than before by more than its process can move."""
        at_s, value = snapshot.at_s, snapshot.values.get(tag, math.nan)
        if not math.isfinite(value) or tag in snapshot.bad:
            return False
        before_s, before = self._before.get(tag, (at_s, value))
        self._before[tag] = at_s, value
        return abs(value - before) > self._rules[tag].most_change(at_s - before_s)
