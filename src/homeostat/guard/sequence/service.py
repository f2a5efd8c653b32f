"""In service: which writable tags are the guard's, and who else has moved one."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from homeostat.domain.events.people import ServiceChanged
from homeostat.domain.plant.rules import WriteRule
from homeostat.domain.ports import GuardEvent
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.writing.flight import same


@dataclass(frozen=True, slots=True)
class Moved:
    """A target that somebody else has changed."""

    tag: str
    """Name of the tag."""
    before: float | None
    """What it was, in the tag's unit; None for automatic."""
    now: float | None
    """What it is."""


class Service:
    """Knows the target that every writable tag should hold; a tag that somebody else moves goes out of service."""

    def __init__(self, rules: Mapping[str, WriteRule], note: Callable[[GuardEvent, float], None]) -> None:
        """Every writable tag is in service at first."""
        self._rules, self._note = rules, note
        self._out: set[str] = set()
        self._expected: dict[str, float | None] = {}
        self._told: dict[str, float | None] = {}

    @property
    def tags(self) -> frozenset[str]:
        """Tags that the guard may write."""
        return frozenset(self._rules) - self._out

    @property
    def out(self) -> frozenset[str]:
        """Tags that it may not."""
        return frozenset(self._out)

    def restore(self, out: frozenset[str]) -> None:
        """Take over from a journal what is out of service."""
        self._out = set(out) & set(self._rules)

    def restore_targets(self, targets: Mapping[str, float | None]) -> None:
        """The plant held ``targets`` when the journal ended: what is different now was moved since."""
        self._expected.update(targets)
        self._told.update(targets)

    def expect(self, commands: tuple[Command, ...]) -> None:
        """The plant was read to hold ``commands``."""
        held = {c.tag: c.value for c in commands}
        self._expected.update(held)
        self._told.update(held)

    def target(self, tag: str) -> float | None:
        """The target that ``tag`` held when it was read last, in its unit; NaN where it never was."""
        return self._expected.get(tag, math.nan)

    def news(self, but: frozenset[str] = frozenset()) -> dict[str, float | None]:
        """Targets that the plant holds and no write says so, since the last call; ``but`` those of some tags."""
        held = {t: target for t, target in self._expected.items() if t not in but}
        found = {t: target for t, target in held.items() if t not in self._told or target != self._told[t]}
        self._told.update(found)
        return found

    def adopt(self, commands: tuple[Command, ...], readings: Snapshot | None) -> None:
        """What became of ``commands`` is what the plant says, which is news; it was no stranger."""
        if readings is not None:
            held = {c.tag: readings.accepted[c.tag] for c in commands if c.tag in readings.accepted}
            self._expected.update(held)
            for tag in held:  # a ramp has brought it there step by step, and no write says so
                self._told.pop(tag, None)

    def moved(
        self, readings: Snapshot, pending: Callable[[str, float | None, float | None], bool]
    ) -> tuple[Moved, ...]:
        """Targets that somebody else has changed since the last tick.

        ``pending`` says whether what is being written may have brought a tag from a target to another.
        """
        found = []
        for tag, rule in self._rules.items():
            if tag not in readings.accepted:
                continue
            target = readings.accepted[tag]
            before = self._expected.setdefault(tag, target)
            unmoved = same(before, target, rule.tolerance)
            if not unmoved and not pending(tag, before, target):
                self._expected[tag] = target
                found.append(Moved(tag, before, target))
        return tuple(found)

    def changed(self, readings: Snapshot) -> tuple[Moved, ...]:
        """Targets that are not those that were read last; nobody takes note of it yet."""
        known = ((t, before, readings.accepted[t]) for t, before in self._expected.items() if t in readings.accepted)
        return tuple(Moved(t, before, now) for t, before, now in known if not same(before, now, self._tolerance(t)))

    def change(self, tag: str, in_service: bool, person: str, reason: str, at_s: float) -> bool:
        """Take ``tag`` out of service or bring it back; False where that changes nothing or the tag is not writable."""
        if tag not in self._rules or (tag not in self._out) == in_service:
            return False
        (self._out.discard if in_service else self._out.add)(tag)
        self._note(ServiceChanged(tag, in_service, person, reason), at_s)
        return True

    def _tolerance(self, tag: str) -> float:
        return self._rules[tag].tolerance if tag in self._rules else 0.0
