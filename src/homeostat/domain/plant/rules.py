"""What the guard knows of a plant: read from the engineering tables, never from a twin."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from homeostat.domain.mode import Side
from homeostat.domain.plant.limits import Limit, Limits
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.plant.tag import Tag
from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.domain.recovery import FallbackStrategy, Step
from homeostat.stl.formula import Expression, Formula

SIGMAS = 4.5 * math.sqrt(2.0)
"""Noise of a difference of two readings that is not taken for a step [standard deviations of one reading]."""


@dataclass(frozen=True, slots=True)
class QualityRule:
    """When a reading of one tag is good, uncertain or bad."""

    tag: str
    """Name of the tag."""
    stale_s: float
    """Oldest reading that is still the present one [s]."""
    noise: float | None = None
    """Standard deviation of the reading, in the tag's unit; None where none is stated, and a constant value is none."""
    frozen_s: float | None = None
    """With noise: a value that has not changed for this long is frozen [s]; None where that is not judged."""
    fastest: float | None = None
    """Fastest change that the process can make, in the tag's unit per second; None where no step is too fast."""
    grace_s: float = 0.0
    """After a step that is too fast, how long the reading is uncertain before it counts again [s]."""
    every_s: float | None = None
    """Time between two samples of an analyser, which shows the last one meanwhile [s]; None: a new one each tick."""

    def most_change(self, after_s: float) -> float:
        """By how much two readings that are ``after_s`` [s] apart differ at most, noise included, in the tag's unit.

        Infinite where no step is too fast. Two readings of an analyser are as far apart as its samples.
        """
        if self.fastest is None:
            return math.inf
        return self.fastest * max(after_s, self.every_s or 0.0) + SIGMAS * (self.noise or 0.0)


@dataclass(frozen=True, slots=True)
class TripRule:
    """How one hard limit is watched."""

    limit: str
    """Name of the limit."""
    cusum: float = 0.0
    """Violation times time at which it trips, in the margin's unit times s; 0 trips at the first violation."""
    grace_s: float = 0.0
    """How long it may be undecided before that is a trip [s]."""
    carrier: Formula | None = None
    """What carries the limit meanwhile: another instrument or a balance; None where nothing does."""
    lift: float = 0.0
    """Largest correction of a reading under which the carrier may lift the trip, in the margin's unit; 0 for none."""
    lift_s: float = 0.0
    """Longest time for which it may be lifted [s]."""
    fastest: Expression | None = None
    """How fast the process can make the margin fall as it is now, in the margin's unit per second; None where nobody
    says. One that has fallen faster is not believed for the grace time where something carries the limit."""
    fallen: Formula | None = None
    """What carries the limit instead where its margin has fallen so: what rises slowly has no part in that."""


@dataclass(frozen=True, slots=True)
class WriteRule:
    """How one writable tag is commanded and read back."""

    tag: str
    """Name of the tag."""
    tolerance: float
    """Largest difference between a command and the target that the plant has accepted, in the tag's unit."""
    confirm_s: float
    """Time in which the plant must have accepted a command [s]."""
    fastest: float | None = None
    """Fastest change that the equipment permits, in the tag's unit per second: what a fallback may take; None for none
    but the ordinary rate."""
    ramped_by: Side = Side.PLANT
    """Who moves the value at the commanded rate."""
    automatic: bool = False
    """Whether it may be handed back to automatic."""


@dataclass(frozen=True, slots=True)
class StartUp:
    """Start-up: a phase of the guard with limits of its own."""

    states: frozenset[str] = frozenset()
    """States that belong to it."""
    limits: Mapping[str, Limit] = field(default_factory=dict)
    """Name of a hard limit -> what holds instead of it during start-up."""
    longest_s: Mapping[str, float] = field(default_factory=dict)
    """State of start-up -> how long after the begin of start-up its limits hold there at most [s]."""


@dataclass(frozen=True, slots=True)
class GuardRules:
    """One plant's rules, all that the guard needs."""

    plant: str
    """Name of the plant."""
    tags: Mapping[str, Tag]
    """Every tag by name."""
    machine: StateMachine
    """Supervisory state machine."""
    limits: Limits
    """Trip limits, permissives and envelopes."""
    trips: Mapping[str, TripRule]
    """Name of a hard limit -> how it is watched."""
    qualities: Mapping[str, QualityRule]
    """Tag -> when its reading is good, uncertain or bad."""
    writables: Mapping[str, WriteRule]
    """Tag -> how it is commanded; no other tag can be."""
    fallbacks: tuple[FallbackStrategy, ...]
    """Safe-state strategies in the order of the tables, each with the steps that follow."""
    nominal: tuple[Step, ...] = ()
    """The nominal sequence."""
    start_up: StartUp = StartUp()
    """Start-up."""
    recipe: Side = Side.GUARD
    """Who runs the nominal sequence."""
    configuration: str = ""
    """Digest of tables, graph, settings and baselines."""
    timing: Timing = REFERENCE
    """How often it is sampled, and how fast it is."""
