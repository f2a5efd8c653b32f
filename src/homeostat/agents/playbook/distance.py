"""Distance between two occasions: one number that an engineer can work out by hand.

Occasions are comparable where the plant is in the same state and the likeliest set of faults is the same; then their
distance is the sum of

    size      per fault: difference of the mean sizes, in quarters of the range that the tables admit
    doubt     half of the summed differences between the probabilities of all sets of faults
    setpoints per tag about which some state leaves a choice: difference in its widest range; automatic is 1 from any

Otherwise they are infinitely far apart. Each term is a metric, so is their sum. What is farther than :data:`FAR` is not
near: a fault a quarter of its range larger, or one that is certain here and was left out there.

Hand check: a valve that sticks at 0.7 of 0.05 to 1, and one that sticks at 0.6: 0.1 / (0.95 / 4) = 0.42.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.playbook import Occasion, Setpoint
from homeostat.domain.snapshot import Snapshot

FAR: Final = 1.0
"""Largest distance at which an occasion is near [1]."""
SHARE: Final = 0.25
"""Share of a fault's range that counts as one unit of distance [1]."""


@dataclass(frozen=True, slots=True)
class Point:
    """An occasion as far as distances depend on it."""

    kind: tuple[str, str]
    """State, and the names of the likeliest faults: points of different kinds are not comparable."""
    sizes: Mapping[str, float]
    """Fault of the likeliest set -> its mean size, in units of distance."""
    weights: Mapping[str, float]
    """Set of faults -> its share of what is plausible [1]."""
    setpoints: Mapping[str, float]
    """Tag -> value in units of distance; those on automatic are left out."""


class Measure:
    """Measures distances on one plant."""

    def __init__(self, plant: PlantDescription) -> None:
        """``plant`` says how large faults may be, and what is left open."""
        self._plant = plant
        self._unit = {mode.name: SHARE * mode.severity_range.span for mode in plant.fault_modes}
        ranges = [r for state in plant.machine.states for r in state.open_setpoints]
        self._span = {r.tag: max(x.high - x.low for x in ranges if x.tag == r.tag) for r in ranges}

    def setpoints(self, snapshot: Snapshot) -> tuple[Setpoint, ...]:
        """Where everything stands in ``snapshot`` about which some state leaves a choice."""
        known = ((tag, snapshot.values.get(tag, math.nan)) for tag in sorted(self._span))
        return tuple(Setpoint(tag, value if math.isfinite(value) else None) for tag, value in known)

    def point(self, occasion: Occasion) -> Point:
        """Where ``occasion`` lies; ValueError where the plant has no such state, fault or tag."""
        self._plant.machine.state(occasion.state)
        weights: dict[str, float] = {}
        for h in occasion.hypotheses:
            weights[_named(h)] = weights.get(_named(h), 0.0) + h.probability
        whole = sum(weights.values())
        if whole <= 0.0:
            raise ValueError("none of its hypotheses has a probability")
        likeliest = max(sorted(weights), key=weights.__getitem__)
        held = [(s.tag, s.value) for s in occasion.setpoints if s.value is not None]
        if unknown := sorted({tag for tag, _ in held} - self._span.keys()):
            raise ValueError(f"plant {self._plant.name!r} leaves no choice about {unknown[0]!r}")
        return Point(
            (occasion.state, likeliest),
            self._sizes([h for h in occasion.hypotheses if _named(h) == likeliest]),
            {name: weight / whole for name, weight in weights.items()},
            {tag: value / self._span[tag] for tag, value in held},
        )

    def _sizes(self, hypotheses: list[Hypothesis]) -> dict[str, float]:
        whole, sizes = sum(h.probability for h in hypotheses), dict[str, float]()
        for h in hypotheses:
            for f in h.faults:
                if f.fault not in self._unit:
                    raise ValueError(f"plant {self._plant.name!r} has no fault {f.fault!r}")
                sizes[f.fault] = sizes.get(f.fault, 0.0) + h.probability / whole * f.severity / self._unit[f.fault]
        return sizes


def distance(one: Point, other: Point) -> float:
    """How far two points are apart [1]; infinite where they are of different kinds."""
    if one.kind != other.kind:
        return math.inf
    size = sum(abs(one.sizes[fault] - other.sizes[fault]) for fault in one.sizes)
    names, tags = one.weights.keys() | other.weights.keys(), one.setpoints.keys() | other.setpoints.keys()
    doubt = 0.5 * sum(abs(one.weights.get(name, 0.0) - other.weights.get(name, 0.0)) for name in sorted(names))
    moved = sum(_moved(one.setpoints.get(tag), other.setpoints.get(tag)) for tag in sorted(tags))
    return size + doubt + moved


def _moved(one: float | None, other: float | None) -> float:
    return 1.0 if one is None or other is None else min(abs(one - other), 1.0)


def _named(hypothesis: Hypothesis) -> str:
    return fault_set(f.fault for f in hypothesis.faults)


def fault_set(faults: Iterable[str]) -> str:
    """The name of a set of ``faults``, whatever their order."""
    return "+".join(sorted(faults)) or "none"
