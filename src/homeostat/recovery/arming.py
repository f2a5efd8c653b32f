"""Safe-state strategies: chosen by their margins on the twin, before anything is proposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.agents.checks import judge_safety
from homeostat.domain.limits import Limits
from homeostat.domain.recovery import FallbackStrategy
from homeostat.domain.verdict import Finding, Rollout, Verdict


@dataclass(frozen=True, slots=True)
class ValidatedFallback:
    """A strategy with what the twin says of it."""

    strategy: FallbackStrategy
    """The strategy."""
    verdict: Verdict
    """Judgement of the criteria that protect the plant."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One finding per protecting criterion."""
        return self.verdict.findings


def choose(rollouts: Sequence[tuple[FallbackStrategy, Rollout]], limits: Limits) -> ValidatedFallback:
    """The strategy with the largest least margin; of equals the first in table order.

    A fallback is chosen even if none is approved: it is the least harmful thing that is known.
    """
    judged = [ValidatedFallback(s, judge_safety(s.actions, r, limits)) for s, r in rollouts]
    return max(judged, key=lambda v: min((f.margin for f in v.findings), default=float("inf")))
