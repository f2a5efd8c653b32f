"""Choices: what may be done besides releasing for good: a wait, and a test move; a hold is a release with a time."""

from dataclasses import dataclass
from typing import TypeAlias

from homeostat.agents.certificates import Course
from homeostat.agents.roles import Approved, Probe
from homeostat.domain.cost import Cost
from homeostat.domain.recovery import ActionSet, FallbackStrategy
from homeostat.domain.verdict import Approve
from homeostat.twin.twin import Interruption


@dataclass(frozen=True, slots=True)
class Waiting:
    """Nothing is released; the plant is looked at again after a while."""

    seconds: float
    """How long [s]."""
    follows: str
    """What is expected to follow: the path of a proposal, or the name of a fallback."""
    digest: str
    """What it is known by: made of its length and of what is to follow."""
    approval: Approve
    """The judgement of the wait with what follows."""
    proposer: str
    """Who proposed it."""
    cost: Cost
    """What both parts are expected to cost."""
    ended: Interruption
    """What follows, and when."""
    beside: ActionSet | None = None
    """The fallback, where it violates a limit even at once; None where it keeps them all."""
    nuisance: tuple[str, ...] = ()
    """Permissives and guards that refuse what follows now and will not then; empty where it is waited for another
    reason."""


@dataclass(frozen=True, slots=True)
class Admitted:
    """A probe that is safe."""

    probe: Probe
    retreat: FallbackStrategy
    """What ends it if nobody answers."""
    ended: Interruption
    """When, and how."""
    verdict: Approve


@dataclass(frozen=True, slots=True)
class Testing:
    """A test move that stands in the list."""

    admitted: Admitted
    """The move, and what ends it for sure."""
    proposer: str
    """Who proposed it."""
    cost: Cost
    """What it is expected to cost with what follows, less what knowing more is worth."""
    seconds: float
    """How long it lasts [s]."""


Choice: TypeAlias = Approved | Waiting | Testing
"""What may be chosen from the list of a recovery."""


def course(found: Choice, rest: ActionSet) -> Course:
    """What is commanded where it is chosen; ``rest`` is what goes on while nothing is."""
    match found:
        case Waiting():
            return Course(rest, found.ended, found.beside)
        case Testing():
            return Course(found.admitted.probe.actions, found.admitted.ended)
        case Approved():
            return Course(found.actions, found.ended, found.beside)
