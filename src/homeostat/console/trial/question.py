"""What is asked of a twin, and what it answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from homeostat.console.card.card import Move, PredictedMargin
from homeostat.console.card.foresight import Foresight
from homeostat.console.readings import Readings
from homeostat.domain.diagnosis import Diagnosis

Bad: TypeAlias = Mapping[str, tuple[tuple[float, float], ...]]
"""Tag -> from when to when its reading was bad, process times [s]."""


@dataclass(frozen=True, slots=True)
class Question:
    """Everything that the answer depends on."""

    folder: str
    """Folder of the plant."""
    at_s: float
    """The moment, process time [s]."""
    readings: Readings
    """Readings up to then."""
    bad: Bad
    """Those of them that must not be used."""
    healthy_s: tuple[float, float]
    """From when to when the plant was healthy in the state that it was in [s]."""
    diagnosis: Diagnosis
    """What is held to be wrong."""
    state: str
    """State that the plant is in."""
    target: str
    """State that is asked about: the same, or one that may be decided on from it."""
    values: Mapping[str, float | None]
    """Tag -> what it is to be brought to; None for automatic."""
    targets: Mapping[str, float | None]
    """Tag -> what it is at."""


@dataclass(frozen=True, slots=True)
class Tried:
    """What the twin says of it."""

    at_s: float
    """The moment that was asked about [s]."""
    state: str
    """State that it leads to, in the operator's words."""
    moves: tuple[Move, ...]
    """What would be commanded."""
    approved: bool
    """Whether every check that forbids holds; nothing is released because of that."""
    objections: tuple[str, ...]
    """What is against it, the worst first."""
    margins: tuple[PredictedMargin, ...]
    """Limits and criteria, the nearest one first."""
    foresight: Foresight
    """What the plant would do."""
    beside: Foresight
    """What it does if nothing is done."""
    cost: float | None
    """What it would cost; None where the twin cannot say."""
    cost_alone: float | None
    """What it costs to do nothing."""
    currency: str
    """What costs are in."""
    assumed: tuple[tuple[str, float], ...]
    """What was held to be wrong, and how probable that is [0, 1]."""
    learnt_s: float
    """How many healthy seconds the twin has learnt its parameters from [s]; 0 for none: it has those of the tables."""
