"""What is proposed: a path through the state machine, and the commands that take it."""

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine, Transition


@dataclass(frozen=True, slots=True)
class RecoveryPath:
    """A path that is in the machine; one that is not cannot be constructed."""

    machine: StateMachine
    """The machine it is a path of."""
    transitions: tuple[Transition, ...]
    """Steps in order; at least one."""

    def __post_init__(self) -> None:
        if not self.transitions:
            raise ValueError(f"a recovery path through {self.machine.name!r} needs at least one transition")
        for t in self.transitions:
            if t not in self.machine.transitions:
                raise ValueError(f"transition {t.name!r} is not in state machine {self.machine.name!r}")
        for a, b in zip(self.transitions, self.transitions[1:], strict=False):
            if a.target != b.source:
                raise ValueError(f"{a.name!r} ends in {a.target!r}, but {b.name!r} leaves {b.source!r}")
            if b.on_decision and not a.on_decision:
                raise ValueError(f"{b.name!r} is a decision and cannot be awaited after {a.name!r}")

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states, the start first."""
        return (self.transitions[0].source, *(t.target for t in self.transitions))

    @property
    def target(self) -> str:
        """Name of the state in which it ends."""
        return self.transitions[-1].target

    @property
    def decisions(self) -> tuple[Transition, ...]:
        """The steps that are taken at release: the first ones, up to the first that is awaited."""
        return tuple(itertools.takewhile(lambda t: t.on_decision, self.transitions))

    @property
    def awaited(self) -> tuple[Transition, ...]:
        """The steps that follow, each when its guard holds."""
        return self.transitions[len(self.decisions) :]

    @property
    def commanded(self) -> tuple[str, ...]:
        """Names of the states that the plant is in from the release on."""
        return self.states[len(self.decisions) :]

    @property
    def now(self) -> str:
        """Name of the state that the plant is in after the release."""
        return self.states[len(self.decisions)]

    def way_back(self, values: Mapping[str, float]) -> Self | None:
        """The way from where it ends back to the state that it leaves, and on, open at ``values``; None for none."""
        event = self.transitions[0].event
        ways = self.machine.paths(self.target, values, event, blocked=())
        back = [way for way in ways if way[0].target == self.states[0]]
        return type(self)(self.machine, back[0]) if back else None

    @property
    def commanded_states(self) -> tuple[State, ...]:
        """The states that the plant is in from the release on: what each of them is commanded is to be chosen."""
        return tuple(map(self.machine.state, self.commanded))


@dataclass(frozen=True, slots=True)
class Command:
    """One command: bring a tag to a value, not faster than a rate; safe to send twice."""

    tag: str
    """Tag that is commanded."""
    value: float | None
    """Value in the tag's unit; None hands a manual output back to automatic."""
    rate: float | None
    """Fastest change in unit per second; None for a step."""

    def __post_init__(self) -> None:
        if self.value is not None and not math.isfinite(self.value):
            raise ValueError(f"command to {self.tag!r}: value {self.value!r} must be finite")
        if self.rate is not None and not (math.isfinite(self.rate) and self.rate > 0):
            raise ValueError(f"command to {self.tag!r}: rate {self.rate!r} must be finite and > 0 per second")


@dataclass(frozen=True, slots=True)
class Step:
    """A later part of an action set: what is sent once the plant has come so far."""

    transition: Transition
    """The transition that it takes; its guard must hold on the plant before anything is sent."""
    commands: tuple[Command, ...]
    """Commands in the order in which they are sent; one per tag."""

    @property
    def target(self) -> str:
        """State of the machine that it leads to."""
        return self.transition.target


