"""Action by search: least cost subject to the margin of everything that forbids, over the ensemble."""

import asyncio
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from homeostat.agents.hypotheses import plausible
from homeostat.agents.pricing import Pricing
from homeostat.agents.roles import Situation
from homeostat.agents.search.candidates import Point, SearchSpace
from homeostat.agents.search.cost import Cost
from homeostat.agents.search.gently import leads_back
from homeostat.agents.search.returning import Returning
from homeostat.agents.search.routes import RouteSearch
from homeostat.agents.search.tracking import blind, held, search_space, tracking
from homeostat.agents.search.unseen import Unseen
from homeostat.domain.advice import Advice
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.domain.verdict import Revise
from homeostat.process.types import Table, Vec
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Purpose, Twin

Key: TypeAlias = tuple[str, tuple[Command, ...]]
"""State and commands of an action set, or the digest of one that goes on."""
Known: TypeAlias = Callable[[Situation, str], Sequence[ActionSet]]
"""Gives what helped before in a situation like this one, and leads to the state that is named."""
HOPELESS = 5.0
"""A search whose cost stays above this cannot be cured by refinement [production]."""
CHANGE = 0.002
"""Design production that a setpoint change over its whole range is worth: of two that cost the same the smaller [1]."""
APART = 0.25
"""Points closer than this, summed over the ranges, lie in one basin [1]."""


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """How the search spends its time."""

    slack: float = 0.08
    """Margin that is kept on the search's own rollouts, in scales of the criterion's unit [1]."""
    coarse: tuple[float, ...] = (0.1, 0.05, 0.025)
    """Step of each refinement on few members, as a fraction of each range [1]."""
    bases: int = 3
    """Points that each of these starts from, well apart from each other."""
    finalists: int = 12
    """Points that are tried again on as many members as validation uses."""
    fine: tuple[float, ...] = (0.02, 0.008)
    """Step of each refinement on those."""
    known: Known = lambda situation, target: ()
    """What the first look and the finalists take in besides, as from a playbook."""


MOST_ROWS: Final = 400_000
"""Ticks that are simulated at once, over all members: what they show lies in memory until it is judged."""


