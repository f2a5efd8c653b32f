"""Arming: the fallbacks ranked by their margins on the twin, before anything is proposed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from homeostat.agents.checks import judge_safety
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import FallbackArmed
from homeostat.domain.observation import Arm, Correction, NoAction
from homeostat.domain.plant.limits import Limits
from homeostat.domain.recovery import FallbackStrategy
from homeostat.domain.verdict import Approve, Finding, Rollout, Verdict
from homeostat.recovery.deadline import act_by_s, deadline_s
from homeostat.recovery.plant_rules import Bounds, PlantRules
from homeostat.recovery.scene import Scene


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

    @property
    def margin(self) -> float:
        """Least margin, each criterion in its own unit."""
        return min((f.margin for f in self.findings), default=float("inf"))


def rank(rollouts: Sequence[tuple[FallbackStrategy, Rollout]], limits: Limits) -> tuple[ValidatedFallback, ...]:
    """The strategies, that with the largest least margin first; of equals the first in table order.

    Those that are not approved are ranked as well: the best of them is the least harmful thing that is known.
    """
    if not rollouts:
        raise ValueError("there is no fallback to rank; a plant needs at least one")
    judged = [ValidatedFallback(s, judge_safety(s.actions, r, limits)) for s, r in rollouts]
    return tuple(sorted(judged, key=lambda v: -v.margin))


class Arming:
    """Tells the guard which fallback acts first, and until when something must have been done."""

    def __init__(self, scene: Scene, rules: PlantRules, bounds: Bounds) -> None:
        """``rules`` hold the strategies in table order."""
        self._scene, self._rules, self._budget = scene, rules, bounds.budget
        self._named = False

    @property
    def stands(self) -> bool:
        """Whether there is a time by which recovery must have acted, be it one of an earlier thought."""
        return self._named or self._scene.now.act_by_s is not None

    async def arm(self, diagnosis: Diagnosis, idle: Rollout) -> float:
        """Arm the best fallback under ``diagnosis``; the thinking time that is left then [s].

        Where the rollouts are late, the strategies stay in the order of the tables. A time to act by that stands in the
        guard bounds the thinking as well: thinking again does not put it off.
        """
        scene, budget, limits = self._scene, self._budget, self._rules.limits
        standing_s = scene.now.act_by_s
        scene.desk.put(Correction(scene.agents.simulation.instrument_errors(diagnosis)))
        until_s = math.inf if standing_s is None else standing_s - scene.seen_s
        left_s = deadline_s(idle, limits, budget.latency_s, budget.reserve_s, until_s)
        by_s = act_by_s(idle, limits, scene.seen_s, budget.reserve_s)
        try:
            ranked = await scene.within("arming the fallback", budget.arming_s, self._ranked(diagnosis))
        except TimeoutError as late:
            scene.alarm("arming", f"{late}; {self._rules.fallbacks[0].name!r} acts first, as in the tables")
            self._send(Arm((), by_s))
            return left_s
        self._send(Arm(tuple(v.strategy.name for v in ranked), by_s))
        best = ranked[0]
        approved = isinstance(best.verdict, Approve)
        scene.record(FallbackArmed(best.strategy.name, approved, best.findings, left_s))
        return left_s

    def as_in_tables(self) -> None:
        """Nothing is known: the first fallback of the tables is to act first."""
        self._send(Arm(()))

    def begin(self) -> None:
        """Somebody thinks anew; of a time to act by only the guard knows."""
        self._named = False

    def relax(self) -> None:
        """The plant is to be left as it is: nothing need act by itself any more."""
        if self.stands:
            self._scene.desk.put(NoAction())
            self._named = False

    async def _ranked(self, diagnosis: Diagnosis) -> tuple[ValidatedFallback, ...]:
        simulation = self._scene.agents.simulation
        rollouts = [(s, await simulation.roll_out(diagnosis, s.actions)) for s in self._rules.fallbacks]
        return rank(rollouts, self._rules.limits)

    def _send(self, arm: Arm) -> None:
        self._named = self._named or arm.act_by_s is not None
        self._scene.desk.put(arm)
