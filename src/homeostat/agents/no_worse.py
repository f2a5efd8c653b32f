"""No worse: what violates a limit only where the best fallback does, and no worse, is no reason to fall back.

A limit that is violated at once under some explanation, whatever is done, forbids every release, and the fallback that
acts instead violates it as well. Member by member, both having the same draws, a release is as safe as falling back

    where the fallback keeps a limit in every member    if it is kept in every member, too
    where it does not                                   if no member leaves it by more than SLACK scales more, and for
                                                        no more than as long again, from LONGER_TICKS to MOST_LONGER

Hand check, 0.2 L being a scale: 11.20 L at once with a brim of 11 L, and 8.9 L after a minute with either: as safe.
10.99 L with the fallback in one member of these, 11.02 L with the release: as safe. 10.9 L and 11.01 L: refused.
"""

import math
from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.postponed import LONGER_TICKS
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.timing import TICK_S
from homeostat.domain.verdict import Approve, Revise, Rollout, RolloutResult, Verdict
from homeostat.process.types import Flags

MOST_LONGER = 30.0
"""Ticks by which time outside a hard limit may be longer at most, where the fallback needs that long itself."""
Floats: TypeAlias = NDArray[np.float64]
"""Margins, by member, or by member and time."""
SLACK = 0.2
"""By how many scales of its unit more a limit may be left than with the fallback [1]: a fallback moves everything at
once, and what is released at the rates of the tables. Nobody reads the difference on an instrument."""


def comparable(verdict: Verdict, limits: Limits) -> bool:
    """Whether hard limits and hard criteria are all that a refusal is for, so that a fallback may fare no better."""
    protecting = {c.name for c in limits.criteria if c.hard}
    protecting |= {x.name for x in limits.hard if x.kind is not LimitKind.PERMISSIVE}
    return isinstance(verdict, Revise) and {f.criterion for f in verdict.violated} <= protecting


def judge_no_worse(
    verdict: Verdict,
    rollout: Rollout,
    fallback: Rollout,
    limits: Limits,
    scales: Mapping[str, float],
    tick_s: float = TICK_S,
) -> Verdict:
    """``verdict`` on ``rollout``, an approval where it is for nothing that the ``fallback`` would spare any member.

    Both have the same members in the same order. ``scales``: unit -> what counts as one unit of margin in it.
    """
    if not isinstance(verdict, Revise) or not comparable(verdict, limits):
        return verdict
    return (
        verdict if worse(rollout, fallback, limits, scales, tick_s).any() else Approve(rollout.digest, verdict.findings)
    )


def worse(
    rollout: Rollout,
    fallback: Rollout,
    limits: Limits,
    scales: Mapping[str, float],
    tick_s: float = TICK_S,
    slack: float = SLACK,
) -> Flags:
    """Members that fare worse with ``rollout`` than with the ``fallback``, by any that is hard, shape (members,).

    ``slack``: by how many scales a limit may be left more that the fallback does not keep in every member [1].
    """
    count = len(rollout.weights)
    completed = {rollout.result, fallback.result} == {RolloutResult.COMPLETED}
    if not completed or len(fallback.weights) != count:
        return np.ones(count, dtype=np.bool_)
    found, dt_s = np.zeros(count, dtype=np.bool_), rollout.trajectory.dt_s
    mine, its = rollout.trajectory.signals, fallback.trajectory.signals
    for c in (one for one in limits.criteria if one.hard):
        of_mine, of_its = (_known(c.formula.evaluate(signals, dt_s).value) for signals in (mine, its))
        found |= _less(of_mine, of_its, slack * scales.get(c.formula.unit, 1.0))
    for limit in limits.hard:
        of_mine, of_its = (np.atleast_2d(_known(limit.formula.margins(signals, dt_s))) for signals in (mine, its))
        found |= _less(of_mine.min(axis=1), of_its.min(axis=1), slack * scales.get(limit.formula.unit, 1.0))
        mine_s, its_s = (of_mine < 0.0).sum(axis=1) * dt_s, (of_its < 0.0).sum(axis=1) * dt_s
        found |= mine_s - its_s > np.clip(its_s, LONGER_TICKS * tick_s, MOST_LONGER * tick_s)
    return found


def _less(mine: Floats, its: Floats, slack: float) -> Flags:
    """Where a margin is violated that the other one keeps, or by more than ``slack`` less than the other one.

    A member in which the other one just keeps it counts as one in which it does not, where there is any such member.
    """
    kept = np.minimum(its - slack, 0.0) if (its < 0.0).any() else np.zeros_like(its)
    return np.asarray((mine < 0.0) & (mine < np.where(its < 0.0, its - slack, kept)))


def _known(margins: Floats) -> Floats:
    """``margins``, the undecided as violated without bound."""
    return np.asarray(np.where(np.isnan(margins), -math.inf, margins), dtype=np.float64)
