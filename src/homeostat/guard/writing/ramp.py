"""Ramps that the guard makes: where the plant takes steps as they come, the guard owns the way to the target."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from homeostat.domain.mode import Side
from homeostat.domain.plant.rules import WriteRule
from homeostat.domain.recovery import Command

Same: TypeAlias = Callable[[str, float | None, float], bool]
"""Whether the target of a tag that the plant tells is the one that was sent, within the tolerance of its table."""


@dataclass(slots=True)
class _Ramp:
    """One tag on its way."""

    target: float
    rate: float
    start: float
    now: float
    sent: float
    at_s: float = math.nan
    seen: float | None = None
    follows: bool = field(init=False)
    followed_s: float = math.nan

    @property
    def over(self) -> bool:
        """Whether the last step was sent."""
        return self.now == self.target

    @property
    def way(self) -> tuple[float, float]:
        """The least and the largest value so far."""
        return min(self.start, self.sent), max(self.start, self.sent)


class Ramps:
    """At most one ramp per tag; every one stops at once when it is told to.

    The next step is sent when the plant is seen to hold the last one: a ramp that cannot be confirmed stands.
    """

    def __init__(self) -> None:
        self._ramps: dict[str, _Ramp] = {}
        self._passed: dict[str, tuple[float, float]] = {}
        self._last: dict[str, float] = {}

    def first(
        self, commands: tuple[Command, ...], rules: Mapping[str, WriteRule], *, anyway: bool
    ) -> tuple[Command, ...]:
        """What is sent at once for ``commands``: where the guard ramps, nothing but the present value.

        ``anyway``: a ramp to the same target that is under way goes on where it is, also where the plant is not seen
        to follow: what is shown late must not lead a fallback back.
        """
        sent = []
        for c in commands:
            owned = c.tag in rules and rules[c.tag].ramped_by is Side.GUARD
            under_way = self._ramps.get(c.tag) if anyway else None
            start = under_way.sent if under_way and under_way.target == c.value else self._last.get(c.tag)
            self._end(c.tag)
            if owned and c.value is not None and c.rate is not None and start is not None:
                self._ramps[c.tag] = _Ramp(c.value, c.rate, start, start, start)
                sent.append(replace(c, value=start, rate=None))
            else:
                sent.append(c)
            if c.value is None:
                self._last.pop(c.tag, None)
            elif c.tag not in self._ramps:
                self._last[c.tag] = c.value
        return tuple(sent)

    def present(self, accepted: Mapping[str, float | None]) -> None:
        """Take note of the targets that the plant holds; a ramp starts there."""
        for tag, target in accepted.items():
            if target is None:
                self._last.pop(tag, None)
            else:
                self._last[tag] = target

    def step(
        self, now_s: float, accepted: Mapping[str, float | None], same: Same, *, anyway: bool
    ) -> tuple[Command, ...]:
        """The next values of every ramp at ``now_s`` [s], given the targets that the plant is known to hold.

        ``anyway``: also of those that the plant is not seen to follow, as to a fallback standing still is no help.
        """
        sent = []
        for tag, ramp in self._ramps.items():
            target, told = accepted.get(tag), tag in accepted
            if same(tag, target, ramp.sent):  # also where the link said that it did not take it
                ramp.now = ramp.sent
            held = same(tag, target, ramp.now)
            ramp.follows = held or not told or target != ramp.seen
            ramp.followed_s = now_s if math.isnan(ramp.at_s) else ramp.followed_s
            reach, left = ramp.rate * (now_s - ramp.at_s), ramp.target - ramp.now  # NaN at first: no step yet
            ramp.at_s, ramp.seen = now_s, target
            if (held or anyway) and reach > 0.0 and left != 0.0:
                ramp.sent = ramp.target if abs(left) <= reach else ramp.now + math.copysign(reach, left)
                sent.append(Command(tag, ramp.sent, None))
        return tuple(sent)

    def took(self, commands: tuple[Command, ...], now_s: float, told: Mapping[str, float | None]) -> None:
        """The link has taken these steps; ``told``: targets that the plant tells, so that nobody has to guess them."""
        for c in commands:
            ramp = self._ramps[c.tag]
            ramp.now = ramp.sent
            ramp.followed_s = now_s if ramp.follows else ramp.followed_s
            if c.tag not in told:
                self._last[c.tag] = ramp.now

    @property
    def followed_s(self) -> float:
        """When the last step was sent of the ramp that is followed worst, while any is under way [s]."""
        going = [r.followed_s for r in self._ramps.values() if not r.over]
        return min(going) if going else max((r.followed_s for r in self._ramps.values()), default=-math.inf)

    def passes(self, tag: str, value: float | None, tolerance: float) -> bool:
        """Whether the ramp of ``tag``, also one that was stopped, may have led through ``value``."""
        ways = [self._passed[tag]] if tag in self._passed else []
        ways += [self._ramps[tag].way] if tag in self._ramps else []
        return value is not None and any(low - tolerance <= value <= high + tolerance for low, high in ways)

    def drop(self, tag: str) -> None:
        """Stop the ramp of ``tag``: somebody else has moved it."""
        self._ramps.pop(tag, None)
        self._passed.pop(tag, None)

    def stop(self) -> None:
        """Stop every ramp where it is; one that has come to its end is over as well."""
        for tag in tuple(self._ramps):
            self._end(tag)

    def forget(self) -> None:
        """Nothing is on its way any more: no ramp that has ended leads anywhere."""
        self._passed.clear()

    def _end(self, tag: str) -> None:
        """The ramp of ``tag`` is over; its last steps may be on the wire yet."""
        ramp = self._ramps.pop(tag, None)
        if ramp is not None:
            low, high = self._passed.get(tag, ramp.way)
            self._passed[tag] = min(low, ramp.way[0]), max(high, ramp.way[1])
