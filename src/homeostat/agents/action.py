"""Action by search: least production loss subject to every criterion's margin over the ensemble."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.candidates import Point, SearchSpace, present_point
from homeostat.agents.crew import Situation
from homeostat.agents.simulation import plausible
from homeostat.domain.limits import Criterion, Limit, LimitKind, Limits
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.tag import Tag
from homeostat.domain.verdict import Advice
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Twin


@dataclass(frozen=True, slots=True)
class Objective:
    """What production is."""

    throughput: str
    """Tag whose mean is the production rate."""
    design_rate: float
    """Its value by design, in the tag's unit."""


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """How the search spends its time."""

    slack: float = 0.08
    """Margin that is kept on the search's own rollouts, in scales of the criterion's unit [1]."""
    steps: tuple[float, ...] = (0.12, 0.05, 0.02, 0.008)
    """Step of each refinement, as a fraction of each range [1]."""
    bases: int = 3
    """Points that each refinement starts from."""
    least_probability: float = 0.05
    """Hypotheses below this are left to validation [1]."""


class SearchAction:
    """Implements :class:`homeostat.agents.crew.Action` without a model; every draw comes from the twin's seed."""

    def __init__(
        self,
        twin: Twin,
        limits: Limits,
        tags: Mapping[str, Tag],
        objective: Objective,
        scales: Mapping[str, float],
        settings: SearchSettings | None = None,
    ) -> None:
        """``scales``: unit -> what counts as one unit of margin in it."""
        self._twin = twin
        self._criteria: tuple[Criterion | Limit, ...] = (*limits.criteria, *limits.limits)
        self._tags = tags
        self._objective = objective
        self._scales = scales
        self._settings = settings or SearchSettings()

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet:
        """The best action set found for the path's target state; validation says whether it will do."""
        space = SearchSpace(path.machine.state(path.target), self._tags)
        return await asyncio.to_thread(self._search, space, situation, dict(advice.required))

    def _search(self, space: SearchSpace, situation: Situation, required: Mapping[str, float]) -> ActionSet:
        likely = plausible(situation.diagnosis, self._settings.least_probability, most=6)
        ensemble = self._twin.ensemble(likely, self._twin.settings.search_draws)
        tried: dict[Point, float] = {}
        present = present_point(space.state, situation.snapshot.values)
        self._evaluate(space.first(present), space, ensemble, required, tried)
        for fraction in self._settings.steps:
            bases = sorted(tried, key=lambda p: tried[p])[: self._settings.bases]
            near = [p for base in bases for p in space.around(base, fraction)]
            before = tried[bases[0]]
            self._evaluate(near, space, ensemble, required, tried)
            if before > 5.0 and min(tried.values()) > 0.9 * before:
                break
        return space.actions(min(tried, key=lambda p: (tried[p], space.distance(p))))

    def _evaluate(
        self,
        points: Sequence[Point],
        space: SearchSpace,
        ensemble: Ensemble,
        required: Mapping[str, float],
        tried: dict[Point, float],
    ) -> None:
        """Cost of every new point: production loss, plus ten per scale of missing margin, plus a little for change."""
        fresh = [p for p in dict.fromkeys(points) if p not in tried]
        if not fresh:
            return
        horizon = self._twin.settings.horizon_s
        schedules = np.stack([self._twin.schedule(space.actions(p), horizon) for p in fresh])
        signals, dt_s = self._twin.try_many(ensemble, schedules)
        members = len(ensemble.states)
        rate = signals[self._objective.throughput].mean(axis=1).reshape(len(fresh), members)
        cost = 1.0 - rate.mean(axis=1) / self._objective.design_rate
        cost += 10.0 * self._missing(signals, dt_s, required, len(fresh))
        for point, value in zip(fresh, cost.tolist(), strict=True):
            tried[point] = value + 0.01 * space.distance(point)

    def _missing(
        self, signals: Mapping[str, NDArray[np.float64]], dt_s: float, required: Mapping[str, float], count: int
    ) -> NDArray[np.float64]:
        """Missing margin of each candidate in scales, summed over the criteria, worst member each, shape (count,)."""
        total = np.zeros(count)
        for c in self._criteria:
            if isinstance(c, Criterion):
                margin = c.formula.evaluate(signals, dt_s).value
            else:
                margins = c.formula.margins(signals, dt_s)
                margin = margins[:, 0] if c.kind is LimitKind.PERMISSIVE else margins.min(axis=1)
            scale = self._scales.get(c.formula.unit, 1.0)
            worst = np.broadcast_to(margin, (next(iter(signals.values())).shape[0],))
            worst = worst.reshape(count, -1).min(axis=1) / scale
            wanted = self._settings.slack + required.get(c.name, 0.0) / scale
            total += np.clip(wanted - worst, 0.0, 100.0)
        return total
