"""Ramps that the guard makes: where the plant takes steps as they come, the guard owns the way to the target."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from homeostat.domain.mode import Side
from homeostat.domain.recovery import Command
from homeostat.domain.rules import WriteRule


@dataclass(slots=True)
class _Ramp:
    """One tag on its way."""

    target: float
    rate: float
    start: float
    now: float
    at_s: float


class Ramps:
    """At most one ramp per tag; every one stops at once when it is told to."""

    def __init__(self) -> None:
        self._ramps: dict[str, _Ramp] = {}
        self._last: dict[str, float] = {}

    def first(self, commands: tuple[Command, ...], rules: Mapping[str, WriteRule]) -> tuple[Command, ...]:
        """What is sent at once for ``commands``: where the guard ramps, nothing but the present value."""
        sent = []
        for c in commands:
            self._ramps.pop(c.tag, None)
            owned = c.tag in rules and rules[c.tag].ramped_by is Side.GUARD
            start = self._last.get(c.tag)
            if owned and c.value is not None and c.rate is not None and start is not None:
                self._ramps[c.tag] = _Ramp(c.value, c.rate, start, start, math.nan)
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
            elif tag not in self._ramps:
                self._last[tag] = target

    def step(self, now_s: float) -> tuple[Command, ...]:
        """The next values of every ramp at ``now_s`` [s]."""
        sent = []
        for tag, ramp in list(self._ramps.items()):
            reach, left = ramp.rate * (now_s - ramp.at_s), ramp.target - ramp.now
            ramp.at_s = now_s
            if not reach > 0.0 or left == 0.0:  # no time has passed; at the first step it is not known (NaN)
                continue
            ramp.now = ramp.target if abs(left) <= reach else ramp.now + math.copysign(reach, left)
            sent.append(Command(tag, ramp.now, None))
            self._last[tag] = ramp.now
        return tuple(sent)

    def left_s(self, tag: str) -> float:
        """Time that the ramp of ``tag`` takes from here [s]; 0 where there is none."""
        ramp = self._ramps.get(tag)
        return 0.0 if ramp is None else abs(ramp.target - ramp.now) / ramp.rate

    def passes(self, tag: str, value: float | None, tolerance: float) -> bool:
        """Whether the ramp of ``tag`` has led through ``value``."""
        ramp = self._ramps.get(tag)
        if ramp is None or value is None:
            return False
        low, high = sorted((ramp.start, ramp.now))
        return low - tolerance <= value <= high + tolerance

    def drop(self, tag: str) -> None:
        """Stop the ramp of ``tag``: somebody else has moved it."""
        self._ramps.pop(tag, None)

    def stop(self) -> None:
        """Stop every ramp where it is; one that has come to its end is over as well."""
        self._ramps.clear()
