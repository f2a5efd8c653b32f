"""The agents' roles: six protocols, and the agents that fill them."""

from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, TypeAlias

from homeostat.agents.certificates import Course
from homeostat.agents.grounding.grounding import Grounding
from homeostat.agents.reliance import Relying
from homeostat.domain.advice import Advice, Attempt, Sensitivity
from homeostat.domain.alternative import Alternative
from homeostat.domain.cost import Cost
from homeostat.domain.diagnosis import Diagnosis, Symptom
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy, RecoveryPath
from homeostat.domain.remark import Remark
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Finding, Resolution, Revise, Rollout, Verdict
from homeostat.twin.twin import Interruption


class AskingProtocol(StrEnum):
    """When proposers are asked, and for how much."""

    ROUTE = "route"
    """When something is wrong, for everything that is to follow."""
    PER_STEP = "per-step"
    """In every state that the plant enters, a language model for the next step only."""


class NoAdmissiblePlan(Exception):
    """Nothing is left to propose; the message says what was tried."""


@dataclass(frozen=True, slots=True)
class Probe:
    """A test move or a wait: what it should tell apart, what that is worth and what it costs."""

    actions: ActionSet
    """What is commanded; what follows anyway where it is a wait."""
    path: RecoveryPath | None
    """The path that it takes; None for a wait."""
    apart: tuple[str, str]
    """The two explanations between which most is at stake, the likelier one first."""
    nats: float
    """Expected evidence between these two [nats]."""
    value: float
    """Production that is expected to be won by knowing more, as a fraction of the design rate [1]."""
    cost: float
    """Production that is expected to be lost meanwhile, and what moving costs [1]."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What a proposer is asked about."""

    snapshot: Snapshot
    """The plant now."""
    diagnosis: Diagnosis
    """What is wrong, by probability."""
    state: str
    """State of the supervisory state machine."""
    recent: tuple[Snapshot, ...] = ()
    """The last minutes, the oldest first."""
    idle: tuple[Finding, ...] = ()
    """Every check on what happens without action: on what forbids."""
    deadline_s: float = 0.0
    """Process time that is left for thinking [s]."""
    rest: RecoveryPath | None = None
    """What follows if nobody interferes; None where the plant stays in its state."""
    under_way: tuple[Command, ...] = ()
    """Commands that were sent and that the readings do not show yet."""
    idle_cost: Cost | None = None
    """What it costs to do nothing; None where that is not known."""
    optional: bool = False
    """Whether nothing need be done: what cannot cost less than doing nothing is not worth a proposal."""
    act_by_s: float | None = None
    """Process time by which something must be done, or the guard falls back; None for no such time [s]."""
    fallback: FallbackStrategy | None = None
    """What acts where nothing else may be done; None where that is not known."""
    tests: tuple[Probe, ...] = ()
    """Test moves that are on offer, the best first."""
    earlier: tuple[str, ...] = ()
    """What was decided before in the same run, one line each, the oldest first."""
    notes: tuple[str, ...] = ()
    """What people have noted, the latest first; data, and no order."""
    best: Alternative | None = None
    """The cheapest of what may be done so far, whoever proposed it; None where nothing may."""


@dataclass(frozen=True, slots=True)
class Wait:
    """Nothing is to be released now; the plant is looked at again after a while."""

    seconds: float
    """How long [s]."""


@dataclass(frozen=True, slots=True)
class Hold:
    """A path is to be taken for a while only."""

    path: RecoveryPath
    """The path."""
    seconds: float
    """How long [s]."""


Plan: TypeAlias = RecoveryPath | Hold | Wait | Probe
"""What planning may propose: a path for good or for a while, a wait, one of the tests that are on offer."""


@dataclass(frozen=True, slots=True)
class Approved:
    """What deliberation found."""

    actions: ActionSet
    """The action set."""
    path: RecoveryPath
    """The path that it takes."""
    approval: Approve
    """Its approval."""
    proposer: str
    """Who proposed it."""
    cost: Cost
    """What it is expected to cost."""
    polished: bool = False
    """Whether the search bettered the numbers of whoever proposed it."""
    ended: Interruption | None = None
    """What ends it where it is released for a while only; None where it is to last."""
    for_s: float = 0.0
    """How long it is held before the plant is looked at again [s]; 0 where it is to last."""
    beside: ActionSet | None = None
    """The fallback that it is no worse than, where some explanation violates a limit whatever is done; else None."""
    instead: tuple[ActionSet, ...] = ()
    """Leaving the plant alone, and falling back: it must not count more than these on what nobody has seen move."""


class Monitoring(Protocol):
    """Watches the plant."""

    def notices(self, snapshot: Snapshot) -> bool:
        """Take one more snapshot; whether something needs to be explained now."""
        ...

    @property
    def symptoms(self) -> tuple[Symptom, ...]:
        """The symptoms that are active now."""
        ...

    def diagnose(self, deviates: bool = False) -> Diagnosis:
        """What is wrong now; ``deviates``: the batch does not go as predicted, whatever the symptoms say."""
        ...

    def follow(self, outcome: Resolution) -> None:
        """Take note of what was done about the last diagnosis."""
        ...


