"""Postponed: whether falling back later is as safe as falling back now."""

from collections.abc import Sequence

import numpy as np

from homeostat.agents.checks import judge_safety
from homeostat.domain.plant.limits import Limit, Limits
from homeostat.domain.plant.timing import TICK_S
from homeostat.domain.recovery import ActionSet
from homeostat.domain.verdict import Approve, Finding, Revise, Rollout, RolloutResult, Verdict
from homeostat.guard.requests.permissives import refusal

LONGER_TICKS = 10.0
"""Ticks by which time outside a hard limit may be longer where it is left either way."""
LONGER = "CHK-LATER"
"""Name of the refusal of a wait by which a hard limit is violated for longer."""


def judge_postponed(
    rest: ActionSet, later: Rollout, fallback: ActionSet, at_once: Rollout, limits: Limits, tick_s: float = TICK_S
) -> Verdict:
    """Approve ``rest`` for a while if no limit is worse ``later`` than where ``fallback`` is taken ``at_once``.

    A limit that is kept at once must be kept later; one that is not may be left by no more, and for no longer than
    the time of :data:`LONGER_TICKS`, in the worst member.
    """
    now, then = judge_safety(fallback, at_once, limits), judge_safety(rest, later, limits)
    if at_once.result is not RolloutResult.COMPLETED or later.result is not RolloutResult.COMPLETED:
        return then if isinstance(then, Revise) else Revise(now.findings)
    allowed = {f.criterion: min(f.margin, 0.0) for f in now.findings}
    worse = [f for f in then.findings if not f.margin >= allowed.get(f.criterion, 0.0)]
    worse += _longer(limits.hard, later, at_once, LONGER_TICKS * tick_s)
    return Revise(tuple(worse)) if worse else Approve(rest.digest, then.findings)


def _longer(hard: Sequence[Limit], later: Rollout, at_once: Rollout, longer_s: float) -> list[Finding]:
    """Hard limits that are left for longer later, by more than ``longer_s`` [s], in the worst member."""
    found = []
    for limit in hard:
        more_s = outside_s(limit, later) - outside_s(limit, at_once)
        if more_s > longer_s:
            text = f"{limit.name!r} is violated for {more_s:.0f} s longer where the fallback acts later"
            found.append(refusal(LONGER, text))
    return found


def outside_s(limit: Limit, rollout: Rollout) -> float:
    """Longest that any member of ``rollout`` violates ``limit``, or leaves it undecided [s]."""
    signals, dt_s = rollout.trajectory.signals, rollout.trajectory.dt_s
    margins = np.atleast_2d(limit.formula.margins(signals, dt_s))
    return float((~(margins >= 0.0)).sum(axis=1).max(initial=0)) * dt_s
