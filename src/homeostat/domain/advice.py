"""What one attempt teaches the next."""

import math
from dataclasses import dataclass
from typing import Final

from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.plant.limits import Owner
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Finding, Verdict

COST: Final = "COST"
"""Stands for the cost where sensitivities are asked for."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """One proposal, as far as it got, and the verdict on it."""

    number: int
    """Number of the attempt, from 1."""
    path: RecoveryPath | None
    """The path; None where planning's answer was none."""
    actions: ActionSet | None
    """The action set; None where there was no path, it closed meanwhile, or action's answer was no action set."""
    verdict: Verdict
    """The judgement; a refusal where path or action set is missing or was proposed before."""
    members: int = 0
    """Members of the rollout; 0 where nothing was rolled out."""
    cost: Cost | None = None
    """What it is expected to cost; None where nothing was rolled out."""
    polished: bool = False
    """Whether the search bettered the numbers of whoever proposed it."""
    kind: AlternativeKind = AlternativeKind.RELEASE
    """Whether it is to last, or a wait, a hold or a test. A wait has no path, and what goes on anyway for commands."""
    seconds: float = 0.0
    """How long it lasts before the plant is looked at again [s]; 0 for what is to last."""
    hypotheses: tuple[Hypothesis, ...] = ()
    """What the members of the rollout follow, as many members each, in this order."""

    def under(self, member: int) -> Hypothesis | None:
        """The hypothesis that ``member`` of the rollout follows; None where that is not known."""
        if not self.hypotheses or not 0 <= member < self.members:
            return None
        return self.hypotheses[member * len(self.hypotheses) // self.members]


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How the margin of a criterion, or the cost, changes with one command, near the last attempt."""

    criterion: str
    """Name of the criterion or limit; :data:`COST` for the cost."""
    tag: str
    """Tag that is commanded."""
    slope: float
    """Change of the worst member's margin, or of the cost, per unit of the tag, in its unit per the tag's unit."""
    low: float = -math.inf
    """Least value of the tag at which it was looked at [the tag's unit]."""
    high: float = math.inf
    """Largest one [the tag's unit]."""


@dataclass(frozen=True, slots=True)
class Advice:
    """What reprompting says to the next attempt."""

    findings: tuple[Finding, ...] = ()
    """What the last attempt violated."""
    route: Owner = Owner.PLANNING
    """Who should change something: planning the path, or action the commands on the same path."""
    keep_path: RecoveryPath | None = None
    """The path to keep, where the route is action."""
    tries: int = 0
    """Attempts on that path so far."""
    refused_paths: tuple[tuple[str, ...], ...] = ()
    """What was tried and cannot be cured: the states that a path commands."""
    required: tuple[tuple[str, float], ...] = ()
    """Criterion -> margin that the next proposal should show on its own rollouts, in the criterion's unit."""
    attempts: tuple[Attempt, ...] = ()
    """Every earlier attempt, in order."""
    sensitivities: tuple[Sensitivity, ...] = ()
    """How the violated margins change with each command."""
    hint: str = ""
    """What to change, in one or two sentences; data, not an order."""
    keep_s: float = 0.0
    """How long what is proposed on that path is to be held [s]; 0 where it is to last."""
