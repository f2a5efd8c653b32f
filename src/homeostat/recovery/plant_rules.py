"""What recovery goes by: a plant's machine, limits and worth, and how long anything may take."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import Prices
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.plant.tag import Tag
from homeostat.domain.plant.timing import REFERENCE, Timing
from homeostat.domain.recovery import FallbackStrategy
from homeostat.recovery.bounds import Budget, InterventionBounds, RiskBounds


@dataclass(frozen=True, slots=True)
class PlantRules:
    """What the tables say of the plant."""

    machine: StateMachine
    """Supervisory state machine."""
    limits: Limits
    """Everything that must hold."""
    prices: Prices
    """What everything that does not forbid costs."""
    fallbacks: tuple[FallbackStrategy, ...]
    """Safe-state strategies in table order, each with the steps that follow."""
    scales: Mapping[str, float]
    """Unit -> what counts as one unit of margin in it."""
    tags: Mapping[str, Tag] = field(default_factory=dict)
    """Tag name -> tag, for what may be commanded how fast."""
    passing: frozenset[str] = frozenset()
    """Fault modes that no table lists: nobody has said that they last, and they may swing or end as they like."""
    timing: Timing = REFERENCE
    """How fast the plant is."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """How long and how eagerly recovery works."""

    budget: Budget = field(default_factory=Budget)
    """What one recovery may take."""
    intervention: InterventionBounds = field(default_factory=InterventionBounds)
    """How eagerly a plant is improved that may also be left alone."""
    risk: RiskBounds = field(default_factory=RiskBounds)
    """How sure it must be that no hard limit is violated."""
    every_step: bool = False
    """Whether proposers are asked in every state that the plant enters, also where nothing is wrong."""
