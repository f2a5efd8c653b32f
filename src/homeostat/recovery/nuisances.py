"""Nuisances: permissives and guards that refuse now and, as the twin shows, not any more in a little while."""

import asyncio
from collections.abc import Iterator, Sequence

from homeostat.agents.hypotheses import plausible_faults
from homeostat.agents.roles import Agents, Situation
from homeostat.agents.search.candidates import design_commands
from homeostat.domain.advice import Attempt
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Revise
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


class Nuisances:
    """Adds the wait after which a refused proposal, or a closed way, may be taken."""

    def __init__(self, scene: Scene, agents: Agents, rules: PlantRules, judging: Judging) -> None:
        """``judging`` says whether it may be waited, and what that costs."""
        self._scene, self._grounding, self._rules, self._judging = scene, agents.grounding, rules, judging

    async def add_to(
        self, alternatives: Alternatives, situation: Situation, tried: Sequence[Attempt], end: float
    ) -> None:
        """Try a few waits; until ``end``, by the event loop's clock [s]."""
        found = [*self._refused(tried), *self._closed(situation)][:MOST]
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

    def _refused(self, tried: Sequence[Attempt]) -> Iterator[tuple[Follow, tuple[str, ...]]]:
        """Proposals that nothing but permissives refuses, each with their names."""
        permissives = {x.name for x in self._rules.limits.limits if x.kind is LimitKind.PERMISSIVE}
        for a in tried:
            if not isinstance(a.verdict, Revise) or a.path is None or a.actions is None or not a.members:
                continue
            names = tuple(dict.fromkeys(f.criterion for f in a.verdict.violated))
            if names and set(names) <= permissives and not a.seconds:
                yield Follow.of(a.actions, a.path), names

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
