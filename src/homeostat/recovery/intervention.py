"""Intervention policy: what is decided by, and when a plant may be left alone."""

import math
from collections.abc import Mapping

from homeostat.agents.pricing import Pricing
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.observation import Observation
from homeostat.domain.plant.limits import Limits
from homeostat.domain.verdict import Approve, Rollout, Verdict
from homeostat.recovery.look.news import Look


class InterventionPolicy:
    """Judges what happens without action."""

    def __init__(self, limits: Limits, pricing: Pricing, scales: Mapping[str, float]) -> None:
        """``scales``: unit -> what counts as one unit of margin in it."""
        self._protecting = {c.name for c in limits.criteria if c.hard} | {x.name for x in limits.hard}
        self._pricing = pricing
        self._scales = scales

    def look(self, now: Observation, diagnosis: Diagnosis, idle: Rollout, verdict: Verdict) -> Look:
        """What is to be decided by: ``verdict`` is that on ``idle``, what happens without action."""
        margins: dict[str, float] = {}
        for f in verdict.findings:
            margins[f.criterion] = min(f.relative(self._scales), margins.get(f.criterion, math.inf))
        cost = self._pricing.of(idle, (now.state, *now.rest.states)) if idle.weights else None
        fine, harmless = isinstance(verdict, Approve), self.harmless(verdict)
        return Look(now.now_s, now.state, now.mode, diagnosis, margins, cost, fine, harmless)

    def harmless(self, verdict: Verdict) -> bool:
        """Whether everything that protects the plant was judged and holds."""
        holds = {f.criterion for f in verdict.findings if f.satisfied}
        return bool(self._protecting) and self._protecting <= holds

    def worthwhile(self, look: Look) -> bool:
        """Whether leaving the plant alone costs more than releasing anything would at least."""
        return look.cost is None or look.cost.total > self._pricing.prices.release
