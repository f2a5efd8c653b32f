"""Planning by enumeration: the least risky guard-satisfying path that the fault leaves open."""

from __future__ import annotations

from homeostat.agents.crew import NoAdmissiblePlan, Situation
from homeostat.agents.grounding import Grounding
from homeostat.domain.advice import Advice
from homeostat.domain.behaviour import StateMachine
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.recovery import RecoveryPath

EVENT = "fault_diagnosed"
PLAUSIBLE = 0.05
"""A fault takes states and transitions away if it is at least this probable [1]."""


class SearchPlanning:
    """Implements :class:`homeostat.agents.crew.Planning` without a model."""

    def __init__(self, machine: StateMachine, grounding: Grounding) -> None:
        """``machine`` as the graph has it; ``grounding`` knows what faults take away."""
        self._machine = machine
        self._grounding = grounding

    async def plan(self, situation: Situation, advice: Advice) -> RecoveryPath:
        """The least risky path that was not refused yet."""
        faults = plausible_faults(situation.diagnosis)
        refused = {states[-1] for states in advice.refused_paths}
        for transitions in self._machine.paths(situation.state, situation.snapshot.values, EVENT, blocked=()):
            path = RecoveryPath(self._machine, transitions)
            # A path is refused for the state in which it ends: another way there admits the same commands.
            if path.target not in refused and self._grounding.allows(path.states, faults):
                return path
        tried = ", ".join(sorted(refused)) or "none"
        present = ", ".join(faults) or "no fault"
        raise NoAdmissiblePlan(f"no path from {situation.state!r} is open with {present}; targets refused: {tried}")


def plausible_faults(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Faults that the hypotheses make at least :data:`PLAUSIBLE`, sorted by name."""
    weight: dict[str, float] = {}
    for hypothesis in diagnosis.hypotheses:
        for fault in {f.fault for f in hypothesis.faults}:
            weight[fault] = weight.get(fault, 0.0) + hypothesis.probability
    return tuple(sorted(f for f, w in weight.items() if w >= PLAUSIBLE))
