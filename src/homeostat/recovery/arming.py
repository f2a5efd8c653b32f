"""Arming: the fallbacks ranked by their margins on the twin, before anything is proposed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from homeostat.agents.checks import judge_safety
from homeostat.agents.roles import Simulation
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import FallbackArmed
from homeostat.domain.observation import Arm, Correction
from homeostat.domain.plant.limits import Limits
from homeostat.domain.recovery import FallbackStrategy
from homeostat.domain.verdict import Approve, Finding, Rollout, Verdict
from homeostat.recovery.bounds import Budget
from homeostat.recovery.deadline import act_by_s, deadline_s
from homeostat.recovery.plant_rules import PlantRules
from homeostat.recovery.scene import Scene


@dataclass(frozen=True, slots=True)
class ValidatedFallback:
    """A strategy with what the twin says of it."""

    strategy: FallbackStrategy
    """The strategy."""
    verdict: Verdict
    """Judgement of the criteria that protect the plant."""
    rollout: Rollout
    """What it does."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """One finding per protecting criterion."""
        return self.verdict.findings

    @property
    def margin(self) -> float:
        """Least margin, each criterion in its own unit."""
        return min((f.margin for f in self.findings), default=float("inf"))


@dataclass(frozen=True, slots=True)
class TimeLeft:
    """The time that is left, as the guard was told."""

    act_by_s: float | None
    """Process time by which something must be done; None where no limit is violated without it [s]."""
    left_s: float
    """What is left for thinking [s]."""
    fallback: ValidatedFallback | None = None
    """The strategy that acts first; None where the twin was late."""


def rank(rollouts: Sequence[tuple[FallbackStrategy, Rollout]], limits: Limits) -> tuple[ValidatedFallback, ...]:
    """The strategies, that with the largest least margin first; of equals the first in table order.

    Those that are not approved are ranked as well: the best of them is the least harmful thing that is known.
    """
    if not rollouts:
        raise ValueError("there is no fallback to rank; a plant needs at least one")
    judged = [ValidatedFallback(s, judge_safety(s.actions, r, limits), r) for s, r in rollouts]
    return tuple(sorted(judged, key=lambda v: -v.margin))


class Arming:
    """Tells the guard which fallback acts first, and until when something must have been done."""

    def __init__(self, scene: Scene, simulation: Simulation, rules: PlantRules, budget: Budget) -> None:
        """``rules`` hold the strategies in table order."""
        self._scene, self._simulation, self._rules, self._budget = scene, simulation, rules, budget

    async def arm(self, diagnosis: Diagnosis, idle: Rollout) -> TimeLeft:
        """Arm the best fallback under ``diagnosis``, by the time that ``idle`` leaves.

        Where the rollouts are late, the strategies stay in the order of the tables. A time to act by that stands in the
        guard bounds the thinking as well: thinking again does not put it off.
        """
        scene, budget, limits = self._scene, self._budget, self._rules.limits
        standing_s = scene.now.act_by_s
        scene.send(Correction(self._simulation.instrument_errors(diagnosis)))
        until_s = math.inf if standing_s is None else standing_s - scene.seen_s
        left_s = deadline_s(idle, limits, budget.latency_s, budget.reserve_s, until_s)
        armed = TimeLeft(act_by_s(idle, limits, scene.seen_s, budget.reserve_s), left_s)
        try:
            ranked = await scene.within("arming the fallback", budget.arming_s, self._ranked(diagnosis))
        except TimeoutError as late:
            scene.alarm("arming", f"{late}; {self._rules.fallbacks[0].name!r} acts first, as in the tables")
            scene.send(Arm((), armed.act_by_s))
            return armed
        scene.send(Arm(tuple(v.strategy.name for v in ranked), armed.act_by_s))
        best = ranked[0]
        approved = isinstance(best.verdict, Approve)
        scene.record(FallbackArmed(best.strategy.name, approved, best.findings, left_s))
        return replace(armed, fallback=best)

    async def _ranked(self, diagnosis: Diagnosis) -> tuple[ValidatedFallback, ...]:
        rollouts = [(s, await self._simulation.roll_out(diagnosis, s.actions)) for s in self._rules.fallbacks]
        return rank(rollouts, self._rules.limits)
