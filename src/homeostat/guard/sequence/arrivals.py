"""Arrivals: a step of the plant's own recipe may come in parts, and a part of it is no person's hand."""

import math
from dataclasses import dataclass

from homeostat.domain.plant.state_machine import Transition
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.parts import Parts
from homeostat.guard.requests.permissives import usable
from homeostat.guard.sequence.service import Moved
from homeostat.guard.writing.flight import same


@dataclass(frozen=True, slots=True)
class _Part:
    """A target that belongs to a step whose other targets are still to come."""

    moved: Moved
    """What has moved."""
    targets: frozenset[str]
    """States that it may lead to."""


class Arrivals:
    """Knows the steps by which the plant's own recipe may leave its state, and which targets of theirs are there.

    A step that is open has the acceptance time of its tags, from its first target on, to become whole. A target that
    belongs to no such step is nobody's but a person's.
    """

    def __init__(self, parts: Parts) -> None:
        """Nothing arrives yet."""
        self._parts = parts
        self._open: dict[str, tuple[Transition, float]] = {}
        self._waiting: dict[str, _Part] = {}
        self._until_s = -math.inf
        self._entered, self._entered_until_s = "", -math.inf

    @property
    def tags(self) -> frozenset[str]:
        """Tags whose target may be a person's or a part of a step."""
        return frozenset(self._waiting)

    def look(self, now_s: float, readings: Snapshot) -> frozenset[str]:
        """Names of the transitions by which the recipe may leave the present state: open now, or until lately."""
        machine, state, values = self._parts.rules.machine, self._parts.sequencer.state, usable(readings)
        for t in machine.transitions:
            if t.source == state and not t.on_decision and t.guard.holds(values):
                self._open[t.name] = t, now_s
        self._forget(now_s)
        return frozenset(self._open)

    def begun(self, readings: Snapshot) -> bool:
        """Whether a part of a step is there and the rest of it is not; what has moved now is nothing else."""
        changed = self._parts.service.changed(readings)
        return bool(self._waiting) or (bool(changed) and all(self._leads(m.tag, m.now) for m in changed))

    def enter(self, state: str, now_s: float) -> None:
        """The plant has entered ``state`` by its own recipe; what else it commands may still be on its way."""
        self._entered, self._entered_until_s = state, now_s + self._acceptance_s(state)

    def takes(self, moved: Moved, now_s: float) -> bool:
        """Whether ``moved`` belongs to a step that arrives, or to the one that has just been made."""
        if now_s <= self._entered_until_s and self._commands(self._entered, moved.tag, moved.now):
            return self._entered == self._parts.sequencer.state
        self._forget(now_s)
        targets = self._leads(moved.tag, moved.now)
        if targets and not self._waiting:
            self._until_s = now_s + max(map(self._acceptance_s, targets))
        if targets:
            self._waiting[moved.tag] = _Part(moved, targets)
        return bool(targets)

    def late(self, now_s: float) -> tuple[Moved, ...]:
        """Parts of a step that has not become whole in time: it was a person who has moved them."""
        state = self._parts.sequencer.state
        self._waiting = {tag: part for tag, part in self._waiting.items() if state not in part.targets}
        if now_s < self._until_s:
            return ()
        found, self._waiting = tuple(part.moved for part in self._waiting.values()), {}
        return found

    def clear(self) -> None:
        """Nothing is waited for: whatever has moved was the plant's own control, or is being overwritten."""
        self._waiting.clear()

    def _forget(self, now_s: float) -> None:
        """A step is open no longer than its targets may take after its guard held last, and from one state only."""
        state = self._parts.sequencer.state
        self._open = {
            name: (t, at_s)
            for name, (t, at_s) in self._open.items()
            if t.source == state and now_s - at_s <= self._acceptance_s(t.target)
        }

    def _leads(self, tag: str, target: float | None) -> frozenset[str]:
        """States to which an open step leads that commands ``target`` of ``tag``."""
        return frozenset(t.target for t, _ in self._open.values() if self._commands(t.target, tag, target))

    def _commands(self, state: str, tag: str, target: float | None) -> bool:
        """Whether ``target`` is what the tables command of ``tag`` in ``state``."""
        rules = self._parts.rules
        stated = rules.machine.state(state).setpoint(tag)
        return stated is not None and same(stated.design, target, rules.writables[tag].tolerance)

    def _acceptance_s(self, name: str) -> float:
        """Time in which the plant must have accepted all that state ``name`` commands [s]."""
        rules = self._parts.rules
        stated = rules.machine.state(name).setpoints
        return max((rules.writables[r.tag].confirm_s for r in stated if r.tag in rules.writables), default=0.0)