@dataclass(frozen=True, slots=True)
class ActionSet:
    """Commands that are released together and the state that they lead to; then, step by step, all that follows.

    A setpoint change has no later steps; a route through a batch has one per transition.
    """

    commands: tuple[Command, ...]
    """Commands in the order in which they are sent; one per tag."""
    target: str
    """State of the machine that they lead to at once."""
    then: tuple[Step, ...] = ()
    """What follows, in order."""

    def __post_init__(self) -> None:
        for commands in (self.commands, *(s.commands for s in self.then)):
            tags = [c.tag for c in commands]
            double = sorted({t for t in tags if tags.count(t) > 1})
            if double:
                raise ValueError(f"action set commands {double[0]!r} more than once; one command per tag")

    @classmethod
    def along(cls, path: RecoveryPath, commands: Callable[[State], tuple[Command, ...]]) -> Self:
        """What takes ``path``; ``commands`` says what each state is commanded, the present one once more."""
        state = path.machine.state
        steps = tuple(Step(t, commands(state(t.target))) for t in path.awaited)
        return cls(commands(state(path.now)), path.now, steps)

    @property
    def end(self) -> str:
        """State of the machine in which it ends."""
        return self.then[-1].target if self.then else self.target

    @property
    def states(self) -> tuple[str, ...]:
        """States that it leads through, the end last."""
        return (self.target, *(s.target for s in self.then))

    @property
    def digest(self) -> str:
        """SHA-256 of the canonical text of commands, guards and states: what an approval is bound to."""
        steps = [[s.transition.name, str(s.transition.guard), s.target, _texts(s.commands)] for s in self.then]
        return action_digest(self.target, _texts(self.commands), steps)

    def command(self, tag: str) -> Command | None:
        """The command to ``tag``; None where there is none."""
        return next((c for c in self.commands if c.tag == tag), None)

    def choices(self, states: Sequence[State]) -> dict[str, float | None]:
        """Tag -> the value first chosen for it where ``states``, one per step, leave a choice."""
        found: dict[str, float | None] = {}
        for commands, state in zip((self.commands, *(s.commands for s in self.then)), states, strict=False):
            admitted = {r.tag for r in state.open_setpoints}
            found = {c.tag: c.value for c in commands if c.tag in admitted} | found
        return found

    def changed(self, states: Sequence[State], tag: str, value: float) -> Self:
        """The same with ``value`` for ``tag`` wherever ``states``, one per step, leave a choice about it."""

        def change(commands: tuple[Command, ...], state: State) -> tuple[Command, ...]:
            admitted = {r.tag for r in state.open_setpoints}
            return tuple(replace(c, value=value) if c.tag == tag and tag in admitted else c for c in commands)

        first, *later = states
        steps = tuple(replace(s, commands=change(s.commands, x)) for s, x in zip(self.then, later, strict=True))
        return replace(self, commands=change(self.commands, first), then=steps)


def open_setpoints(states: Sequence[State]) -> tuple[SetpointRange, ...]:
    """What ``states`` leave a choice about, which is made once for all of them: where ranges differ, what all admit.

    The design value is the first one's, brought into that range. ValueError where the ranges have no more than a point
    in common.
    """
    found: dict[str, SetpointRange] = {}
    for state in states:
        for r in state.open_setpoints:
            known = found.get(r.tag, r)
            low, high = max(known.low, r.low), min(known.high, r.high)
            if low >= high:
                raise ValueError(
                    f"{r.tag!r} is open in state {state.name!r} from {r.low:g} to {r.high:g}, in those before it from "
                    f"{known.low:g} to {known.high:g}; nothing can be chosen for all of them"
                )
            design = None if known.design is None else min(max(known.design, low), high)
            found[r.tag] = SetpointRange(r.tag, low, high, design)
    return tuple(found.values())


def action_digest(target: str, commands: Sequence[object], steps: Sequence[object]) -> str:
    """SHA-256 of the canonical text of an action set.

    ``commands``: tag, value and rate of each; ``steps``: name and guard of the transition, target and commands of each.
    """
    text = json.dumps([target, commands, *steps], separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _texts(commands: tuple[Command, ...]) -> list[list[object]]:
    return [[c.tag, c.value, c.rate] for c in commands]


@dataclass(frozen=True, slots=True)
class Effect:
    """What a fallback strategy does about one hard limit."""

    acts_within_s: float
    """Time in which a violated limit comes back or nearer [s]."""
    rest: float = 0.0
    """Violation at which the strategy may keep it for good, in the unit of its margin; 0 where it has to come back."""


@dataclass(frozen=True, slots=True)
class FallbackStrategy:
    """One way to a safe state: commands by the engineering tables, never by a proposer."""

    name: str
    """Identifier."""
    actions: ActionSet
    """What it commands, and what follows by itself."""
    waived: Mapping[str, str] = field(default_factory=dict)
    """Permissive that it sets aside -> why."""
    forced: frozenset[str] = frozenset()
    """Tags that it writes even where they are out of service."""
    serves: Mapping[str, Effect] = field(default_factory=dict)
    """Hard limit that it brings back -> how; another one that is violated under it calls for the next strategy."""
