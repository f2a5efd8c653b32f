"""Still: instruments that have noise and repeat themselves for longer than the tables let them.

No feature need show that: a level that is held by a stuck reading stands still on paper while its vessel runs over.
What repeats itself is asked about by itself, as soon as its rule says so, and it is over once it moves again.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from homeostat.domain.diagnosis import EffectKind, Symptom
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.snapshot import Snapshot

FEWEST = 4
"""No gap between two readings counts for more than such a share of the time: so many repeat themselves at least."""
MOVING = 8
"""So many readings that are others than the one before say that an instrument moves again."""
AGAIN = 10
"""One that stands still again before it has moved for so many times as long is believed after twice as many."""
LATER = 1.2
"""Where readings do not show yet that one is stuck, it is asked again after so many times as long."""
MOST = 5
"""How often that is doubled at most."""


@dataclass(slots=True)
class _Seen:
    """What is remembered of one instrument."""

    value: float = math.nan
    taken_s: float = -math.inf
    repeated_s: float = 0.0
    """For how long readings were the same."""
    asked_s: float = 0.0
    """After how long it was asked last whether it is stuck [s]: one that is at rest may repeat itself."""
    moved: int = 0
    """Readings that were others than the one before, since it repeated itself last."""
    moves_s: float = -math.inf
    """When the first of them was taken."""
    before: int = 0
    """How many there were between that and the time before."""
    times: int = 0
    """How often it was stuck, not long after the time before."""

    @property
    def needed(self) -> int:
        """So many readings say that it moves again."""
        return int(MOVING * 2 ** min(max(self.times - 1, 0), MOST))


class Still:
    """Says which instruments stand still, as symptoms that no feature is the source of."""

    def __init__(self, plant: PlantDescription, stuck: Callable[[], Mapping[str, float]]) -> None:
        """``stuck`` says of which tags readings of the last minutes show that too, and since when [s]."""
        rules = plant.qualities
        self._longest_s = {
            s.tag.name: rules[s.tag.name].frozen_s or math.inf
            for s in plant.signals
            if s.relation is Relation.MEASURES and s.tag.name in rules and rules[s.tag.name].noise
        }
        self._stuck = stuck
        measured = {s.variable: s.tag.name for s in plant.signals if s.relation is Relation.MEASURES}
        effects = {mode.name: mode.effect for mode in plant.fault_modes if mode.effect is not None}
        self.shown_by: Mapping[str, str] = {
            name: measured[effect.quantity]
            for name, effect in effects.items()
            if effect.kind is EffectKind.FROZEN and effect.quantity in measured
        }
        """Fault mode that is a stuck instrument -> its tag."""
        self._seen = {tag: _Seen() for tag, longest_s in self._longest_s.items() if longest_s < math.inf}
        self._active: dict[str, Symptom] = {}

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """One for each instrument that stands still now."""
        return tuple(self._active.values())

    def stands(self, tag: str, stuck_s: float) -> bool:
        """Whether the instrument of ``tag``, stuck at ``stuck_s`` [s], is so still, or moves too shortly to tell."""
        seen = self._seen.get(tag)
        return seen is not None and (tag in self._active or (seen.moves_s > stuck_s and seen.moved < seen.needed))

    def moves_since(self, tag: str, stuck_s: float) -> float | None:
        """Since when the instrument of ``tag`` moves again that was stuck at ``stuck_s`` [s].

        None where it does not, or nobody can tell yet.
        """
        seen = self._seen.get(tag)
        if seen is None or tag in self._active or seen.moved < seen.needed or seen.moves_s <= stuck_s:
            return None
        return seen.moves_s

    def unseen(self, acknowledged: Mapping[str, float]) -> dict[str, float]:
        """``acknowledged`` without symptoms of instruments that move: one that stands still again is news."""
        names = {repeats(tag) for tag in self._seen if tag not in self._active}
        return {rule: until_s for rule, until_s in acknowledged.items() if rule not in names}

    def take(self, snapshot: Snapshot) -> None:
        """Take one more snapshot; what is bad, but for being frozen, or was taken before says nothing."""
        for tag, seen in self._seen.items():
            if tag in snapshot.frozen_s:
                seen.repeated_s = max(seen.repeated_s, snapshot.at_s - snapshot.frozen_s[tag], self._longest_s[tag])
                seen.before, seen.moved = seen.moved or seen.before, 0
                continue
            value, taken_s = snapshot.values.get(tag, math.nan), snapshot.taken_s.get(tag, snapshot.at_s)
            if math.isfinite(value) and tag not in snapshot.bad and taken_s > seen.taken_s:
                self._compare(tag, seen, value, taken_s)

    def passed_over(self, snapshot: Snapshot) -> None:
        """Take note that ``snapshot`` repeats the one before as a whole: that says nothing of an instrument."""
        for tag, seen in self._seen.items():
            seen.taken_s = max(seen.taken_s, snapshot.taken_s.get(tag, snapshot.at_s))

    def _compare(self, tag: str, seen: _Seen, value: float, taken_s: float) -> None:
        if value == seen.value:
            longest_s = self._longest_s[tag]
            seen.repeated_s += min(taken_s - seen.taken_s, longest_s / FEWEST)
            if seen.moved and seen.repeated_s >= longest_s / 2.0:
                seen.before, seen.moved = seen.moved, 0
        else:
            seen.repeated_s, seen.asked_s = 0.0, 0.0
            seen.moves_s = taken_s if seen.moved == 0 else seen.moves_s
            seen.moved += 1
            self._active.pop(tag, None)
        seen.value, seen.taken_s = value, taken_s

    def judge(self, at_s: float) -> None:
        """Ask of those that repeat themselves for longer than they may whether they are stuck, at ``at_s`` [s]."""
        longest_s = self._longest_s
        asked = [
            tag
            for tag, seen in self._seen.items()
            if tag not in self._active and seen.repeated_s >= max(longest_s[tag], LATER * seen.asked_s)
        ]
        found = self._stuck() if asked else {}
        for tag in asked:
            seen = self._seen[tag]
            seen.asked_s = seen.repeated_s
            if tag in found:
                seen.times = seen.times + 1 if seen.before < AGAIN * seen.needed else 1
                passed_s = max(at_s - found[tag], longest_s[tag])
                severity = passed_s / longest_s[tag]
                self._active[tag] = Symptom(repeats(tag), at_s, passed_s, longest_s[tag], severity)


def repeats(tag: str) -> str:
    """Name of the symptom that the instrument of ``tag`` stands still; no row of the tables has it."""
    return f"{tag} repeats itself"


class Picture:
    """Says which snapshots are an old picture with a new time."""

    def __init__(self, plant: PlantDescription) -> None:
        """Nothing was seen yet."""
        judged = (rule for rule in plant.qualities.values() if rule.noise and rule.frozen_s is not None)
        self._noisy = tuple(rule.tag for rule in judged if rule.every_s is None)
        measured = (s.tag.name for s in plant.signals if s.relation is Relation.MEASURES)
        self._shown = tuple(dict.fromkeys((*self._noisy, *measured)))
        self._before: tuple[float, ...] = ()

    def repeats(self, snapshot: Snapshot) -> bool:
        """Whether everything that is measured comes again to the last digit, and some of it has noise.

        Some that does is evidence of stuck instruments; all of it says nothing about the plant.
        """
        values, before = snapshot.values, self._before
        self._before = tuple(values[tag] for tag in self._shown if tag in values and math.isfinite(values[tag]))
        return self._before == before and any(tag in values for tag in self._noisy)
