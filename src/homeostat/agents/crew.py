"""The agents' roles: six protocols, and the crew that fills them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from homeostat.agents.grounding import Context, Grounding
from homeostat.domain.behaviour import State
from homeostat.domain.diagnosis import Diagnosis, Symptom
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Advice, Finding, Outcome, Rollout, Verdict


class NoAdmissiblePlan(Exception):
    """Nothing is left to propose; the message says what was tried."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What a proposer is asked about."""

    snapshot: Snapshot
    """The plant now."""
    diagnosis: Diagnosis
    """What is believed to be wrong."""
    state: str
    """State of the supervisory state machine."""
    context: Context
    """What the graph says about it."""


class Monitoring(Protocol):
    """Watches the plant."""

    def notices(self, snapshot: Snapshot) -> bool:
        """Take one more snapshot; whether something needs to be explained now."""
        ...

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """The symptoms that are active now."""
        ...

    def diagnose(self) -> Diagnosis:
        """What is believed now."""
        ...

    def follow(self, outcome: Outcome) -> None:
        """Take note of what was done about the last diagnosis."""
        ...


class Planning(Protocol):
    """Proposes a path through the state machine."""

    async def plan(self, situation: Situation, advice: Advice) -> RecoveryPath:
        """A path to try; NoAdmissiblePlan where none is left."""
        ...


class Action(Protocol):
    """Turns a path into commands."""

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet:
        """Commands that take the path."""
        ...


class Simulation(Protocol):
    """Tries action sets on the twin."""

    def observe(self, snapshots: tuple[Snapshot, ...]) -> None:
        """Bring the twin up to the present."""
        ...

    def instrument_errors(self, diagnosis: Diagnosis) -> tuple[Mapping[str, float], ...]:
        """Tag -> reading minus truth under each plausible hypothesis; small calibration errors are left out."""
        ...

    async def roll_out(self, diagnosis: Diagnosis, actions: ActionSet) -> Rollout:
        """What ``actions`` would do from the present on, under every plausible hypothesis."""
        ...


class Validation(Protocol):
    """Judges rollouts."""

    def judge(self, actions: ActionSet, rollout: Rollout, target: State) -> Verdict:
        """Approve only if every criterion holds in every member."""
        ...


class Reprompting(Protocol):
    """Says what the next attempt must cure, and who must cure it."""

    def advise(self, path: RecoveryPath, verdict: Verdict, before: Advice) -> Advice:
        """Advice for the next attempt."""
        ...

    def relative(self, finding: Finding) -> float:
        """The finding's margin in scales of its unit [1]."""
        ...


@dataclass(frozen=True, slots=True)
class Proposer:
    """Someone who proposes; interchangeable, ranked by the crew."""

    name: str
    """Who acts: ``search`` or ``language``."""
    planning: Planning
    """Proposes paths."""
    action: Action
    """Proposes commands."""


@dataclass(frozen=True, slots=True)
class Crew:
    """Everyone who takes part in a recovery."""

    monitoring: Monitoring
    """Watches."""
    proposers: tuple[Proposer, ...]
    """In the order in which they are asked."""
    simulation: Simulation
    """Tries."""
    validation: Validation
    """Judges."""
    reprompting: Reprompting
    """Advises."""
    grounding: Grounding
    """Asks the knowledge graph for all of them."""
