"""Recognition: which state of the machine the plant is in, by reading it, and whether anybody can tell."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from homeostat.domain.plant.rules import WriteRule
from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.requests.permissives import usable
from homeostat.guard.writing.flight import between


@dataclass(frozen=True, slots=True)
class Evidence:
    """What the plant tells of the state that it stands in."""

    readings: Snapshot
    """Readings and accepted targets."""
    rules: Mapping[str, WriteRule]
    """Writable tag -> within which tolerance its target is compared."""
    out: frozenset[str] = frozenset()
    """Tags that a person has: where they stand says nothing of the state."""

    def telling(self, state: State) -> tuple[SetpointRange, ...]:
        """What ``state`` states of tags that tell something of it: those in service, all where none of them is."""
        return tuple(r for r in state.setpoints if r.tag not in self.out) or state.setpoints

    def admits(self, state: State, tag: str, target: float | None) -> bool:
        """Whether ``state`` admits ``target`` for ``tag`` within the tag's tolerance, None being automatic."""
        admitted = state.setpoint(tag)
        if admitted is None:
            return False
        if target is None:
            return admitted.design is None
        rule = self.rules.get(tag)
        return between(target, admitted.low, admitted.high, 0.0 if rule is None else rule.tolerance)

    def held(self, state: State, tag: str) -> bool:
        """Whether the plant tells a target of ``tag`` that ``state`` admits."""
        return tag in self.readings.accepted and self.admits(state, tag, self.readings.accepted[tag])


@dataclass(frozen=True, slots=True)
class Found:
    """Where the plant stands, as far as it can be told."""

    state: str
    """State that it is taken to stand in."""
    candidates: tuple[str, ...] = ()
    """States that it may as well stand in, this one among them; empty where it is plain."""

    def __str__(self) -> str:
        """What a person should know of it; empty where it is plain."""
        if not self.candidates:
            return ""
        named = " and ".join(repr(name) for name in self.candidates)
        return f"{named} fit what the plant holds; {self.state!r} is taken, the most cautious one"


def recognise(machine: StateMachine, evidence: Evidence, believed: str, wide: Collection[str] = ()) -> Found:
    """The state that fits the accepted targets and the readings; ``believed`` where it fits or nothing does.

    Else one that follows on it, else any. Where several fit as well, nobody can tell: the most cautious one is taken,
    which is none of those with ``wide`` limits, one from which nothing follows by itself, and the one of highest risk.
    """
    fits = [s for s in machine.states if _fits(s, evidence)]
    if not fits or believed in {s.name for s in fits}:
        return Found(believed)
    following = {t.target for t in machine.transitions if t.source == believed}
    fits = [s for s in fits if s.name in following] or fits
    goes_on = {t.source for t in machine.transitions if not t.on_decision}
    cautious = min(fits, key=lambda s: (s.name in wide, s.name in goes_on, -s.risk))
    return Found(cautious.name, tuple(s.name for s in fits) if len(fits) > 1 else ())


def followed(machine: StateMachine, evidence: Evidence, believed: str) -> str | None:
    """State in which a plant stands that runs by itself and was in ``believed``; None where nobody can tell.

    As long as it holds the targets of ``believed`` it is there. Otherwise one state, and no other, must fit: a vessel
    that is closed may be idle, held or complete, and what follows differs.
    """
    if holds_targets(machine.state(believed), evidence):
        return believed
    found = [s.name for s in machine.states if _fits(s, evidence)]
    return found.pop() if len(found) == 1 else None


def step_made(machine: StateMachine, evidence: Evidence, state: str, lately: Collection[str] = ()) -> Transition | None:
    """Transition out of ``state`` that a plant has taken by itself: its state's targets are held, and it is open.

    It is open where its guard holds, or did ``lately``: targets may arrive later than the readings that led to them.
    """
    values = usable(evidence.readings)
    made = [
        t
        for t in machine.transitions
        if t.source == state
        and not t.on_decision
        and (t.name in lately or t.guard.holds(values))
        and holds_targets(machine.state(t.target), evidence)
    ]
    return min(made, key=lambda t: machine.state(t.target).risk, default=None)


def holds_targets(state: State, evidence: Evidence) -> bool:
    """Whether every target that tells of ``state`` is held; a plant that tells no target at all is taken at its word.

    Local control hands manual outputs back to automatic when it takes over; the plant has left no state by that.
    """
    told = evidence.readings.accepted
    return not told or all(
        r.tag in told and (told[r.tag] is None or evidence.held(state, r.tag)) for r in evidence.telling(state)
    )


def admits_all(state: State, evidence: Evidence) -> bool:
    """Whether ``state`` admits the accepted target of every tag that tells of it."""
    return all(evidence.held(state, r.tag) for r in evidence.telling(state))


def _fits(state: State, evidence: Evidence) -> bool:
    """Whether every target that tells of ``state`` is held and its settling condition holds."""
    held = bool(state.setpoints) and admits_all(state, evidence)
    return held and state.settled_when.holds(usable(evidence.readings))
