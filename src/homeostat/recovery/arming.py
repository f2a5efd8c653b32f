"""Arming: the fallbacks ranked by what is in danger and their margins on the twin, before anything is proposed."""

import math
from collections.abc import Iterable, Mapping, Sequence
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
from homeostat.recovery.deadline import act_by_s, deadline_s, endangered
from homeostat.recovery.plant_rules import PlantRules
from homeostat.recovery.scene import Scene

ALIKE = 0.1
"""By how many scales of its unit a margin may be less than the best, and be as good [1]."""


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

    def margin(self, scales: Mapping[str, float]) -> float:
        """Least margin in ``scales`` of the unit of each criterion [1]: a bar and a millimetre are not compared."""
        return min((f.relative(scales) for f in self.findings), default=float("inf"))


@dataclass(frozen=True, slots=True)
class TimeLeft:
    """The time that is left, as the guard was told."""

    act_by_s: float | None
    """Process time by which something must be done, or the guard falls back; None for no such time [s]."""
    left_s: float
    """What is left for thinking [s]."""
    fallback: ValidatedFallback | None = None
    """The strategy that acts first; None where the twin was late."""


def rank(
    rollouts: Sequence[tuple[FallbackStrategy, Rollout]],
    limits: Limits,
    scales: Mapping[str, float],
    danger: tuple[str, ...] = (),
) -> tuple[ValidatedFallback, ...]:
    """The strategies that are approved, then the others; of those as good within `ALIKE` the first in table order.

    Of those that are approved one that serves what is in ``danger``, the limits that trip without action with the first
    one in front, comes before one that does not, then that with the largest least margin in ``scales`` (unit -> what
    counts as one unit of margin in it). Those that are not approved are ranked by that margin: the best of them is the
    least harmful thing that is known. Of those that do as little harm within `ALIKE` one that serves comes first as
    well. What a limit leaves at the first moment, before anything can act, is the same for all of them, nearly.
    """
    if not rollouts:
        raise ValueError("there is no fallback to rank; a plant needs at least one")
    judged = [ValidatedFallback(s, judge_safety(s.actions, r, limits), r) for s, r in rollouts]
    classes = [(0, *_misses(v.strategy, danger)) if isinstance(v.verdict, Approve) else (1,) for v in judged]
    margins = [v.margin(scales) for v in judged]
    best = {c: max(m for m, other in zip(margins, classes, strict=True) if other == c) for c in classes}

    def order(number: int) -> tuple[tuple[int, ...], bool, tuple[bool, ...], float]:
        own, margin = classes[number], margins[number]
        if margin >= best[own] - ALIKE:
            return own, False, _misses(judged[number].strategy, danger), 0.0
        return own, True, (), -margin

    return tuple(judged[number] for number in sorted(range(len(judged)), key=order))


def by_danger(strategies: Iterable[FallbackStrategy], danger: tuple[str, ...]) -> tuple[FallbackStrategy, ...]:
    """``strategies`` of which nothing is known but the tables: those that serve what is in ``danger`` first."""
    return tuple(sorted(strategies, key=lambda s: _misses(s, danger)))


def _misses(strategy: FallbackStrategy, danger: tuple[str, ...]) -> tuple[bool, ...]:
    """Whether ``strategy`` does not serve each limit that is in ``danger``."""
    return tuple(name not in strategy.serves for name in danger)


class Arming:
    """Tells the guard which fallback acts first, and until when something must have been done."""

    def __init__(self, scene: Scene, simulation: Simulation, rules: PlantRules, budget: Budget) -> None:
        """``rules`` hold the strategies in table order."""
        self._scene, self._simulation, self._rules, self._budget = scene, simulation, rules, budget

    async def arm(self, diagnosis: Diagnosis, idle: Rollout, anew: bool = False) -> TimeLeft:
        """Arm the best fallback under ``diagnosis``, by the time that ``idle`` leaves.

        Where the rollouts are late, those that serve what is in danger come first, else the order of the tables counts,
        and the guard takes one that serves a limit which trips before either. A time to act by that stands in the
        guard bounds the thinking as well: thinking again does not put it off. A wait that is over does, as it was as
        safe as falling back: ``anew``, what its readings say counts alone.
        """
        scene, budget, limits = self._scene, self._budget, self._rules.limits
        standing_s = None if anew else scene.now.act_by_s
        scene.send(Correction(self._simulation.instrument_errors(diagnosis)))
        until_s = math.inf if standing_s is None else standing_s - scene.seen_s
        left_s = deadline_s(idle, limits, budget.latency_s, budget.reserve_s, until_s, scene.age_s)
        danger = endangered(idle, limits)
        named_s = act_by_s(idle, limits, scene.seen_s, budget.reserve_s, scene.age_s)
        armed = TimeLeft(min((t for t in (named_s, standing_s) if t is not None), default=None), left_s)
        try:
            ranked = await scene.within("arming the fallback", budget.arming_s, self._ranked(diagnosis, danger))
        except TimeoutError as late:
            first, *others = by_danger(self._rules.fallbacks, danger)
            served = [name for name in danger if name in first.serves]
            why = f"it is to bring {served[0]} back" if served else "as in the tables"
            scene.alarm("arming", f"{late}; {first.name!r} acts first, {why}")
            scene.send(Arm((first.name, *(s.name for s in others)), named_s, tried=False, anew=anew))
            return armed
        scene.well("arming")
        scene.send(Arm(tuple(v.strategy.name for v in ranked), named_s, anew=anew))
        best = ranked[0]
        approved = isinstance(best.verdict, Approve)
        scene.record(FallbackArmed(best.strategy.name, approved, best.findings, left_s))
        return replace(armed, fallback=best)

    async def _ranked(self, diagnosis: Diagnosis, danger: tuple[str, ...]) -> tuple[ValidatedFallback, ...]:
        rollouts = [(s, await self._simulation.roll_out(diagnosis, s.actions)) for s in self._rules.fallbacks]
        return rank(rollouts, self._rules.limits, self._rules.scales, danger)
