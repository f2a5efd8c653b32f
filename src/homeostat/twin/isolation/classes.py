"""Classes: explanations by the items that they accuse, and what may be said of them.

Explanations of one item are one class; its score is that of its best one. A name is used where its explanation is
nearly as good as the best of its class, and fits; else the class is known, and the cause is not. Where the name is one
that the tables give to an unknown disturbance, everything else of the class that explains as much stands beside it.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from homeostat.domain.diagnosis import AS_LIKELY_AS_NOT, SOMETHING_ELSE, FaultMode, FaultState, Hypothesis
from homeostat.twin.carried import FaultSet
from homeostat.twin.isolation.names import What, has_name, what_of
from homeostat.twin.isolation.search import Scored

NAMED_NATS = 8.0
"""A named cause may be this much worse than the best explanation of its class, which is free to be anything [nats]."""
LEAST_PROBABILITY = 0.02
"""Classes below this are dropped."""
SPREAD_NATS = 1.5
"""Explanations this much worse than the best bound its size at about two standard deviations [nats]."""
ROUNDED = 1e-9
"""What adding and dividing scores may take from one [nats]."""
Class: TypeAlias = tuple[str, ...]
"""Items that are accused together, sorted; none where nothing is wrong."""
Claim: TypeAlias = tuple[Class, What]
"""A class, and what is disturbed where that counts."""


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
        for best, part in _rivals(group, modes, share) if named else ((max(group, key=_score), 1.0),):
            chosen = _spread(best, group)
            parts = _shares(len(chosen))
            found += [Hypothesis(s.faults, share * part * w) for s, w in zip(chosen, parts, strict=True)]
    kept = 1.0 - misled if named else 1.0 - AS_LIKELY_AS_NOT
    other = 1.0 - kept * sum(h.probability for h in found) if named else AS_LIKELY_AS_NOT
    found = [replace(h, probability=kept * h.probability) for h in found]
    if other >= LEAST_PROBABILITY:
        found.append(Hypothesis((FaultState(SOMETHING_ELSE, 1.0, since_s),), other))
    return tuple(sorted(found, key=lambda h: -h.probability))


def claim_of(faults: FaultSet, modes: Mapping[str, FaultMode], contested: Collection[Class]) -> Claim:
    """What ``faults`` claim: which items are wrong, and what of them where the class is ``contested``."""
    accused = class_of(faults, modes)
    return accused, what_of(faults, modes) if accused in contested else ()


def contested(scored: Iterable[Scored], modes: Mapping[str, FaultMode]) -> frozenset[Class]:
    """Classes of which one explanation has a name that the tables give to an unknown disturbance."""
    return frozenset(class_of(s.faults, modes) for s in scored if has_name(s.faults, modes))


def _representative(group: Sequence[Scored], modes: Mapping[str, FaultMode]) -> Scored:
    """The explanation that stands for all of ``group``: of two names of one thing that of the tables."""
    best = max(group, key=_score)
    known = [s for s in group if not any(modes[f.fault].unknown for f in s.faults)]
    tables = [s for s in known if _listed(s, modes)]
    for better in (known, tables):
        leader = max(better, key=_score, default=best)
        best = leader if leader.score >= max(s.score for s in group) - NAMED_NATS else best
    return best


def _rivals(group: Sequence[Scored], modes: Mapping[str, FaultMode], share: float) -> Sequence[tuple[Scored, float]]:
    """The explanations that stand for a class of probability ``share``, with the part of it that each has.

    It is one, but for a name that the tables give to what was unknown: others that the tables have stand beside it, and
    the best of what has no name where that disturbs something else. None of them is more than the one that it is.
    """
    best = _representative(group, modes)
    if _stands(best, modes):
        return _standing(best, group, modes, share)
    if not any(has_name(s.faults, modes) for s in group):
        return ((best, 1.0),)
    by_name: dict[frozenset[str], Scored] = {}
    for each in sorted(group, key=_score):
        by_name[_name(each)] = each
    by_name[_name(best)] = best
    listed = [s for s in by_name.values() if _listed(s, modes)]
    named = [s for s in listed if has_name(s.faults, modes)]
    said = {what_of(s.faults, modes) for s in named}
    nameless = [s for s in by_name.values() if s not in listed and what_of(s.faults, modes) not in said]
    beside = [*listed, max(nameless, key=_score, default=best)] if best in named else named
    rivals = [best, *(s for s in beside if s is not best and s.score >= best.score - NAMED_NATS)]
    weights = np.exp([min(s.score - best.score, 0.0) for s in rivals])
    weights[1:][share * weights[1:] < LEAST_PROBABILITY * weights.sum()] = 0.0
    parts = (weights / weights.sum()).tolist()
    return tuple((s, part) for s, part in zip(rivals, parts, strict=True) if part)


def _standing(
    best: Scored, group: Sequence[Scored], modes: Mapping[str, FaultMode], share: float
) -> Sequence[tuple[Scored, float]]:
    """An actuator that stands still, and beside it what else its class has: one that is slow stands at first, too."""
    other = max((s for s in group if not _stands(s, modes)), key=_score, default=best)
    weights = np.exp(np.array([best.score, other.score]) - max(best.score, other.score))
    parts = weights / weights.sum()
    if other is best or share * parts[1] < LEAST_PROBABILITY:
        return ((best, 1.0),)
    if share * parts[0] < LEAST_PROBABILITY:
        return ((other, 1.0),)
    return (best, float(parts[0])), (other, float(parts[1]))


def _stands(scored: Scored, modes: Mapping[str, FaultMode]) -> bool:
    """Whether an actuator of it stands still."""
    return any(modes[f.fault].stands for f in scored.faults)


def _spread(best: Scored, group: Sequence[Scored]) -> list[Scored]:
    """``best``, and those of the same faults that bound its size."""
    name = {f.fault for f in best.faults}
    least = best.score - SPREAD_NATS - ROUNDED
    same = [s for s in group if {f.fault for f in s.faults} == name and s.score >= least]
    chosen = [best]
    for extreme in (min(same, key=_size), max(same, key=_size)):
        if abs(_size(extreme) - _size(best)) > 1e-3 * abs(_size(best)):
            chosen.append(extreme)
    return chosen


def _listed(scored: Scored, modes: Mapping[str, FaultMode]) -> bool:
    """Whether the tables have all of its faults."""
    return all(modes[f.fault].listed for f in scored.faults)


def _name(scored: Scored) -> frozenset[str]:
    return frozenset(f.fault for f in scored.faults)


def _score(scored: Scored) -> float:
    return scored.score


def _size(scored: Scored) -> float:
    return sum(f.severity for f in scored.faults)


def _shares(count: int) -> tuple[float, ...]:
    return {1: (1.0,), 2: (0.7, 0.3), 3: (0.6, 0.2, 0.2)}[count]
