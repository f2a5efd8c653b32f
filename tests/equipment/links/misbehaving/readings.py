"""What can be wrong with samples: small frozen sentences of a script, each with the time during which it holds.

``tags`` names those that are hit; empty hits all of them. ``from_s`` is the time of the first sample that is hit,
``to_s`` that of the first one that is not any more. Each has a method ``distort``: what arrives instead of a sample,
None for nothing; ``held`` is the last sample before it began.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from homeostat.domain.snapshot import Quality, Snapshot
from homeostat.links.errors import LinkError

ALL: frozenset[str] = frozenset()
"""Hits every tag."""


@dataclass(frozen=True, slots=True)
class Silence:
    """No sample comes."""

    from_s: float
    """First process time without [s]."""
    to_s: float = math.inf
    """First process time with one again [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot | None:
        """Nothing."""
        return None


@dataclass(frozen=True, slots=True)
class BrokenReading:
    """Reading raises."""

    from_s: float
    """First process time at which it does [s]."""
    to_s: float = math.inf
    """First process time at which it does not any more [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot | None:
        """Raises LinkError."""
        raise LinkError(f"the link broke while the sample of t = {sample.at_s:.0f} s was read")


@dataclass(frozen=True, slots=True)
class Freeze:
    """Readings stand still while their time stamps go on."""

    tags: frozenset[str]
    """Which; empty for all."""
    from_s: float
    """First process time at which they do [s]."""
    to_s: float = math.inf
    """First process time at which they move again [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The values held."""
        return _with_values(sample, {tag: held.values[tag] for tag in _hit(self.tags, sample) & held.values.keys()})


@dataclass(frozen=True, slots=True)
class Lie:
    """A reading is off by a constant."""

    tag: str
    """Which."""
    by: float
    """How far, in the tag's unit."""
    from_s: float
    """First process time at which it is [s]."""
    to_s: float = math.inf
    """First process time at which it is right again [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The value plus the lie."""
        return _with_values(sample, {self.tag: sample.values[self.tag] + self.by})


@dataclass(frozen=True, slots=True)
class NotANumber:
    """Readings are no numbers, and nothing says that they are bad."""

    tags: frozenset[str]
    """Which; empty for all."""
    from_s: float
    """First process time at which they are not [s]."""
    to_s: float = math.inf
    """First process time at which they are numbers again [s]."""
    value: float = math.nan
    """What comes instead: NaN or an infinity."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The value that is none."""
        return _with_values(sample, dict.fromkeys(_hit(self.tags, sample), self.value))


@dataclass(frozen=True, slots=True)
class Missing:
    """Tags are not in the sample."""

    tags: frozenset[str]
    """Which; empty for all."""
    from_s: float
    """First process time at which they are missing [s]."""
    to_s: float = math.inf
    """First process time at which they are back [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The sample without them."""
        gone = _hit(self.tags, sample)
        return replace(sample, values={tag: v for tag, v in sample.values.items() if tag not in gone})


@dataclass(frozen=True, slots=True)
class Marked:
    """The link itself says that readings are not good; their values are as they were."""

    tags: frozenset[str]
    """Which; empty for all."""
    from_s: float
    """First process time at which it does [s]."""
    to_s: float = math.inf
    """First process time at which they are good again [s]."""
    quality: Quality = Quality.BAD
    """What it says of them."""
    reason: str = "sensor failure"
    """Why, in its words."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The sample with the marks."""
        hit = _hit(self.tags, sample)
        reasons = {**sample.reasons, **dict.fromkeys(hit, self.reason)}
        match self.quality:
            case Quality.BAD:
                return replace(sample, bad=sample.bad | hit, uncertain=sample.uncertain - hit, reasons=reasons)
            case Quality.UNCERTAIN:
                return replace(sample, uncertain=sample.uncertain | (hit - sample.bad), reasons=reasons)
            case Quality.GOOD:
                return sample


@dataclass(frozen=True, slots=True)
class OldValues:
    """Readings stay what they were and say honestly when they were taken."""

    tags: frozenset[str]
    """Which; empty for all."""
    from_s: float
    """First process time without a fresh value [s]."""
    to_s: float = math.inf
    """First process time with one again [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The values held, with their time."""
        hit = _hit(self.tags, sample) & held.values.keys()
        old = _with_values(sample, {tag: held.values[tag] for tag in hit})
        return replace(old, taken_s={**sample.taken_s, **dict.fromkeys(hit, held.at_s)})


@dataclass(frozen=True, slots=True)
class StuckClock:
    """The time stamp is repeated while the values go on."""

    from_s: float
    """First process time at which it is [s]."""
    to_s: float = math.inf
    """First process time at which it is right again [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The sample with the time held."""
        return replace(sample, at_s=held.at_s)


@dataclass(frozen=True, slots=True)
class WrongClock:
    """The time stamp is off: in the past, in the future, or no time at all."""

    by_s: float
    """How far [s]; negative for the past, NaN for no time."""
    from_s: float
    """First process time at which it is [s]."""
    to_s: float = math.inf
    """First process time at which it is right again [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The sample with the wrong time."""
        return replace(sample, at_s=sample.at_s + self.by_s)


@dataclass(frozen=True, slots=True)
class NoReadBack:
    """The plant does not say which targets it has accepted."""

    tags: frozenset[str]
    """Of which tags; empty for all."""
    from_s: float
    """First process time at which it does not [s]."""
    to_s: float = math.inf
    """First process time at which it does again [s]."""

    def distort(self, sample: Snapshot, held: Snapshot) -> Snapshot:
        """The sample without those targets."""
        hidden = self.tags or sample.accepted.keys()
        return replace(sample, accepted={tag: v for tag, v in sample.accepted.items() if tag not in hidden})


BadReading: TypeAlias = (
    Silence | BrokenReading | Freeze | Lie | NotANumber | Missing | Marked | OldValues | StuckClock | WrongClock
    | NoReadBack
)  # fmt: skip
"""Something that is wrong with samples for a time."""


def _hit(tags: frozenset[str], sample: Snapshot) -> frozenset[str]:
    return frozenset(sample.values) & tags if tags else frozenset(sample.values)


def _with_values(sample: Snapshot, values: Mapping[str, float]) -> Snapshot:
    return replace(sample, values={**sample.values, **values})
