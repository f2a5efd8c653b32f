"""A plant without a model: values follow what is commanded with a lag and are pushed about by a script."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from homeostat.domain.recovery import Command
from homeostat.process.schedule import InputRamp
from homeostat.process.seeds import generator
from tests.equipment.links.timetable import Timetable


@dataclass(frozen=True, slots=True)
class ScriptedTag:
    """A reading that cannot be commanded, only moved by what can."""

    tag: str
    """Name of the tag."""
    start: float
    """Where it rests as long as nothing is commanded, in the tag's unit."""
    gains: Mapping[str, float] = field(default_factory=dict)
    """Writable tag -> how far it moves per unit by which that one is away from its start; a manual output that is on
    automatic at the start counts from zero, and counts nothing while it is on automatic."""
    lag_s: float = 10.0
    """Time constant of the movement [s]."""
    noise: float = 0.0
    """Standard deviation of the reading, in the tag's unit."""


@dataclass(frozen=True, slots=True)
class Push:
    """A disturbance: moves where a reading rests."""

    tag: str
    """Name of the tag."""
    by: float
    """How far, in the tag's unit."""
    from_s: float
    """Process time at which it begins [s]."""
    to_s: float = math.inf
    """Process time before which it ends [s]."""


@dataclass(frozen=True, slots=True)
class PlantScript:
    """What a scripted plant is and what happens to it."""

    tags: tuple[ScriptedTag, ...]
    """Every reading that cannot be commanded."""
    writables: Mapping[str, float | None]
    """Writable tag -> its value at the start, in the tag's unit; None for a manual output on automatic."""
    end_s: float
    """Process time at which the run ends [s]."""
    pushes: tuple[Push, ...] = ()
    """Disturbances, in any order."""
    manual: frozenset[str] = frozenset()
    """Further writable tags that may be handed back to automatic."""
    seed: int = 0
    """Seed of the noise."""

    def __post_init__(self) -> None:
        known = {t.tag for t in self.tags}
        for p in self.pushes:
            if p.tag not in known:
                raise ValueError(f"{p!r} pushes no reading of the plant; these are: {', '.join(sorted(known))}")
        for t in self.tags:
            if not t.lag_s > 0.0:
                raise ValueError(f"{t.tag!r}: lag_s {t.lag_s!r} must be > 0 s")
            strangers = t.gains.keys() - self.writables.keys()
            if strangers or t.tag in self.writables:
                wrong = min(strangers, default=t.tag)
                raise ValueError(f"{t.tag!r} follows writable tags and is none; {wrong!r} is against that")


class ScriptedPlant:
    """Implements :class:`homeostat.links.virtual.VirtualPlant`; cheap enough for days of process time."""

    def __init__(self, script: PlantScript) -> None:
        """At rest, at process time 0."""
        self._script = script
        names = tuple(script.writables)
        start = np.array([math.nan if v is None else v for v in script.writables.values()], dtype=np.float64)
        self._ramp = InputRamp(names, start)
        self._variables = {name: name for name in names}
        self._manual = script.manual | {name for name, v in script.writables.items() if v is None}
        self._zero = {name: 0.0 if v is None else v for name, v in script.writables.items()}
        self._pushes = Timetable(script.pushes)
        self._true = {t.tag: t.start for t in script.tags}
        self._gain = {t.tag: 1.0 - math.exp(-1.0 / t.lag_s) for t in script.tags}
        self._noise = generator(script.seed, "link/noise")
        self._accepted = self._targets()
        self.now_s = 0.0
        """Process time [s]."""
        self.end_s = script.end_s
        """Process time at which the run ends [s]."""

    @property
    def accepted(self) -> Mapping[str, float | None]:
        """Writable tag -> the target that was accepted last, in the tag's unit; None for automatic."""
        return self._accepted

    @property
    def manual(self) -> frozenset[str]:
        """Writable tags that may be handed back to automatic."""
        return self._manual

    @property
    def true(self) -> Mapping[str, float]:
        """Reading -> its value without noise, in the tag's unit; only scoring may look."""
        return dict(self._true)

    def command(self, commands: tuple[Command, ...]) -> None:
        """Ramp to ``commands`` from the next second on; ValueError, and none is taken, where one cannot be."""
        if not commands:
            return
        self._ramp.command(commands, self._variables, {name: self._zero[name] for name in self._manual})
        self._accepted = self._targets()

    def advance(self) -> Mapping[str, float]:
        """One second later: tag -> reading in the tag's unit, NaN for a manual output on automatic."""
        values = dict(zip(self._variables, self._ramp.advance().tolist(), strict=True))
        moved = {name: 0.0 if math.isnan(v) else v - self._zero[name] for name, v in values.items()}
        self.now_s += 1.0
        self._pushes.move(self.now_s)
        for t in self._script.tags:
            goal = t.start + sum(gain * moved[name] for name, gain in t.gains.items())
            goal += sum(p.by for p in self._pushes.active if p.tag == t.tag)
            self._true[t.tag] += (goal - self._true[t.tag]) * self._gain[t.tag]
            values[t.tag] = self._true[t.tag] + t.noise * float(self._noise.standard_normal())
        return values

    def _targets(self) -> Mapping[str, float | None]:
        targets = self._ramp.targets.tolist()
        return {name: None if math.isnan(v) else v for name, v in zip(self._variables, targets, strict=True)}
