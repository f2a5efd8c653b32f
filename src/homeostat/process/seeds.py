"""Seeds with names: every random draw comes from a child of the run's seed, and a child is known by its name.

Two streams of different names are independent (SeedSequence's hash), whatever was drawn from either before. So the true
plant and its twin share no draw, and a new draw somewhere changes no other.
"""

import hashlib
from enum import StrEnum
from typing import Final

import numpy as np

NAMING: Final = "named-1"
"""How draws follow from a seed; it changes whenever equal seeds no longer give equal draws."""
_WORDS = 4
"""Words of 32 bits that stand for one name: enough for two names never to share them."""


class Stream(StrEnum):
    """What is drawn, by name."""

    TRUTH_PARAMETERS = "truth/parameters"
    """Parameters of the true plant."""
    TRUTH_NOISE = "truth/noise"
    """Disturbances and sensor noise of the true plant."""
    TRUTH_COURSES = "truth/courses"
    """Courses of disturbances that wander or come in bursts, one child for each of its names."""
    TWIN_REFINE = "twin/refine"
    """Choosing among a search's finalists."""
    TWIN_EXPLORE = "twin/explore"
    """Everything that is only looked at roughly."""
    TWIN_JUDGE = "twin/judge"
    """Rollouts that are judged, and how their margins would change; no search looks at it."""
    TWIN_CERTIFY = "twin/certify"
    """Hypotheses and parameters of the last check before a release, one child for each of its batches."""
    TWIN_NOISE = "twin/noise"
    """Disturbances and sensor noise of the twin's rollouts, one child for each of its other streams."""
    TWIN_WANDERING = "twin/wandering"
    """Paths of what nobody measures, by which readings may differ although nothing is wrong."""
    RULES_REACH = "rules/reach"
    """Where the search for values that violate a rule begins."""
    LINT_COMMANDS = "lint/commands"
    """Commands under which a check of a plant looks at its flowsheet."""
    STUDY_SCENARIO = "study/scenario"
    """Faults, severities and onsets that a study leaves to chance, one child for each scenario's name."""
    STUDY_BOOTSTRAP = "study/bootstrap"
    """Resamples of a study's statistics."""


def child(seed: int, *names: str) -> np.random.SeedSequence:
    """The child of ``seed`` that ``names`` stand for; ValueError where no name is given or ``seed`` is negative."""
    if not names:
        raise ValueError(f"seed {seed} without a name; say what is drawn")
    return np.random.SeedSequence(seed, spawn_key=tuple(word for name in names for word in _words(name)))


def generator(seed: int, *names: str) -> np.random.Generator:
    """A generator of the draws called ``names``."""
    return np.random.default_rng(child(seed, *names))


def noise_seed(seed: int, *names: str) -> int:
    """Seed in 0 to 2^63 - 1 for the counter-based noise (:mod:`homeostat.process.noise`) called ``names``."""
    return int(child(seed, *names).generate_state(1, np.uint64)[0] >> np.uint64(1))


def _words(name: str) -> tuple[int, ...]:
    digest = hashlib.sha256(name.encode()).digest()
    return tuple(int.from_bytes(digest[4 * k : 4 * k + 4], "little") for k in range(_WORDS))
