"""Limits and criteria: what must hold, in the rule language, each with its source."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Self, TypeVar

from homeostat.stl.formula import Formula
from homeostat.stl.tightening import tightened

T = TypeVar("T")


class LimitKind(StrEnum):
    """What a limit does when it is violated."""

    TRIP_LIMIT = "trip limit"
    """The plant must be brought to a safe state."""
    PERMISSIVE = "permissive"
    """A command must not be released unless it holds."""
    ENVELOPE = "envelope"
    """The plant should be brought back inside."""


class Owner(StrEnum):
    """Which agent can cure a violated criterion."""

    PLANNING = "planning"
    ACTION = "action"


@dataclass(frozen=True, slots=True)
class Limit:
    """One trip limit, permissive or envelope of the plant."""

    name: str
    """Identifier in the cause-and-effect table."""
    kind: LimitKind
    """What it does when it is violated."""
    formula: Formula
    """What must hold at every moment."""
    hard: bool
    """Whether violating it latches the fallback."""
    source: str
    """Document and clause."""
    description: str
    """What it protects."""
    lead: float = 0.0
    """Margin that is left when a hard limit trips, in its unit; 0 where it trips at the limit itself."""
    by_hand: tuple[tuple[str, str], ...] = ()
    """Command of an actuator -> the manual output that overrides it, for each that a permissive's formula reads."""
    watched: Formula = field(init=False, compare=False, repr=False)
    """What trips where it fails: the formula, sooner by the lead."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.lead < math.inf:
            raise ValueError(f"limit {self.name!r}: lead {self.lead!r} must be finite and >= 0 {self.formula.unit}")
        object.__setattr__(self, "watched", tightened(self.formula, self.lead))

    def following(self, commanded: Mapping[str, T]) -> dict[str, T]:
        """``commanded`` (tag -> value), and what follows from it: by hand, an actuator's command is its manual output.

        A command that is itself in ``commanded`` stays as it is.
        """
        return {command: commanded[manual] for command, manual in self.by_hand if manual in commanded} | {**commanded}


@dataclass(frozen=True, slots=True)
class Criterion:
    """One acceptance criterion of a rollout, judged from the moment of release on."""

    name: str
    """Identifier."""
    owner: Owner
    """Which agent can cure its violation."""
    formula: Formula
    """What the rollout must satisfy."""
    hard: bool
    """Whether it protects the plant (True) or the quality of the recovery (False)."""
    source: str
    """Document and clause."""
    description: str
    """What it asks for."""
    asks_after_s: float | None = None
    """Over so long a time a plant in which nothing is wrong may miss it on the mean before proposers are asked for an
    improvement [s]; None: for ever."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Everything that must hold, in one place: the twin's validation and the guard read the same object."""

    limits: tuple[Limit, ...]
    """Trip limits, permissives and envelopes."""
    criteria: tuple[Criterion, ...]
    """Acceptance criteria."""

    def with_manual(self, overridden: Mapping[str, str]) -> Self:
        """The same with what each permissive has to know of manual outputs (manual output -> command; tags)."""

        def told(limit: Limit) -> Limit:
            read = tuple((c, m) for m, c in sorted(overridden.items()) if c in limit.formula.tags)
            return replace(limit, by_hand=read) if limit.kind is LimitKind.PERMISSIVE and read else limit

        return replace(self, limits=tuple(map(told, self.limits)))

    def of_kind(self, kind: LimitKind) -> tuple[Limit, ...]:
        """The limits of one kind, in table order."""
        return tuple(limit for limit in self.limits if limit.kind is kind)

    @property
    def hard(self) -> tuple[Limit, ...]:
        """The limits that latch the fallback."""
        return tuple(limit for limit in self.limits if limit.hard)

    @property
    def watched(self) -> Self:
        """The same with each limit where it trips: what does not keep these is ended by the guard.

        Whatever goes on without a fallback is judged by them; a fallback, which acts once one has failed, by limits.
        """
        if not any(limit.lead for limit in self.limits):
            return self
        return replace(self, limits=tuple(replace(x, formula=x.watched, lead=0.0) for x in self.limits))

    @property
    def forbidding(self) -> tuple[tuple[Criterion, ...], tuple[Limit, ...]]:
        """The criteria and limits that must hold for anything to be released; the others have a price."""
        soft = [limit for limit in self.of_kind(LimitKind.ENVELOPE) if not limit.hard]
        return tuple(c for c in self.criteria if c.hard), tuple(x for x in self.limits if x not in soft)

    @property
    def asking(self) -> tuple[Criterion, ...]:
        """The criteria that ask for an improvement where they are missed for long."""
        return tuple(c for c in self.criteria if c.asks_after_s is not None)

    @property
    def priced(self) -> tuple[Criterion | Limit, ...]:
        """The criteria and envelopes that may be missed, at their price."""
        envelopes = [limit for limit in self.of_kind(LimitKind.ENVELOPE) if not limit.hard]
        return (*(c for c in self.criteria if not c.hard), *envelopes)
