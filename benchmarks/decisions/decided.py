"""Decisions of a run as optimisation problems: the search's own objective in the unit cube, and what it spends."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.hypotheses import plausible
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Plan, Proposer, Situation
from homeostat.agents.search import action as searching
from homeostat.agents.search import routes as routing
from homeostat.agents.search.action import SearchAction, SearchSettings
from homeostat.agents.search.candidates import design_commands
from homeostat.agents.search.cost import Cost
from homeostat.agents.search.tracking import blind, held, search_space
from homeostat.domain.advice import Advice
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, open_setpoints
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate import runner
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.scenario import Scenario
from homeostat.guard.sequence.sequencer import what_follows
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Workbench, in_operation
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Purpose, Twin

Values = NDArray[np.float64]


class Found(Exception):
    """The decision that was looked for was met; the run may end."""


@dataclass(frozen=True, slots=True)
class Decision:
    """The first choice of numbers of a run."""

    plant: Plant
    twin: Twin
    situation: Situation
    path: RecoveryPath


@dataclass
class _Listening:
    """Stands in front of the search and keeps the first question that leaves it a choice."""

    plant: Plant
    twin: Twin
    own: Proposer
    kept: list[Decision] = field(default_factory=list)

    async def plan(self, situation: Situation, advice: Advice) -> Plan | Any:
        return await self.own.planning.plan(situation, advice)

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Any:
        if not self.kept and open_setpoints(path.commanded_states):
            self.kept.append(Decision(self.plant, self.twin.frozen(), situation, path))
        return await self.own.action.act(situation, path, advice)


def first_decision(plant: Plant, chosen: Scenario) -> Decision | None:
    """The first choice of numbers that the search is asked for in a run of ``chosen``; None where there is none."""
    heard: list[_Listening] = []

    def propose(bench: Workbench) -> tuple[Proposer, ...]:
        (own,) = in_operation(bench)
        heard.append(_Listening(plant, bench.twin, own))
        return (replace(own, planning=heard[0], action=heard[0]),)

    def watch(snapshot: Snapshot) -> None:
        if heard and heard[0].kept:
            raise Found

    with contextlib.suppress(Found):
        runner.run(plant, chosen, clock=DeclaredClock(1.0), proposing=Proposing(propose=propose), watcher=watch)
    return heard[0].kept[0] if heard and heard[0].kept else None


class _Counting:
    """A twin that counts what is rolled out on it."""

    def __init__(self, twin: Twin) -> None:
        self._twin, self.rollouts = twin, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._twin, name)

    def frozen(self) -> _Counting:
        """Itself: it is frozen already."""
        return self

    def try_many(self, ensemble: Ensemble, schedules: Values, refuse: bool = True, every_tick: bool = False) -> Any:
        self.rollouts += len(schedules) * len(ensemble.weights)
        return self._twin.try_many(ensemble, schedules, refuse=refuse, every_tick=every_tick)

    def follow_many(self, ensemble: Ensemble, routes: Sequence[ActionSet], refuse: bool = True) -> Any:
        self.rollouts += len(routes) * len(ensemble.weights)
        return self._twin.follow_many(ensemble, routes, refuse=refuse)


class Problem:
    """The search's objective for one decision, on the members that it decides by in the end."""

    def __init__(self, decided: Decision) -> None:
        plant, d = decided.plant, decided.plant.description
        self._decided, self._tags, self.evaluations = decided, d.tags_by_name, 0
        settings = SearchSettings()
        self._cost = Cost(d.limits, Pricing(plant.prices, d.limits, d.scales), d.scales, settings.slack)
        path, twin = decided.path, decided.twin
        stuck, by_hand = held(d, decided.situation), blind(d, decided.situation)
        target = path.machine.state(path.target)
        self._space = None if path.awaited else search_space(d, target, stuck, by_hand)
        ranges = open_setpoints(path.commanded_states) if self._space is None else self._space.ranges
        self._open = tuple(r for r in ranges if r.high > r.low)
        draws = twin.settings.search_draws if path.awaited else twin.settings.draws
        self._ensemble = twin.ensemble(plausible(decided.situation.diagnosis), draws, Purpose.REFINE)

    @property
    def design(self) -> Values:
        """The design in the unit cube: automatic where there is a manual output."""
        return np.array([0.25 if r.design is None else (r.design - r.low) / (r.high - r.low) for r in self._open])

    def grid(self, levels: int) -> Values:
        """So many values of each dimension in every combination, shape (points, dimensions); both of two positions."""
        return self._combined([np.linspace(0.0, 1.0, levels)] * len(self._open))

    def around(self, point: Values, step: float) -> Values:
        """``point`` with each dimension a ``step`` down, as it is, or up, in every combination."""
        return self._combined([np.clip([x - step, x, x + step], 0.0, 1.0) for x in point])

    def _combined(self, values: Sequence[Values]) -> Values:
        axes = []
        for r, own in zip(self._open, values, strict=True):
            if self._tags[r.tag].two_position:
                axes.append([0.0, 1.0])
            elif r.design is None:  # automatic is half of its interval
                axes.append([0.25, *own[own > 0.5].tolist()])
            else:
                axes.append(sorted(set(own.tolist())))
        return np.array(list(product(*axes))).reshape(-1, len(axes))

    @property
    def members(self) -> int:
        """Rollouts of one evaluation."""
        return len(self._ensemble.weights)

    def searched(self) -> tuple[float, int]:
        """What the search reaches, and the rollouts that it takes."""
        d, twin = self._decided.plant.description, _Counting(self._decided.twin)
        pricing = Pricing(self._decided.plant.prices, d.limits, d.scales)
        own = SearchAction(twin, d, pricing)  # type: ignore[arg-type]  # a twin in everything that is asked of it
        found = asyncio.run(own.act(self._decided.situation, self._decided.path, Advice()))
        assert isinstance(found, ActionSet)
        return float(self._values([found])[0]), twin.rollouts

    def __call__(self, points: Values) -> Values:
        """The objective at ``points`` of the unit cube, shape (points, dimensions)."""
        self.evaluations += len(points)
        return self._values([self.actions(p) for p in points])

    def alone(self) -> float:
        """The objective where nobody does anything."""
        machine, state = self._decided.plant.description.machine, self._decided.situation.state
        by_state = {s.name: design_commands(s, self._tags) for s in machine.states}
        return float(self._cost_of([ActionSet((), state, what_follows(machine, state, by_state))])[0])

    def _values(self, candidates: Sequence[ActionSet]) -> Values:
        return np.asarray(self._cost_of(candidates) + [self._change(a) for a in candidates])

    def _cost_of(self, candidates: Sequence[ActionSet]) -> Values:
        twin = self._decided.twin
        if any(a.then for a in candidates):
            signals, dt_s = twin.follow_many(self._ensemble, candidates, refuse=False)
        else:
            signals, dt_s = twin.try_many(self._ensemble, twin.schedules(candidates, twin.horizon), refuse=False)
        return self._cost.of(signals, dt_s, self._ensemble.weights, candidates)

    def actions(self, point: Values) -> ActionSet:
        """What ``point`` of the unit cube stands for."""
        chosen = {r.tag: _value(r, float(x)) for r, x in zip(self._open, point, strict=True)}
        if self._space is not None:
            return self._space.actions(tuple(chosen.get(r.tag, r.design) for r in self._space.ranges))
        return ActionSet.along(self._decided.path, self._along(chosen))

    def _along(self, chosen: dict[str, float | None]) -> Callable[[State], tuple[Command, ...]]:
        def commands(state: State) -> tuple[Command, ...]:
            return tuple(
                Command(r.tag, chosen[r.tag] if r.high > r.low else r.design, self._tags[r.tag].rate_limit)
                for r in state.setpoints
            )

        return commands

    def _change(self, actions: ActionSet) -> float:
        """What the search adds for leaving the design."""
        if self._space is not None:
            point = self._space.point(actions)
            return 0.0 if point is None else searching.CHANGE * self._space.distance(point)
        given = actions.choices(self._decided.path.commanded_states)
        return routing.CHANGE * sum(
            abs((given[r.tag] or 0.0) - (r.low if r.design is None else r.design)) for r in self._open
        )


def _value(r: SetpointRange, x: float) -> float | None:
    """What ``x`` of the unit interval stands for; half of that of a manual output stands for automatic."""
    if r.design is None:
        if x <= 0.5:
            return None
        x = 2.0 * x - 1.0
    return r.low + x * (r.high - r.low)
