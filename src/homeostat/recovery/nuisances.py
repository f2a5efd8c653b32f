"""Nuisances: permissives and guards that refuse now and, as the twin shows, not any more in a little while.

A permissive that alone keeps a cheaper proposal from being released is named in the list whether it clears or not:
whoever sees the plant may know why it forbids what the twin finds safe.
"""

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from homeostat.agents.certificates import Course
from homeostat.agents.hypotheses import plausible_faults
from homeostat.agents.roles import Agents, Situation
from homeostat.agents.search.candidates import design_commands
from homeostat.domain.advice import Attempt
from homeostat.domain.alternative import Alternative, AlternativeKind
from homeostat.domain.cost import Cost
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Finding, Revise
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.judging import Follow, Judging
from homeostat.recovery.plant_rules import PlantRules
from homeostat.recovery.scene import Scene

OFFERED_S = (60.0, 180.0, 300.0)
"""Waits that are tried, the shortest first, by the reference [s]."""
MOST = 3
"""Most refused proposals and closed ways that are waited for in one recovery."""
PROPOSER = "search"
"""Who proposes these waits."""


@dataclass(frozen=True, slots=True)
class _Barred:
    """A proposal that permissives alone refuse."""

    path: RecoveryPath
    """Its path."""
    actions: ActionSet
    """What it commands."""
    cost: Cost
    """What it is expected to cost."""
    proposer: str
    """Who proposed it."""
    violated: tuple[Finding, ...]
    """What the permissives say."""
    names: tuple[str, ...]
    """What they are called."""

    @property
    def follow(self) -> Follow:
        """The same after a wait."""
        return Follow.of(self.actions, self.path)

    @property
    def line(self) -> Alternative:
        """Its line in the list."""
        said = min(self.violated, key=lambda f: f.margin).message
        reason = f"nothing but {' and '.join(self.names)} refuses it: {said}"
        name, digest = " > ".join(self.path.states), self.actions.digest
        return Alternative(AlternativeKind.RELEASE, name, self.cost, reason, self.proposer, digest)


class Nuisances:
    """Adds the wait after which what is refused or closed may be taken, and names what permissives alone refuse."""

    def __init__(self, scene: Scene, agents: Agents, rules: PlantRules, judging: Judging) -> None:
        """``judging`` says whether it may be waited, and what that costs."""
        self._scene, self._grounding, self._rules, self._judging = scene, agents.grounding, rules, judging

    async def add_to(
        self, alternatives: Alternatives, situation: Situation, tried: Sequence[tuple[str, Attempt]], end: float
    ) -> None:
        """Name what permissives alone refuse, and try a few waits; until ``end``, by the event loop's clock [s].

        Where nothing can cost less than what is approved, nothing is waited for.
        """
        refused = list(self._refused(tried))
        for barred in refused:
            alternatives.bar(barred.line, Course(barred.actions))
        if (worth := alternatives.worth()) is not None and worth.gain <= 0.0:
            return
        found = [*((each.follow, each.names) for each in refused), *self._closed(situation)][:MOST]
        try:
            async with asyncio.timeout_at(self._scene.cut(end)):
                for follow, nuisance in found:
                    await self._try(alternatives, situation, follow, nuisance)
        except TimeoutError:
            return

    async def _try(
        self, alternatives: Alternatives, situation: Situation, follow: Follow, nuisance: tuple[str, ...]
    ) -> None:
        for seconds in self._rules.timing.times_s(OFFERED_S):
            judged = await self._judging.wait(PROPOSER, 1, situation, seconds, follow, nuisance)
            if judged.found is not None:
                self._scene.record(Attempted.of(PROPOSER, judged.attempt))
                alternatives.add(judged.found)
                return
            if not judged.attempt.members:  # there is no time for this wait, nor for a longer one
                return

    def _refused(self, tried: Sequence[tuple[str, Attempt]]) -> Iterator[_Barred]:
        """Proposals that nothing but permissives refuses, each with their names."""
        permissives = {x.name for x in self._rules.limits.limits if x.kind is LimitKind.PERMISSIVE}
        for by, a in tried:
            if not isinstance(a.verdict, Revise) or a.path is None or a.actions is None or not a.members:
                continue
            names = tuple(dict.fromkeys(f.criterion for f in a.verdict.violated))
            if names and set(names) <= permissives and not a.seconds and a.cost is not None:
                yield _Barred(a.path, a.actions, a.cost, by, a.verdict.violated, names)

    def _closed(self, situation: Situation) -> Iterator[tuple[Follow, tuple[str, ...]]]:
        """Decisions whose guard does not hold now, as by design, each with the name of its transition."""
        machine: StateMachine = self._rules.machine
        faults = plausible_faults(situation.diagnosis)
        for t in machine.transitions:
            usual = t.source == situation.state and t.on_decision and t.event == machine.recovery_event
            target = machine.state(t.target)
            if not usual or not target.recovery_target or t.guard.holds(situation.snapshot.values):
                continue
            path = RecoveryPath(machine, (t,))
            if self._grounding.allows(path.states, faults):
                actions = ActionSet(design_commands(target, self._rules.tags), target.name)
                yield Follow.of(actions, path), (t.name,)
