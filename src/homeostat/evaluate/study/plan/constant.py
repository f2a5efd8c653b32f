"""The same answer to every fault: what a recovery is worth that does not look at the plant."""

from collections.abc import Mapping
from dataclasses import replace

from homeostat.agents.roles import NoAdmissiblePlan, Proposer, Situation
from homeostat.agents.search.candidates import design_commands
from homeostat.agents.search.planning import SearchPlanning
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.plant.state_machine import State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath
from homeostat.plants.wired.assembly import Workbench

NAME = "constant"
"""Who acts where a constant answer is released."""


class ConstantAction:
    """Implements :class:`homeostat.agents.roles.Action` with values that were written down beforehand."""

    def __init__(self, values: Mapping[str, float], tags: Mapping[str, Tag]) -> None:
        """``values``: tag -> what is commanded wherever a state leaves it open; design values where it is not named."""
        self._values = values
        self._tags = tags

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet:
        """The same commands as ever, on ``path``."""
        return ActionSet.along(path, self._commands)

    def _commands(self, state: State) -> tuple[Command, ...]:
        spans = {r.tag: (r.low, r.high) for r in state.open_setpoints if r.tag in self._values}
        design = {command.tag: command for command in design_commands(state, self._tags)}
        for tag in design.keys() & spans.keys():
            low, high = spans[tag]
            design[tag] = replace(design[tag], value=min(max(self._values[tag], low), high))
        return tuple(design.values())


class NoReprompting:
    """Implements :class:`homeostat.agents.roles.Reprompting`: goes on to the next path, with the same commands."""

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        """The path was refused; NoAdmissiblePlan where there was none."""
        if attempt.path is None:
            raise NoAdmissiblePlan(f"{NAME}: nothing else is ever proposed")
        return Advice(refused_paths=(*before.refused_paths, attempt.path.commanded))


def constant_proposer(bench: Workbench, values: Mapping[str, float]) -> Proposer:
    """The proposer that always commands ``values`` (tag -> value), on the least risky path that is left."""
    d = bench.plant.description
    return Proposer(NAME, SearchPlanning(d, bench.grounding), ConstantAction(values, d.tags_by_name), NoReprompting())
