"""Names: an unknown disturbance that the tables have as a fault is called by that fault's name, within its sizes.

It is simulated and estimated as the generated fault mode that it is, so that the readings say the same of both; what
they differ by is that the tables know how frequent the fault is, and what size is usual.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

from homeostat.domain.diagnosis import EffectKind, FaultMode, FaultState
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.prior import Prior
from homeostat.twin.isolation.search import Scored

What: TypeAlias = tuple[tuple[EffectKind | str, str], ...]
"""What is disturbed: kind and quantity of every effect, and the name of what has an equation; sorted."""


class Names:
    """The faults of the tables that are generated fault modes."""

    def __init__(self, faults: Iterable[FaultMode]) -> None:
        self._of: dict[str, list[FaultMode]] = {}
        for fault in faults:
            if fault.mode is not None:
                self._of.setdefault(fault.mode, []).append(fault)

    def of(self, state: FaultState) -> Sequence[FaultMode]:
        """The faults that a generated mode of this size is."""
        return [f for f in self._of.get(state.fault, ()) if f.severity_range.contains(state.severity)]

    def given(self, scored: Sequence[Scored], modes: Mapping[str, FaultMode], prior: Prior) -> list[Scored]:
        """``scored``, and each of its explanations by the names that one of its faults has."""
        found = list(scored)
        for each in scored if self._of else ():
            for k, state in enumerate(each.faults):
                for fault in self.of(state):
                    named = (*each.faults[:k], replace(state, fault=fault.name), *each.faults[k + 1 :])
                    score = each.score + prior.of_name(fault, modes[state.fault], state)
                    found.append(replace(each, faults=named, score=score))
        return found


def has_name(faults: FaultSet, modes: Mapping[str, FaultMode]) -> bool:
    """Whether one of ``faults`` is a generated mode that the tables have."""
    return any(modes[f.fault].mode is not None for f in faults)


def what_of(faults: FaultSet, modes: Mapping[str, FaultMode]) -> What:
    """What ``faults`` disturb, whatever they are called and however they grow."""
    found = []
    for fault in faults:
        effect = modes[fault.fault].effect
        found.append((effect.kind, effect.quantity) if effect is not None else ("", fault.fault))
    return tuple(sorted(found))
