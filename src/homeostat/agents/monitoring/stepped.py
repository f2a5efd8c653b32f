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
        """Nothing has stepped yet; only what the tables say of how fast a reading may move can step."""
        measured: dict[str, set[str]] = {}
        for signal in plant.signals:
            if signal.relation is Relation.MEASURES and signal.tag.name in plant.qualities:
                measured.setdefault(signal.component, set()).add(signal.tag.name)
        self._tags = {mode.name: frozenset(measured.get(mode.component, ())) for mode in plant.fault_modes}
        self._rules = {tag: plant.qualities[tag] for tags in measured.values() for tag in tags}
        self._wait_s = READINGS * plant.timing.tick_s
        self._before: dict[str, tuple[float, float]] = {}
        self._began_s: dict[str, float] = {}

    def take(self, snapshot: Snapshot, known: Iterable[FaultState]) -> float | None:
        """Until when is waited where an instrument of what is ``known`` steps in this ``snapshot`` [s]; else None."""
        stepped = frozenset(tag for tag in self._rules if self._steps(tag, snapshot))
        of_known = frozenset[str]().union(*(self._tags.get(f.fault, frozenset()) for f in known))
        now_s, long_s = snapshot.at_s, AGAIN * self._wait_s
        new = [tag for tag in stepped & of_known if now_s >= self._began_s.get(tag, -math.inf) + long_s]
        self._began_s.update(dict.fromkeys(new, now_s))
        return now_s + self._wait_s if new else None

    def waiting(self, at_s: float) -> frozenset[str]:
        """Tags of which what was read up to ``at_s`` does not say yet what they are [s]."""
        return frozenset(tag for tag, began_s in self._began_s.items() if at_s < began_s + self._wait_s)

    def _steps(self, tag: str, snapshot: Snapshot) -> bool:
        """Whether ``tag`` reads otherwise than before by more than its process can move."""
        taken_s, value = snapshot.taken_s.get(tag, snapshot.at_s), snapshot.values.get(tag, math.nan)
        if not math.isfinite(value) or tag in snapshot.bad:
            return False
        before_s, before = self._before.get(tag, (taken_s, value))
        if taken_s < before_s:
            return False
        self._before[tag] = taken_s, value
        return abs(value - before) > self._rules[tag].most_change(taken_s - before_s)
