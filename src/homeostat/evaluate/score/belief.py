"""What was believed, fault set by fault set: hypotheses that differ in severity alone are one belief."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from homeostat.domain.diagnosis import FaultState, Hypothesis


@dataclass(frozen=True, slots=True)
class Belief:
    """One set of faults that was held to be possible."""

    faults: tuple[FaultState, ...]
    """The faults as the most probable hypothesis of this set has them; empty for 'nothing is wrong'."""
    probability: float
    """Summed probability of the hypotheses of this set [0, 1]."""

    @property
    def name(self) -> str:
        """Names of the faults, joined by '+'; 'none' where nothing is wrong."""
        return "+".join(f.fault for f in self.faults) or "none"


def merge(hypotheses: Iterable[Hypothesis]) -> tuple[Belief, ...]:
    """One belief per set of faults, most probable first; those of equal probability stay in the order given."""
    by_name: dict[str, list[Hypothesis]] = {}
    for hypothesis in hypotheses:
        by_name.setdefault(hypothesis.name, []).append(hypothesis)
    beliefs = [
        Belief(max(group, key=lambda h: h.probability).faults, sum(h.probability for h in group))
        for group in by_name.values()
    ]
    return tuple(sorted(beliefs, key=lambda belief: -belief.probability))
