"""Planning by enumeration: the least risky guard-satisfying path that the fault leaves open."""

from __future__ import annotations

from homeostat.agents.crew import NoAdmissiblePlan, Situation
from homeostat.domain.behaviour import StateMachine
from homeostat.domain.diagnosis import Diagnosis, Fault
from homeostat.domain.recovery import RecoveryPath
from homeostat.domain.verdict import Advice

EVENT = "fault_diagnosed"
PLAUSIBLE = 0.05
"""A component counts as disabled if the faults that disable it are at least this probable."""


class SearchPlanning:
    """Implements :class:`homeostat.agents.crew.Planning` without a model."""

    def __init__(self, machine: StateMachine, faults: tuple[Fault, ...]) -> None:
        """``machine`` and ``faults`` as the graph has them."""
        self._machine = machine
        self._disables = {f.name: f.disables for f in faults}

    async def plan(self, situation: Situation, advice: Advice) -> RecoveryPath:
        """The least risky path that was not refused yet."""
        blocked = self.blocked(situation.diagnosis)
        refused = {states[-1] for states in advice.refused_paths}
        paths = self._machine.paths(situation.state, situation.snapshot.values, EVENT, blocked)
        for transitions in paths:
            path = RecoveryPath(self._machine, transitions)
            # A path is refused for the state in which it ends: another way there admits the same commands.
            if path.target not in refused:
                return path
        tried = ", ".join(sorted(refused)) or "none"
        reason = f"no path from {situation.state!r} is open (blocked: {', '.join(sorted(blocked)) or 'nothing'}"
        raise NoAdmissiblePlan(f"{reason}; target states refused: {tried})")

    def blocked(self, diagnosis: Diagnosis) -> frozenset[str]:
        """Components that a plausible fault disables."""
        weight: dict[str, float] = {}
        for hypothesis in diagnosis.hypotheses:
            for component in {self._disables[f.fault] for f in hypothesis.faults} - {None}:
                assert component is not None
                weight[component] = weight.get(component, 0.0) + hypothesis.probability
        return frozenset(c for c, w in weight.items() if w >= PLAUSIBLE)
