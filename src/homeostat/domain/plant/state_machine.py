"""The plant's supervisory state machine (UML) and the paths through it."""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from homeostat.stl.formula import Formula


@dataclass(frozen=True, slots=True)
class SetpointRange:
    """What a state admits for one commandable tag."""

    tag: str
    """Tag that may be commanded in this state."""
    low: float
    """Least admissible value, in the tag's unit."""
    high: float
    """Largest admissible value, in the tag's unit."""
    design: float | None
    """Value by design; None for 'automatic' (manual outputs)."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low <= self.high):
            raise ValueError(
                f"setpoint range of {self.tag!r} [{self.low!r}, {self.high!r}] must be finite, low <= high"
            )


@dataclass(frozen=True, slots=True)
class State:
    """One state of the machine."""

    name: str
    """Identifier."""
    label: str
    """In the operator's words."""
    risk: int
    """Rank of undesirability; 0 is normal operation."""
    initial: bool
    """Whether the plant starts here."""
    recovery_target: bool
    """Whether a recovery may end here."""
    settled_when: Formula
    """What holds once the state is reached."""
    requires: frozenset[str]
    """Components that must be reliable in this state."""
    setpoints: tuple[SetpointRange, ...]
    """What may be commanded in this state."""

    def setpoint(self, tag: str) -> SetpointRange | None:
        """What this state admits for ``tag``; None where it may not be commanded."""
        return next((s for s in self.setpoints if s.tag == tag), None)

    @property
    def open_setpoints(self) -> tuple[SetpointRange, ...]:
        """What this state leaves a choice about."""
        return tuple(s for s in self.setpoints if s.high > s.low)


@dataclass(frozen=True, slots=True)
class Transition:
    """One transition of the machine."""

    name: str
    """Identifier."""
    source: str
    """State it leaves."""
    target: str
    """State it enters."""
    event: str
    """Event that triggers it."""
    guard: Formula
    """What must hold when it is taken."""
    on_decision: bool = True
    """Whether somebody has to decide on it; otherwise it is taken as soon as its guard holds (UML change event)."""


@dataclass(frozen=True, slots=True)
class StateMachine:
    """States and transitions; names are unique and every transition joins known states."""

    name: str
    """Identifier."""
    states: tuple[State, ...]
    """The states."""
    transitions: tuple[Transition, ...]
    """The transitions."""
    recovers_on: str = ""
    """Event on which recoveries are decided, where the machine begins elsewhere than by design; empty: what follows."""

    def __post_init__(self) -> None:
        names = {s.name for s in self.states}
        if len(names) != len(self.states):
            raise ValueError(f"state machine {self.name!r}: state names are not unique")
        if len({t.name for t in self.transitions}) != len(self.transitions):
            raise ValueError(f"state machine {self.name!r}: transition names are not unique")
        for t in self.transitions:
            for end in (t.source, t.target):
                if end not in names:
                    raise ValueError(f"state machine {self.name!r}: transition {t.name!r} joins unknown state {end!r}")
        if sum(s.initial for s in self.states) != 1:
            raise ValueError(f"state machine {self.name!r}: exactly one state must be initial")

    @property
    def initial(self) -> State:
        """The state in which the plant starts."""
        return next(s for s in self.states if s.initial)

    @property
    def recovery_event(self) -> str:
        """Event on which recoveries are decided; ``""`` where none is.

        It is that of the decisions after which the plant comes to a recovery target without starting anew; should a
        fallback end in one as well, that of the decision with the least risk.
        """
        if self.recovers_on:
            return self.recovers_on
        ends, anew = {s.name for s in self.states if s.recovery_target}, {self.initial.name}
        awaited = [t for t in self.transitions if not t.on_decision]
        while before := {t.source for t in awaited if t.target in ends} - ends - anew:
            ends |= before
        decisions = [t for t in self.transitions if t.on_decision and t.target in ends]
        return min(decisions, key=lambda t: self.state(t.target).risk).event if decisions else ""

    @property
    def ordinary(self) -> frozenset[str]:
        """States that the plant comes through by itself from its start: nobody has to decide on them."""
        found, ways = {self.initial.name}, [t for t in self.transitions if not t.on_decision]
        while further := {t.target for t in ways if t.source in found} - found:
            found |= further
        return frozenset(found)

    def state(self, name: str) -> State:
        """The state called ``name``; ValueError where there is none."""
        for s in self.states:
            if s.name == name:
                return s
        raise ValueError(f"state machine {self.name!r} has no state {name!r}")

    def is_end(self, state: str, event: str) -> bool:
        """Whether ``state`` is left neither on ``event`` nor by itself."""
        return not any(t.source == state and (t.event == event or not t.on_decision) for t in self.transitions)

    def paths(
        self,
        start: str,
        values: Mapping[str, float],
        event: str,
        blocked: Collection[str],
        longest: int = 3,
        unreliable: Collection[str] = (),
    ) -> tuple[tuple[Transition, ...], ...]:
        """Every path from ``start`` to a recovery target: at most ``longest`` decisions, then what follows by itself.

        Decisions are ``event`` transitions whose guard holds at ``values``. What follows is awaited: its guards are
        judged when the plant has come so far. Of several awaited transitions between two states the first by name whose
        guard reads no ``unreliable`` tag is on the path. A state that requires a component in ``blocked`` is not
        entered. Ordered by highest risk on the way, then length.
        """
        found: list[tuple[Transition, ...]] = []

        def extend(path: tuple[Transition, ...], here: str) -> None:
            deciding = len(path) < longest and all(t.on_decision for t in path)
            decisions = self._decisions(here, values, event) if deciding else ()
            for t in (*decisions, *self._awaited(here, unreliable)):
                target = self.state(t.target)
                been = {start, *(p.target for p in path)}
                if (t.target in been and not (t.target == start and not path)) or target.requires & set(blocked):
                    continue
                longer = (*path, t)
                if target.recovery_target:
                    found.append(longer)
                extend(longer, t.target)

        extend((), start)
        return tuple(sorted(found, key=lambda p: (max(self.state(t.target).risk for t in p), len(p))))

    def _decisions(self, here: str, values: Mapping[str, float], event: str) -> Iterator[Transition]:
        """Transitions that somebody may decide on in ``here``."""
        for t in self.transitions:
            if t.source == here and t.on_decision and t.event == event and t.guard.holds(values):
                yield t

    def _awaited(self, here: str, unreliable: Collection[str]) -> Collection[Transition]:
        """Transitions by which the plant leaves ``here`` by itself, one for each target."""
        found: dict[str, Transition] = {}
        for t in self.transitions:
            if t.source == here and not t.on_decision and not t.guard.tags & set(unreliable):
                found.setdefault(t.target, t)
        return found.values()
