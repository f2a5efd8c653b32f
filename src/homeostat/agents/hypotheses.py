"""Hypotheses: which of them count; proposers, twin, validation and release check go by the same."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

from homeostat.domain.diagnosis import AS_LIKELY_AS_NOT, Diagnosis, Hypothesis, with_a_twin

PLAUSIBLE = 0.02
"""What is at least this probable counts: it is searched for, rolled out and judged, and its faults take away [1]."""
LIKELY = 0.1
"""What is at least this probable takes away what it disables also where nothing else is open [1]."""
MOST = 10
"""Most hypotheses that are rolled out."""


def counted(diagnosis: Diagnosis) -> tuple[Hypothesis, ...]:
    """What decisions are made by: what a twin can carry, and nothing where probably nothing is wrong.

    What people are told besides, that something else may be wrong or that something may be although that is not
    likely, has no part in them.
    """
    if diagnosis.doubts:
        return (Hypothesis((), 1.0),)
    return with_a_twin(diagnosis.hypotheses)


def plausible(diagnosis: Diagnosis) -> tuple[Hypothesis, ...]:
    """The hypotheses that count, most probable first; at least one, at most :data:`MOST`.

    Those of the same faults count together: where they come to :data:`PLAUSIBLE`, the best of them stands for all of
    its sizes that would not by themselves.
    """
    ranked = sorted(counted(diagnosis), key=lambda h: -h.probability)
    kept = [each for name in dict.fromkeys(h.name for h in ranked) for each in _sizes(ranked, name)]
    found = tuple(sorted(kept, key=lambda h: -h.probability))[:MOST]
    return found or tuple(ranked[:1]) or (Hypothesis((), 1.0),)


def _sizes(ranked: Sequence[Hypothesis], name: str) -> list[Hypothesis]:
    """Those of one set of faults that count, the best first; none where they do not together."""
    best, *others = [h for h in ranked if h.name == name]
    apart = [h for h in others if h.probability >= PLAUSIBLE]
    small = sum(h.probability for h in others if h.probability < PLAUSIBLE)
    alone = replace(best, probability=best.probability + small)
    return [alone, *apart] if alone.probability >= PLAUSIBLE else []


def probabilities(hypotheses: Iterable[Hypothesis]) -> dict[str, float]:
    """Set of faults, by its name -> what its hypotheses of all severities come to [1]."""
    found: dict[str, float] = {}
    for h in hypotheses:
        found[h.name] = found.get(h.name, 0.0) + h.probability
    return found


def plausible_faults(diagnosis: Diagnosis, least: float = PLAUSIBLE) -> tuple[str, ...]:
    """Faults that all hypotheses together make at least :data:`PLAUSIBLE`, or ``least`` [1], sorted by name."""
    weight: dict[str, float] = {}
    for hypothesis in counted(diagnosis):
        for fault in {f.fault for f in hypothesis.faults}:
            weight[fault] = weight.get(fault, 0.0) + hypothesis.probability
    return tuple(sorted(f for f, w in weight.items() if w >= least))


def may_pass(diagnosis: Diagnosis, passing: Collection[str]) -> bool:
    """Whether it is as likely as not that one of the ``passing`` fault modes is there, which need not last."""
    found = sum(h.probability for h in counted(diagnosis) if any(f.fault in passing for f in h.faults))
    return found >= AS_LIKELY_AS_NOT
