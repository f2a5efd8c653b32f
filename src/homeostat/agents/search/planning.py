"""Planning by enumeration: the cheapest guard-satisfying path that the fault leaves open."""

from collections.abc import Awaitable, Callable, Collection, Iterator, Sequence
from typing import TypeAlias

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.hypotheses import LIKELY, PLAUSIBLE, plausible_faults
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.domain.advice import Advice
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Approve

Bounds: TypeAlias = Callable[[Situation, Sequence[RecoveryPath]], Awaitable[Sequence[float]]]
"""What paths cost at best, as shares of the design production [1]."""
SAME = 0.002
"""Costs that differ by less are the same: another path is not tried for it, in design production [1]."""


class SearchPlanning:
    """Implements :class:`homeostat.agents.roles.Planning` without a model."""

    def __init__(self, plant: PlantDescription, grounding: Grounding, bounds: Bounds | None = None) -> None:
        """``grounding`` knows what faults take away, ``bounds`` what paths may cost; None for the least risky first."""
        self._plant, self._grounding, self._bounds = plant, grounding, bounds
        self._known: tuple[tuple[float, str], dict[tuple[str, ...], float]] | None = None

    async def plan(self, situation: Situation, advice: Advice) -> RecoveryPath:
        """The path that may cost least of those that were not refused yet; of equals the least risky."""
        paths = list(open_paths(self._plant, self._grounding, situation, advice))
        if not paths and self._nothing_is_open(situation):
            # Else it falls back for an explanation that hardly anybody believes; the twin judges by it all the same.
            paths = list(open_paths(self._plant, self._grounding, situation, advice, LIKELY))
        if not paths:
            raise NoAdmissiblePlan(self._exhausted(situation, advice))
        if is_away(self._plant, situation):
            # It is not what costs least that is looked for: a detour to another state may cost less for a while.
            home = [p for p in paths if p.target in self._plant.machine.ordinary]
            if not home and any(isinstance(a.verdict, Approve) for a in advice.attempts):
                raise NoAdmissiblePlan("the way back is approved, and nothing else is asked for")
            paths = home or paths
        if self._bounds is None:
            return paths[0]
        asked = situation.diagnosis.at_s, situation.state
        if self._known is None or self._known[0] != asked or any(p.commanded not in self._known[1] for p in paths):
            costs = await self._bounds(situation, paths)
            self._known = asked, {p.commanded: cost for p, cost in zip(paths, costs, strict=True)}
        known = self._known[1]
        path = min(paths, key=lambda p: known[p.commanded])
        least = known[path.commanded]
        approved = [a.cost.share for a in advice.attempts if isinstance(a.verdict, Approve) and a.cost is not None]
        if approved and least > min(approved) - SAME:
            raise NoAdmissiblePlan("no path that is left can cost less than what is approved")
        if situation.optional and situation.idle_cost is not None and least > situation.idle_cost.share - SAME:
            raise NoAdmissiblePlan("no path that is left can cost less than leaving the plant alone")
        return path

    def _nothing_is_open(self, situation: Situation) -> bool:
        """Whether something must be done, and what may be wrong leaves no path open at all."""
        every = open_paths(self._plant, self._grounding, situation, Advice())
        return situation.act_by_s is not None and next(every, None) is None

    def _exhausted(self, situation: Situation, advice: Advice) -> str:
        tried = ", ".join(sorted({states[-1] for states in advice.refused_paths}))
        present = ", ".join(plausible_faults(situation.diagnosis)) or "no fault"
        reason = f"no path from {situation.state!r} is open with {present}"
        return f"{reason}; targets refused: {tried}" if tried else reason


def open_paths(
    plant: PlantDescription, grounding: Grounding, situation: Situation, advice: Advice, least: float = PLAUSIBLE
) -> Iterator[RecoveryPath]:
    """The paths that guards and likely faults leave open and that were not refused yet, the least risky first.

    Where nothing is wrong, and the plant could stay where it is outside of ordinary operation, only those that lead
    back to it, or nearer to it: to a state of less risk, or to the same one once it was refused. ``least``: how
    probable a fault must be to take anything away [1].
    """
    faults = plausible_faults(situation.diagnosis, least)
    # Another way to the states that a path commands admits the same commands: it is refused, and offered, with it.
    passed = set(advice.refused_paths)
    values, lying = situation.snapshot.values, unreliable_tags(plant, faults)
    machine = plant.machine
    home = machine.ordinary
    back = is_away(plant, situation) and all(f.satisfied for f in situation.idle)
    first = back and not any(states[-1] in home for states in advice.refused_paths)
    still = {m.component for m in plant.fault_modes if m.name in faults and m.stands}  # the graph has no such fault
    for transitions in machine.paths(situation.state, values, machine.recovery_event, still, unreliable=lying):
        path = RecoveryPath(machine, transitions)
        if back and path.target not in home and not _nearer(machine, situation.state, path, first):
            continue
        if path.commanded not in passed and grounding.allows(path.states, faults):
            passed.add(path.commanded)
            yield path


def is_away(plant: PlantDescription, situation: Situation) -> bool:
    """Whether nothing is wrong, and the plant is outside of ordinary operation."""
    return not situation.diagnosis.faulty and situation.state not in plant.machine.ordinary


def _nearer(machine: StateMachine, here: str, path: RecoveryPath, first: bool) -> bool:
    """Whether a ``path`` leads to less risk; or to the state that the plant is in, where it is not the ``first``."""
    return machine.state(path.target).risk < machine.state(here).risk or (path.states == (here, here) and not first)


def unreliable_tags(plant: PlantDescription, faults: Collection[str]) -> frozenset[str]:
    """Tags that are measured by a component which one of ``faults`` disables."""
    disabled = {fault.disables for fault in plant.fault_modes if fault.name in faults}
    return frozenset(s.tag.name for s in plant.signals if s.relation is Relation.MEASURES and s.component in disabled)