class Planning(Protocol):
    """Proposes a path through the state machine."""

    async def plan(self, situation: Situation, advice: Advice) -> Plan | Revise:
        """What to try, or why the answer is nothing; NoAdmissiblePlan where nothing is left."""
        ...


class Action(Protocol):
    """Turns a path into commands."""

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet | Revise:
        """Commands that take the path, or why the answer has none; NoAdmissiblePlan where nothing is left."""
        ...


class Polishing(Protocol):
    """Betters the numbers of somebody else's proposal."""

    async def polish(self, situation: Situation, path: RecoveryPath, actions: ActionSet) -> ActionSet:
        """The cheapest near ``actions`` on the same ``path``; themselves where nothing is."""
        ...

    async def tracked(self, situation: Situation, path: RecoveryPath, actions: ActionSet) -> ActionSet:
        """``actions`` by which no controller of a stuck actuator winds up; themselves where none would."""
        ...


class Simulation(Protocol):
    """Tries action sets on the twin."""

    def observe(self, snapshots: tuple[Snapshot, ...]) -> None:
        """Bring the twin up to the present."""
        ...

    def instrument_errors(self, diagnosis: Diagnosis) -> tuple[Mapping[str, float], ...]:
        """Tag -> reading minus truth under each likely hypothesis; small calibration errors are left out."""
        ...

    async def roll_out(self, diagnosis: Diagnosis, actions: ActionSet, ended: Interruption | None = None) -> Rollout:
        """What ``actions`` would do from the present on, until they are ``ended``, under every plausible hypothesis."""
        ...

    async def relied_on(self, diagnosis: Diagnosis, asked: Relying, rollout: Rollout) -> tuple[Finding, ...]:
        """Why what is ``asked``, which does what ``rollout`` says, counts on actuators that nobody has seen move."""
        ...

    def violations(self, diagnosis: Diagnosis, courses: Sequence[Course], draws: int) -> AsyncIterator[int | None]:
        """How many of so many ``draws``, the same for all and seen by nobody, count against each of the ``courses``.

        One after the other; None for one whose rollout does not come to its end.
        """
        ...

    async def sensitivities(
        self, diagnosis: Diagnosis, actions: ActionSet, states: Sequence[State], criteria: Sequence[str]
    ) -> tuple[Sensitivity, ...]:
        """How the margins of ``criteria`` change with each command that ``states``, one per step, leave open."""
        ...


class Probing(Protocol):
    """Looks for what would tell explanations apart that call for different answers."""

    async def probes(self, situation: Situation, idle: ActionSet, seconds: float) -> tuple[Probe, ...]:
        """Probes of so many ``seconds`` that are worth more than they cost, the best first.

        ``idle`` is what follows if nobody interferes.
        """
        ...

    async def try_out(self, probe: Probe, diagnosis: Diagnosis, ended: Interruption) -> Rollout:
        """What ``probe`` does until it is ``ended``, and what follows, under every plausible hypothesis."""
        ...


class Validation(Protocol):
    """Judges rollouts."""

    def judge(self, actions: ActionSet, rollout: Rollout, target: State, path: RecoveryPath | None = None) -> Verdict:
        """Approve only if every criterion holds in every member; ``path`` leads to ``target`` step by step."""
        ...


class Reprompting(Protocol):
    """Says what the next attempt must cure, and who must cure it."""

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        """Advice for the next attempt; NoAdmissiblePlan where another one is pointless."""
        ...


class Remarks(Protocol):
    """Keeps what is said besides proposals until recovery asks for it."""

    def drain(self) -> tuple[Remark, ...]:
        """What was said since it was asked last, in order."""
        ...


@dataclass(frozen=True, slots=True)
class Proposer:
    """Someone who proposes; interchangeable, asked in a fixed order."""

    name: str
    """Who acts: ``search`` or ``language``."""
    planning: Planning
    """Proposes paths."""
    action: Action
    """Proposes commands."""
    reprompting: Reprompting
    """Says what the next attempt must cure."""
    attempts: int = 12
    """Most proposals in one recovery."""
    improves: bool = False
    """Whether it is asked as well where the plant does what is asked of it by itself, but might do better."""
    thorough: bool = False
    """Whether it goes on to other paths once something of it is approved, as long as they may cost less; another one
    stops once the cheapest of the list is its own."""
    remarks: Remarks | None = None
    """What it says besides; None where it says nothing."""


@dataclass(frozen=True, slots=True)
class Agents:
    """Everyone who takes part in a recovery."""

    monitoring: Monitoring
    """Watches."""
    proposers: tuple[Proposer, ...]
    """In the order in which they are asked."""
    simulation: Simulation
    """Tries."""
    validation: Validation
    """Judges."""
    grounding: Grounding
    """Asks the knowledge graph for all of them."""
    probing: Probing | None = None
    """Looks for test moves and waits; None where nothing is done only to learn something."""
    polishing: Polishing | None = None
    """Betters the numbers of proposers that are not thorough; None where each stands for itself."""
