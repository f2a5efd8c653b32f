"""What a plant says about its twin."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class TwinSettings:
    """What a plant says about its twin."""

    errors: Mapping[str, tuple[float, float]]
    """Variable -> (noise per reading, model error), standard deviations in its unit."""
    corrected: tuple[str, ...]
    """Variables whose last readings correct the state."""
    initial: Mapping[str, float]
    """State -> standard deviation of what smoothing may get wrong at the start of a window."""
    gain_error: float
    """What a reading moved by is predicted to this share at best [1]."""
    replay_s: int = 600
    """Longest stretch that is replayed for an explanation [s]."""
    recent_s: int = 240
    """Stretch in which a second fault is looked for [s]."""
    synchronise_s: int = 300
    """Stretch that is replayed before a forecast [s]."""
    settle_rows: int = 20
    """First readings of a replayed stretch that are averaged to find the state at its start."""
    horizon_s: int = 900
    """Length of a rollout [s]."""
    judged_draws: int = 12
    """Parameter draws per hypothesis in a rollout that is judged."""
    draws: int = 6
    """Parameter draws per hypothesis for a search's finalists."""
    search_draws: int = 2
    """Parameter draws per hypothesis while searching."""
    stride: int = 5
    """Every how many seconds a searched rollout is sampled."""
