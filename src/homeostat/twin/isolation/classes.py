"""Classes: explanations by the items that they accuse, and what may be said of them.

Explanations of one item are one class; its score is that of its best one. A name is used where its explanation is
nearly as good as the best of its class, and fits; else the class is known, and the cause is not.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from homeostat.domain.diagnosis import AS_LIKELY_AS_NOT, SOMETHING_ELSE, FaultMode, FaultState, Hypothesis
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.search import Scored

NAMED_NATS = 8.0
"""A named cause may be this much worse than the best explanation of its class, which is free to be anything [nats]."""
LEAST_PROBABILITY = 0.02
"""Classes below this are dropped."""
SPREAD_NATS = 1.5
"""Explanations this much worse than the best bound its size at about two standard deviations [nats]."""
Class: TypeAlias = tuple[str, ...]
"""Items that are accused together, sorted; none where nothing is wrong."""


def class_of(faults: FaultSet, modes: Mapping[str, FaultMode]) -> Class:
    """The items that ``faults`` accuse."""
    return tuple(sorted({modes[f.fault].component for f in faults}))


def hypotheses(
    scored: Iterable[Scored],
    none: float,
    modes: Mapping[str, FaultMode],
    named: bool = True,
    since_s: float = 0.0,
    misled: float = 0.0,
) -> tuple[Hypothesis, ...]:
    """Scored explanations as weighted hypotheses, most probable first.

    A class is represented by its named cause or by its best explanation, with those that bound its size; its
    probability is shared among them. ``none``: score of nothing being wrong; ``named``: whether names may be used.
    Where the best explanation does not fit, none is preferred to what is unknown, and something else that began at
    ``since_s`` [s] is as likely as not. Where it fits, something else has what the dropped classes had, and the share
    ``misled`` of cases in which the twin or the list of causes misleads however well something fits [1].
    """
    classes: dict[Class, list[Scored]] = {}
    for each in scored:
        classes.setdefault(class_of(each.faults, modes), []).append(each)
    nothing = [Scored((), none)]
    classes[()] = [*classes.get((), []), *nothing]
    peak = {accused: max(each.score for each in group) for accused, group in classes.items()}
    top = max(peak.values())
    weight = {accused: float(np.exp(score - top)) for accused, score in peak.items()}
    total = sum(weight.values())
    found: list[Hypothesis] = []
    for accused, group in classes.items():
        share = weight[accused] / total
        if share < LEAST_PROBABILITY:
            continue
        chosen = _representatives(group, modes, named)
        found += [Hypothesis(s.faults, share * w) for s, w in zip(chosen, _shares(len(chosen)), strict=True)]
    kept = 1.0 - misled if named else 1.0 - AS_LIKELY_AS_NOT
    other = 1.0 - kept * sum(h.probability for h in found) if named else AS_LIKELY_AS_NOT
    found = [replace(h, probability=kept * h.probability) for h in found]
    if other >= LEAST_PROBABILITY:
        found.append(Hypothesis((FaultState(SOMETHING_ELSE, 1.0, since_s),), other))
    return tuple(sorted(found, key=lambda h: -h.probability))


def _representatives(group: Sequence[Scored], modes: Mapping[str, FaultMode], named: bool) -> list[Scored]:
    """The explanation that stands for a class, and those of the same faults that bound its size."""
    best = max(group, key=lambda s: s.score)
    if named:
        known = [s for s in group if not any(modes[f.fault].unknown for f in s.faults)]
        tables = [s for s in known if all(modes[f.fault].effect is None for f in s.faults)]
        for better in (known, tables):  # of two names of one thing that of the tables
            leader = max(better, key=lambda s: s.score, default=best)
            best = leader if leader.score >= max(s.score for s in group) - NAMED_NATS else best
    name = {f.fault for f in best.faults}
    same = [s for s in group if {f.fault for f in s.faults} == name and s.score >= best.score - SPREAD_NATS]
    chosen = [best]
    for extreme in (min(same, key=_size), max(same, key=_size)):
        if abs(_size(extreme) - _size(best)) > 1e-3 * abs(_size(best)):
            chosen.append(extreme)
    return chosen


def _size(scored: Scored) -> float:
    return sum(f.severity for f in scored.faults)


def _shares(count: int) -> tuple[float, ...]:
    return {1: (1.0,), 2: (0.7, 0.3), 3: (0.6, 0.2, 0.2)}[count]