class SearchAction:
    """Implements :class:`homeostat.agents.roles.Action` without a model; every draw comes from the twin's seed."""

    def __init__(
        self,
        twin: Twin,
        plant: PlantDescription,
        pricing: Pricing,
        settings: SearchSettings | None = None,
    ) -> None:
        """``twin`` is that of ``plant``; ``pricing`` goes by its prices."""
        self._twin, self._plant, self._tags = twin, plant, plant.tags_by_name
        self._settings = settings or SearchSettings()
        self._cost = Cost(plant.limits, pricing, plant.scales, self._settings.slack)
        self._release = pricing.prices.release / pricing.prices.worth(twin.settings.horizon_s)
        self._judged: list[tuple[Ensemble, dict[Key, NDArray[np.float64]]]] = []
        self._told: tuple[ActionSet, ActionSet] | None = None
        """What was proposed last, and what of it was tried."""
        self._last: dict[str, ActionSet] = {}
        """State -> what was found for it last, in this decision or one before."""
        self._returning = Returning(plant, self._cost, self._release)
        self._unseen = Unseen(plant.machine, self._cost)

    def _judged_on(self, ensemble: Ensemble) -> dict[Key, NDArray[np.float64]]:
        """(State, commands) -> what they came to on ``ensemble``: attempts differ in what they require only."""
        before = self._judged
        for known, judged in before:
            if known is ensemble:
                return judged
        mine: dict[Key, NDArray[np.float64]] = {}
        self._judged = [*((e, j) for e, j in before if e.start_s == ensemble.start_s), (ensemble, mine)]
        return mine

    async def bounds(self, situation: Situation, paths: Sequence[RecoveryPath]) -> list[float]:
        """What each of ``paths`` costs at best, if nothing forbade, as a share of the design production [1].

        It is the cheapest of the points that a search looks at first, what the last decision found among them, which
        does not see what two setpoints gain only together; of a route, of all the ways that it tries. That it must be
        released is in it.
        """
        return await asyncio.to_thread(self._bounds, self._twin.frozen(), situation, paths)

    def _bounds(self, twin: Twin, situation: Situation, paths: Sequence[RecoveryPath]) -> list[float]:
        few = twin.ensemble(plausible(situation.diagnosis), twin.settings.search_draws)
        routes = RouteSearch(twin, self._cost, self._tags)
        found, fixed, by_hand = [], held(self._plant, situation), blind(self._plant, situation)
        for path in paths:
            if path.awaited:
                ways = routes.ways(path)
            else:
                space = search_space(self._plant, path.machine.state(path.target), fixed, by_hand)
                ways = [space.actions(p) for p in (*self._first(space, situation), *self._last_found(space))]
            found.append(float(self._judge(twin, ways, few)[:, 0].min()) + self._release)
        return found

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Revise:
        """The best action set found for the path's target state; validation says whether it will do.

        Of a plant that goes back to ordinary operation, what brings it near that by hand where it is to come first;
        other paths are refused then.
        """
        if path.awaited:
            twin = self._twin.frozen()
            routes = RouteSearch(twin, self._cost, self._tags)
            judge = partial(self._judge, twin)
            return await asyncio.to_thread(routes.best, path, situation, dict(advice.required), judge)
        stuck = held(self._plant, situation)
        by_hand = blind(self._plant, situation)
        space = search_space(self._plant, path.machine.state(path.target), stuck, by_hand)
        twin = self._twin.frozen()
        if leads_back(self._plant, situation, path):
            return await asyncio.to_thread(self._returning.back, twin, space, situation)
        if (instead := self._returning.instead(situation, path)) is not None:
            return instead
        found = await asyncio.to_thread(self._search, twin, space, situation, dict(advice.required))
        self._last[space.state.name] = found
        told = await self._tracked(twin, found, stuck)
        self._told = told, found
        return told

    async def tracked(self, situation: Situation, path: RecoveryPath, actions: ActionSet) -> ActionSet:
        """``actions`` by which no controller of a stuck actuator is on automatic; themselves along a route.

        Nothing winds up behind what stands by hand: that is left where somebody put it.
        """
        if path.awaited:
            return actions
        automatic = {c.tag for c in actions.commands if c.value is None}
        stuck = {tag: at for tag, at in held(self._plant, situation).items() if tag in automatic}
        return await self._tracked(self._twin.frozen(), actions, stuck) if stuck else actions

    async def _tracked(self, twin: Twin, actions: ActionSet, stuck: Mapping[str, float]) -> ActionSet:
        return await asyncio.to_thread(tracking, self._plant, twin, actions, stuck, partial(self._total, twin))

    def margins(self, actions: ActionSet) -> dict[str, float]:
        """Name of everything that forbids -> least margin, in its unit, over all members that ``actions`` were last
        tried on here; empty where they were not.
        """
        key = _key(self._told[1] if self._told is not None and actions == self._told[0] else actions)
        rows = [judged[key] for _, judged in self._judged if key in judged]
        return self._cost.margins(np.min(rows, axis=0)) if rows else {}

    async def polish(self, situation: Situation, path: RecoveryPath, actions: ActionSet) -> ActionSet:
        """The cheapest near ``actions`` on the same ``path``; themselves where nothing is, and along a route.

        Where the output of a stuck actuator stands by hand is no matter of cost, and stays.
        """
        if path.awaited:
            return actions
        stuck = held(self._plant, situation)
        stays = {c.tag: c.value for c in actions.commands if c.tag in stuck and c.value is not None}
        space = search_space(self._plant, path.machine.state(path.target), stays)
        start = space.point(actions)
        if start is None:
            return actions
        found = await asyncio.to_thread(self._polish, self._twin.frozen(), space, situation, start)
        return actions if found == start else space.actions(found)

    def _polish(self, twin: Twin, space: SearchSpace, situation: Situation, start: Point) -> Point:
        many = twin.ensemble(plausible(situation.diagnosis), twin.settings.draws, Purpose.REFINE)
        sure: dict[Point, float] = {}
        self._evaluate(twin, [start], space, many, {}, sure)
        for fraction in (*self._settings.coarse[1:], *self._settings.fine):
            (base,) = self._best(sure, space, 1)
            self._evaluate(twin, space.around(base, fraction), space, many, {}, sure)
        return self._best(sure, space, 1)[0]

    def _search(self, twin: Twin, space: SearchSpace, situation: Situation, required: Mapping[str, float]) -> ActionSet:
        settings = self._settings
        hypotheses = plausible(situation.diagnosis)
        few = twin.ensemble(hypotheses, twin.settings.search_draws)
        tried: dict[Point, float] = {}
        last, helped = self._last_found(space), self._helped(space, situation)
        self._evaluate(twin, [*self._first(space, situation), *helped, *last], space, few, required, tried)
        for fraction in settings.coarse:
            bases = self._apart(tried, space, settings.bases)
            before = tried[bases[0]]
            self._evaluate(twin, [p for b in bases for p in space.around(b, fraction)], space, few, required, tried)
            if before > HOPELESS and min(tried.values()) >= 0.9 * before:
                return space.actions(self._best(tried, space, 1)[0])
        many = twin.ensemble(hypotheses, twin.settings.draws, Purpose.REFINE)
        sure: dict[Point, float] = {}
        # Few members may wrong what helped before.
        finalists = [*self._best(tried, space, settings.finalists), *helped]
        self._evaluate(twin, finalists, space, many, required, sure)
        for fraction in settings.fine:
            (base,) = self._best(sure, space, 1)
            self._evaluate(twin, space.around(base, fraction), space, many, required, sure)
        return space.actions(self._best(sure, space, 1)[0])

    def _helped(self, space: SearchSpace, situation: Situation) -> list[Point]:
        """What helped before near ``situation``."""
        return _points(space, self._settings.known(situation, space.state.name))

    def _last_found(self, space: SearchSpace) -> list[Point]:
        """What was found for the state last.

        It is no finalist by itself: where the plant has changed it is mostly the safe one of all members, and the last
        steps, which begin at one point only, would go on around it instead of around what has become cheaper.
        """
        last = self._last.get(space.state.name)
        return [] if last is None else _points(space, [last])

    def _first(self, space: SearchSpace, situation: Situation) -> list[Point]:
        """Where the search begins: by design, where the plant is now, and over all that is open."""
        values = situation.snapshot.values
        commanded = {tag: values.get(of, math.nan) for tag, of in self._plant.overridden.items()}
        return space.first(space.present(values), commanded=commanded)

    def _apart(self, tried: Mapping[Point, float], space: SearchSpace, count: int) -> list[Point]:
        """The best points that are apart from each other: the best one's surroundings may be a trap."""
        chosen: list[Point] = []
        for point in self._best(tried, space, len(tried)):
            if all(space.gap(point, other) > APART for other in chosen):
                chosen.append(point)
                if len(chosen) == count:
                    break
        return chosen

    def _best(self, tried: Mapping[Point, float], space: SearchSpace, count: int) -> list[Point]:
        return sorted(tried, key=lambda p: (tried[p], space.distance(p)))[:count]

    def _evaluate(
        self,
        twin: Twin,
        points: Sequence[Point],
        space: SearchSpace,
        ensemble: Ensemble,
        required: Mapping[str, float],
        tried: dict[Point, float],
    ) -> None:
        """Cost of every new point: its price, ten per scale of missing margin, and a little for change.

        What heads for a limit when the rollout ends costs one more release, which it will need.
        """
        fresh = [p for p in dict.fromkeys(points) if p not in tried]
        if not fresh:
            return
        judged = self._judge(twin, [space.actions(p) for p in fresh], ensemble)
        cost = self._cost.total(judged, required) + self._release * judged[:, -1]
        for point, value in zip(fresh, cost.tolist(), strict=True):
            tried[point] = value + CHANGE * space.distance(point)

    def _total(self, twin: Twin, actions: Sequence[ActionSet], ensemble: Ensemble) -> Vec:
        """Cost of each of ``actions`` on ``ensemble``, with a penalty for every margin that is missing [1]."""
        return self._cost.total(self._judge(twin, actions, ensemble), {})

    def _judge(self, twin: Twin, actions: Sequence[ActionSet], ensemble: Ensemble) -> Table:
        """What each of ``actions`` comes to on ``ensemble``, whoever asked first: shape (actions, 1 + criteria)."""
        judged = self._judged_on(ensemble)
        untried = [a for a in actions if _key(a) not in judged]
        most = max(MOST_ROWS // (len(ensemble.weights) * twin.horizon), 1)
        for some in (untried[k : k + most] for k in range(0, len(untried), most)):
            if some[0].then:
                rows = self._cost.judge(*twin.follow_many(ensemble, some, refuse=False), ensemble.weights, some)
            else:
                rows = self._unseen.judge(twin, ensemble, some)
            judged.update(zip(map(_key, some), rows, strict=True))
        return np.stack([judged[_key(a)] for a in actions])


def _points(space: SearchSpace, every: Sequence[ActionSet]) -> list[Point]:
    """Those of ``every`` that ``space`` admits, with what leaves no choice as it is there."""
    settled = (space.settled(point) for point in map(space.point, every) if point is not None)
    return [point for point in dict.fromkeys(settled) if space.admits(point)]


def _key(actions: ActionSet) -> Key:
    """What tells ``actions`` apart; the digest takes longer to make, and says what follows as well."""
    return (actions.digest, ()) if actions.then else (actions.target, actions.commands)
