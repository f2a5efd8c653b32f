"""Action by search along a route: the values that its states leave open, chosen once for the whole of it."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeAlias

import numpy as np

from homeostat.agents.hypotheses import plausible
from homeostat.agents.roles import Situation
from homeostat.agents.search.cost import Cost
from homeostat.domain.plant.state_machine import State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, open_setpoints
from homeostat.process.types import Table
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Purpose, Twin

Judge: TypeAlias = Callable[[Sequence[ActionSet], Ensemble], Table]
"""What ways come to on an ensemble, as :meth:`homeostat.agents.search.cost.Cost.judge` says it."""
LEVELS = 3
"""Values of each open command that are tried, besides the design's."""
MOST = 27
"""Most candidates; where there would be more, only the design is tried."""
CHANGE = 0.01
"""Production that a command far from its design value is worth [1]."""


class RouteSearch:
    """Tries a route with every combination of a few values of what it leaves open, all in one call of the engine."""

    def __init__(self, twin: Twin, cost: Cost, tags: Mapping[str, Tag]) -> None:
        """``tags`` say how fast a command may ramp."""
        self._twin, self._cost, self._tags = twin, cost, tags

    def best(self, path: RecoveryPath, situation: Situation, required: Mapping[str, float], judge: Judge) -> ActionSet:
        """The cheapest way to take ``path``; validation says whether it will do. ``judge`` says what each comes to."""
        choices, routes = self._choices(path), self.ways(path)
        if len(routes) == 1:
            return routes[0]
        hypotheses = plausible(situation.diagnosis)
        ensemble = self._twin.ensemble(hypotheses, self._twin.settings.search_draws, Purpose.REFINE)
        cost = self._cost.total(judge(routes, ensemble), required)
        design = self._design(path)
        far = [sum(abs(v - design[tag]) for tag, v in c.items()) for c in choices]
        return routes[int(np.argmin(cost + CHANGE * np.array(far)))]

    def ways(self, path: RecoveryPath) -> list[ActionSet]:
        """Every way to take ``path`` that is tried; that with everything as by design first."""
        return [ActionSet.along(path, partial(self._commands, chosen)) for chosen in self._choices(path)]

    def _choices(self, path: RecoveryPath) -> list[dict[str, float]]:
        """Tag -> value of everything that is open on the way; the design first."""
        design = self._design(path)
        options = [
            {design[r.tag], *map(self._tags[r.tag].nearest, np.linspace(r.low, r.high, LEVELS).tolist())}
            for r in open_setpoints(path.commanded_states)
        ]
        if np.prod([len(o) for o in options], dtype=float) > MOST:
            return [design]
        found = [dict(zip(design, values, strict=True)) for values in itertools.product(*map(sorted, options))]
        return [design, *(c for c in found if c != design)]

    @staticmethod
    def _design(path: RecoveryPath) -> dict[str, float]:
        """Tag -> design value of everything that is open on the way."""
        choices = open_setpoints(path.commanded_states)
        return {r.tag: r.low if r.design is None else r.design for r in choices}

    def _commands(self, chosen: Mapping[str, float], state: State) -> tuple[Command, ...]:
        """What ``state`` is commanded: what is open as ``chosen``, the rest as by design."""
        return tuple(
            Command(r.tag, chosen[r.tag] if r.high > r.low else r.design, self._tags[r.tag].rate_limit)
            for r in state.setpoints
        )
