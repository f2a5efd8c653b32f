"""News: whether a look at the plant found anything that the last one did not."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from homeostat.agents.hypotheses import PLAUSIBLE, counted, probabilities
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.mode import Mode

SEVERITY = 0.1
"""A severity that differs by no more than this fraction of what it was is the same [1]."""
MARGIN = 0.3
"""A margin that differs by no more than this many scales of its unit is the same [1]."""
NEAR = 1.0
"""Margins beyond this many scales of their unit stand in nobody's way, and all count as this one [1]."""
COST = 0.01
"""A cost that differs by no more than this share of the design production is the same [1]."""

K = TypeVar("K")


@dataclass(frozen=True, slots=True)
class Look:
    """What one look at the plant found: what recovery decides by."""

    at_s: float
    """When the plant was looked at, in process time [s]."""
    state: str
    """State of the supervisory state machine."""
    mode: Mode
    """Mode of the plant."""
    diagnosis: Diagnosis
    """What is diagnosed."""
    margins: Mapping[str, float]
    """Criterion -> its margin if nothing is done, in scales of its unit [1]."""
    cost: Cost | None
    """What it costs to do nothing; None where the twin cannot say."""
    fine: bool
    """Whether everything that forbids holds if nothing is done, and the state that comes is reached."""
    harmless: bool
    """Whether everything that protects the plant was judged and holds if nothing is done."""


def is_news(now: Look, before: Look) -> bool:
    """Whether ``now`` differs from ``before`` by more than noise; what cannot be compared does.

    A symptom that has gone is no news, a new one is. What drifts slowly is news as soon as it has come far enough:
    ``before`` is the look after which agents thought last, and stays that.
    """
    return not (
        (now.state, now.mode, now.fine, now.harmless) == (before.state, before.mode, before.fine, before.harmless)
        and {s.rule for s in now.diagnosis.symptoms} <= {s.rule for s in before.diagnosis.symptoms}
        and _same(severities(now.diagnosis), severities(before.diagnosis), relative=SEVERITY)
        and _same(_near(now.margins), _near(before.margins), absolute=MARGIN)
        and now.cost is not None
        and before.cost is not None
        and abs(now.cost.share - before.cost.share) <= COST
    )


def severities(diagnosis: Diagnosis) -> dict[tuple[str, str], float]:
    """(set of faults, one of them) -> its mean severity, for every set that is likely as a whole."""
    hypotheses = counted(diagnosis)
    weight = probabilities(hypotheses)
    summed: dict[tuple[str, str], float] = {}
    for h in hypotheses:
        for f in h.faults:
            summed[h.name, f.fault] = summed.get((h.name, f.fault), 0.0) + h.probability * f.severity
    return {(name, fault): s / weight[name] for (name, fault), s in summed.items() if weight[name] >= PLAUSIBLE}


def _near(margins: Mapping[str, float]) -> dict[str, float]:
    return {name: min(margin, NEAR) for name, margin in margins.items()}


def _same(now: Mapping[K, float], before: Mapping[K, float], absolute: float = 0.0, relative: float = 0.0) -> bool:
    """Whether both say the same of the same things, within the tolerances; NaN is the same as nothing."""
    return now.keys() == before.keys() and all(
        abs(now[k] - before[k]) <= absolute + relative * abs(before[k]) for k in now
    )
