"""Hypotheses: which of them a proposal must hold for, and which are likely enough to steer by."""

from collections.abc import Iterable

from homeostat.domain.diagnosis import Diagnosis, Hypothesis

PLAUSIBLE = 0.02
"""What is at least this probable is rolled out, and whatever is released must hold for it [1]."""
LIKELY = 0.05
"""What is at least this probable steers: the search tries it, and its faults take states and readings away [1]."""
MOST = 10
"""Most hypotheses that are rolled out."""
TRIED = 6
"""Most hypotheses that the search tries; the rest is left to validation."""


def plausible(diagnosis: Diagnosis) -> tuple[Hypothesis, ...]:
    """The hypotheses that are at least :data:`PLAUSIBLE`, most probable first; at least one, at most :data:`MOST`."""
    return _probable(diagnosis, PLAUSIBLE, MOST)


def likely(diagnosis: Diagnosis, most: int = MOST) -> tuple[Hypothesis, ...]:
    """The hypotheses that are at least :data:`LIKELY`, most probable first; at least one, at most ``most``."""
    return _probable(diagnosis, LIKELY, most)


def _probable(diagnosis: Diagnosis, least: float, most: int) -> tuple[Hypothesis, ...]:
    ranked = sorted(diagnosis.hypotheses, key=lambda h: -h.probability)
    kept = tuple(h for h in ranked if h.probability >= least)[:most]
    return kept or tuple(ranked[:1]) or (Hypothesis((), 1.0),)


def probabilities(hypotheses: Iterable[Hypothesis]) -> dict[str, float]:
    """Set of faults, by its name -> what its hypotheses of all severities come to [1]."""
    found: dict[str, float] = {}
    for h in hypotheses:
        found[h.name] = found.get(h.name, 0.0) + h.probability
    return found


def likely_faults(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Faults that all hypotheses together make at least :data:`LIKELY`, sorted by name."""
    weight: dict[str, float] = {}
    for hypothesis in diagnosis.hypotheses:
        for fault in {f.fault for f in hypothesis.faults}:
            weight[fault] = weight.get(fault, 0.0) + hypothesis.probability
    return tuple(sorted(f for f, w in weight.items() if w >= LIKELY))
