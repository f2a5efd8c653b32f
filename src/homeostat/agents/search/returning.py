"""Returning: how a plant in which nothing is wrong any more goes back to ordinary operation, and what comes first."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from homeostat.agents.hypotheses import plausible
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.agents.search.by_hand import by_hand, following, reaches, resting
from homeostat.agents.search.candidates import SearchSpace
from homeostat.agents.search.cost import Cost
from homeostat.agents.search.gently import RAMPS_S, SOON_S, Rest, by_loop, excess, gentlest, ramped, settles
from homeostat.agents.search.tracking import LAST_S
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Revise
from homeostat.guard.requests.permissives import refusal
from homeostat.process.types import Flags, Vec
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Purpose, Twin

WORTH = 0.25
"""Excess that standing by hand first must spare, in scales: it takes a release more [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Tried:
    """What action sets came to on one ensemble, in their order."""

    price: Vec
    """Share of the design production [1]."""
    admitted: Flags
    """Whether all that forbids holds."""
    excess: Vec
    """By how much controlled variables are off their setpoints at the worst, in scales [1]."""
    late: Vec
    """The same from :data:`SOON_S` on."""


class Returning:
    """Says how the plant goes back: at once, after it has come to rest, or by hand first."""

    def __init__(self, plant: PlantDescription, cost: Cost, release: float) -> None:
        """``cost`` judges what is tried; ``release``: what one costs, as a share of the design production [1]."""
        self._plant, self._cost, self._release = plant, cost, release
        self._rest, self._held = Rest(), Rest()
        self._first: tuple[float, dict[str, ActionSet]] = (-math.inf, {})
        """When a diagnosis said that nothing is wrong [s], and what comes before the way back: state -> commands."""

    def back(self, twin: Twin, space: SearchSpace, situation: Situation) -> ActionSet | Revise:
        """The design of an ordinary state, as fast as controlled variables stay near their setpoints.

        Refused where the plant is to be brought near it by hand first: where that spares what the way back would move.
        NoAdmissiblePlan while what was repaired still moves the plant by itself, as long as that may be waited for: not
        where a limit is in danger meanwhile, which may be because setpoints still make up for what is over, nor where
        by hand is better: where the plant would come to rest elsewhere, or staying costs more than a release.
        """
        self._first = situation.diagnosis.at_s, {}
        at_s, soon_s = situation.snapshot.at_s, twin.timing.time_s(SOON_S)
        ensemble = twin.ensemble(plausible(situation.diagnosis), twin.settings.draws, Purpose.REFINE)
        alone = ActionSet((), situation.state)
        left, dt_s = twin.try_many(ensemble, twin.schedules([alone], twin.horizon), refuse=False)
        rests = situation.act_by_s is None and settles(self._plant, left, int(soon_s / dt_s))
        most = math.inf
        if rests and self._belongs(space.state, situation.snapshot.values):
            most = float(self._cost.judge(left, dt_s, ensemble.weights, [alone])[0, 0]) - self._release
        way, first = self._ways(twin, space, situation, ensemble, most)
        if first and self._held.awaited(at_s, soon_s):
            self._first = situation.diagnosis.at_s, first
            return _refused(way.target)
        if rests and self._rest.awaited(at_s, soon_s):
            raise NoAdmissiblePlan(f"the plant comes to rest in {situation.state!r} first")
        return way

    def instead(self, situation: Situation, path: RecoveryPath) -> ActionSet | Revise | None:
        """What is done on another ``path`` than back, after that was asked for; None where nothing is said of it.

        Refused while another state comes first, and where the plant would stay where it is.
        """
        at_s, first = self._first
        if at_s != situation.diagnosis.at_s or not (first or path.target == situation.state):
            return None
        return first.get(path.target) or _refused(path.target)

    def _belongs(self, home: State, values: Mapping[str, float]) -> bool:
        """Whether the setpoints of loops are those of ``home``, within a scale of what they hold."""
        for loop in self._plant.loops:
            wanted, near = home.setpoint(loop.setpoint), self._plant.tag(loop.process_variable).scale
            design = None if wanted is None else wanted.design
            if design is not None and not abs(values.get(loop.setpoint, math.nan) - design) <= near:
                return False
        return True

    def _ways(
        self, twin: Twin, space: SearchSpace, situation: Situation, ensemble: Ensemble, most: float
    ) -> tuple[ActionSet, dict[str, ActionSet]]:
        """The gentlest way back, and what is better first, by hand: state -> commands that cost at most ``most``."""
        design, values = space.actions(space.design), situation.snapshot.values
        ways = list(dict.fromkeys(ramped(design, values, seconds) for seconds in twin.timing.times_s(RAMPS_S)))
        back, rest = self._try(twin, ensemble, ways, space.state)
        way = gentlest(ways, back.excess, back.admitted.tolist())
        off = float(back.excess[ways.index(way)])
        hands = by_hand(self._plant, situation.state, values, space.state, rest)
        if off <= WORTH or not hands:
            return way, {}
        times_s = [seconds for seconds in twin.timing.times_s(RAMPS_S) if seconds <= twin.timing.time_s(SOON_S)]
        sets = list(dict.fromkeys(gentle for a in hands for gentle in following(self._plant, a, values, times_s)))
        tried, _ = self._try(twin, ensemble, sets, None)
        better, found = tried.admitted & (tried.late <= off - WORTH) & (tried.price <= most), {}
        for target in {a.target for a in hands}:
            mine = [k for k, a in enumerate(sets) if a.target == target and better[k]]
            if mine:
                found[target] = gentlest([sets[k] for k in mine], tried.excess[mine], [True] * len(mine))
        return way, found

    def _try(
        self, twin: Twin, ensemble: Ensemble, sets: list[ActionSet], target: State | None
    ) -> tuple[_Tried, dict[str, float]]:
        """What ``sets`` come to, which lead to ``target`` if given, and where the controllers of the first end."""
        signals, dt_s = twin.try_many(ensemble, twin.schedules(sets, twin.horizon), refuse=False)
        judged, count = self._cost.judge(signals, dt_s, ensemble.weights, sets), len(sets)
        price = judged[:, 0]
        admitted = np.isfinite(price) & (self._cost.total(judged, {}) <= price)
        if target is not None:
            admitted &= reaches(target, signals, dt_s, count)
        soon = int(twin.timing.time_s(SOON_S) / dt_s)
        late = {tag: values[:, soon:] for tag, values in signals.items()}
        length = next(iter(signals.values())).shape[1]
        later = by_loop(self._plant, late, count).sum(axis=0) if soon < length else np.full(count, np.inf)
        members = len(ensemble.weights)
        first = {tag: values[:members] for tag, values in signals.items()}
        rest = resting(self._plant, first, max(math.ceil(twin.timing.time_s(LAST_S) / dt_s), 1))
        return _Tried(price, admitted, excess(self._plant, signals, count), later), rest


def _refused(target: str) -> Revise:
    """The refusal of a path to ``target``."""
    text = f"the plant is brought near ordinary operation by hand before it goes to {target!r}; name another path"
    return Revise((refusal("CHK-BY-HAND", text, Owner.PLANNING),))
