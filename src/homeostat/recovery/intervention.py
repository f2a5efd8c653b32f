"""Intervention policy: when a plant is better left alone."""

import math
from collections.abc import Mapping

from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.observation import Observation
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.production import Production
from homeostat.domain.verdict import Approve, Rollout, RolloutResult, Verdict
from homeostat.recovery.look.news import Look

TOLERANCE = 0.3
"""A recovered plant is left alone while soft criteria are missed by no more than this many scales [1]."""
GAIN = 0.01
"""A plant that may be left alone is only touched for at least this much more production [1]."""
RISK = 0.05
"""Production that must be won for each rank by which an action is riskier than leaving the plant alone [1]."""


class InterventionPolicy:
    """Judges what happens without action, and whether an action is worth taking."""

    def __init__(self, limits: Limits, production: Production, scales: Mapping[str, float]) -> None:
        """``scales``: unit -> what counts as one unit of margin in it."""
        self._protecting = {c.name for c in limits.criteria if c.hard} | {x.name for x in limits.hard}
        self._soft = {c.name for c in limits.criteria if not c.hard}
        self._production = production
        self._scales = scales

    def look(self, now: Observation, diagnosis: Diagnosis, idle: Rollout, verdict: Verdict, recovered: bool) -> Look:
        """What is to be decided by: ``verdict`` is that on ``idle``, what happens without action."""
        margins: dict[str, float] = {}
        for f in verdict.findings:
            margins[f.criterion] = min(f.relative(self._scales), margins.get(f.criterion, math.inf))
        production = self._rate(idle) if idle.result is RolloutResult.COMPLETED else math.nan
        fine, harmless = self.fine(verdict, recovered), self.harmless(verdict)
        return Look(now.now_s, now.state, now.mode, diagnosis, margins, production, fine, harmless)

    def fine(self, verdict: Verdict, recovered: bool) -> bool:
        """Whether the plant may be left alone: everything holds, or, once recovered, almost everything does."""
        if isinstance(verdict, Approve):
            return True
        missed = [f.relative(self._scales) > -TOLERANCE for f in verdict.violated if f.criterion in self._soft]
        return recovered and len(missed) == len(verdict.violated) and all(missed)

    def harmless(self, verdict: Verdict) -> bool:
        """Whether everything that protects the plant was judged and holds."""
        holds = {f.criterion for f in verdict.findings if f.satisfied}
        return bool(self._protecting) and self._protecting <= holds

    def worthwhile(self, idle: Rollout) -> bool:
        """Whether there is production to win back."""
        return self._rate(idle) < 1.0 - GAIN

    def gains(self, idle: Rollout, better: Rollout, risk_added: int = 0) -> bool:
        """Whether ``better`` produces clearly more than leaving the plant alone, the more so the riskier it is."""
        return self._rate(better) > self._rate(idle) + GAIN + RISK * risk_added

    def _rate(self, rollout: Rollout) -> float:
        """Mean production as a fraction of the design rate [1]."""
        return float(rollout.trajectory.signals[self._production.throughput].mean()) / self._production.design_rate
