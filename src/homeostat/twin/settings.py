"""What a plant says about its twin."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from homeostat.stl.formula import Expression


@dataclass(frozen=True, slots=True)
class Balance:
    """A state that a conserved quantity makes, and what may disturb it."""

    state: str
    """State of the process model."""
    quantity: str
    """What is conserved: ``heat``, ``mass``."""
    component: str
    """Where it is held."""
    unit: str
    """Unit of a disturbance."""
    capacity: Expression
    """What is held per unit of the state, over tags: a disturbance divided by it is the state's rate."""
    large: float
    """A large disturbance, in ``unit``."""
    only_lost: bool = False
    """Whether it can only be lost to where nobody knows: what comes in comes through what the tables have."""
    most: float = math.inf
    """The largest disturbance that there can be, in ``unit``: nothing on site brings or takes more."""


@dataclass(frozen=True, slots=True)
class TwinSettings:
    """What a plant says about its twin; its default times are for the reference (`homeostat.domain.plant.timing`)."""

    errors: Mapping[str, tuple[float, float]]
    """Variable -> (noise per reading, or sample of an analyser, model error), standard deviations in its unit."""
    corrected: tuple[str, ...]
    """Variables whose last readings correct the state."""
    initial: Mapping[str, float]
    """State -> standard deviation of what smoothing may get wrong at the start of a window."""
    gain_error: float
    """What a reading moved by is predicted to this share at best [1]."""
    size_error: float = 0.0
    """Standard deviation of a size that is stated, for which the model stands and not the readings, as a share of that
    size [1]."""
    least_size_error: float = 0.0
    """The same however small the size is, as a share of the fault's typical size [1]."""
    misled: float = 0.0
    """Share of cases in which what explains the readings best is not what is wrong, however well it does so [1]."""
    lag_error_s: float = 0.0
    """By how much actuators and instruments may be slower than the model's, standard deviation [s]."""
    damping: Mapping[str, float] = field(default_factory=dict)
    """Variable -> time constant of its transmitter's own filter [s]; one that has none is not named."""
    delivered: tuple[str, ...] = ()
    """Variables whose sum is what was made so far; empty where decisions are not priced by it."""
    balances: tuple[Balance, ...] = ()
    """What may be disturbed by what nobody knows of."""
    unknown_growth: float = 0.2
    """By what share of its size a disturbance that nobody knows of may grow while a rollout lasts [1]."""
    lead_s: float = 400
    """Stretch before the first symptom that is replayed with what follows it [s]."""
    replay_s: float = 640
    """Longest stretch that is replayed for an explanation [s]."""
    recent_s: float = 240
    """Stretch in which a second fault is looked for [s]."""
    synchronise_s: float = 300
    """Stretch that is replayed before a forecast [s]."""
    settle_rows: int = 20
    """First readings of a replayed stretch that say what state it starts in."""
    horizon_s: float = 900
    """Length of a rollout [s]."""
    judged_draws: int = 12
    """Parameter draws per hypothesis in a rollout that is judged."""
    draws: int = 6
    """Parameter draws per hypothesis for a search's finalists."""
    search_draws: int = 2
    """Parameter draws per hypothesis while searching."""
    stride: float = 5
    """Every how many seconds a searched rollout is sampled."""
