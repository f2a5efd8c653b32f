"""Planning by enumeration: the least risky guard-satisfying path that the fault leaves open."""

from collections.abc import Collection, Iterator

from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.hypotheses import likely_faults
from homeostat.agents.roles import NoAdmissiblePlan, Situation
from homeostat.domain.advice import Advice
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.recovery import RecoveryPath


class SearchPlanning:
    """Implements :class:`homeostat.agents.roles.Planning` without a model."""

    def __init__(self, plant: PlantDescription, grounding: Grounding) -> None:
        """``plant`` as the graph has it; ``grounding`` knows what faults take away."""
        self._plant = plant
        self._grounding = grounding

    async def plan(self, situation: Situation, advice: Advice) -> RecoveryPath:
        """The least risky path that was not refused yet."""
        faults = likely_faults(situation.diagnosis)
        for path in open_paths(self._plant, self._grounding, situation, advice):
            return path
        tried = ", ".join(sorted({states[-1] for states in advice.refused_paths}))
        present = ", ".join(faults) or "no fault"
        reason = f"no path from {situation.state!r} is open with {present}"
        raise NoAdmissiblePlan(f"{reason}; targets refused: {tried}" if tried else reason)


def open_paths(
    plant: PlantDescription, grounding: Grounding, situation: Situation, advice: Advice
) -> Iterator[RecoveryPath]:
    """The paths that guards and likely faults leave open and that were not refused yet, the least risky first."""
    faults = likely_faults(situation.diagnosis)
    # A path is refused for the states that it commands: another way to them admits the same commands.
    refused = set(advice.refused_paths)
    values, lying = situation.snapshot.values, unreliable_tags(plant, faults)
    machine = plant.machine
    for transitions in machine.paths(situation.state, values, machine.recovery_event, blocked=(), unreliable=lying):
        path = RecoveryPath(machine, transitions)
        if path.commanded not in refused and grounding.allows(path.states, faults):
            yield path


def unreliable_tags(plant: PlantDescription, faults: Collection[str]) -> frozenset[str]:
    """Tags that are measured by a component which one of ``faults`` disables."""
    disabled = {fault.disables for fault in plant.fault_modes if fault.name in faults}
    return frozenset(s.tag.name for s in plant.signals if s.relation is Relation.MEASURES and s.component in disabled)
