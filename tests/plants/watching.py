"""What the guard's tables say of readings: judged on simulated ones, by numpy alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyoxigraph import NamedNode

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.rules import QualityRule
from homeostat.knowledge.description.plant import read_plant
from tests.knowledge.tables import store_of

Readings = Mapping[str, NDArray[np.float64]]
"""Tag -> readings, shape (members, seconds)."""


def described(folder: Path) -> PlantDescription:
    """The plant of ``folder`` as its committed graph describes it."""
    graph = (folder / "plant.ttl").read_bytes()
    system = next(line for line in graph.decode().splitlines() if line.endswith(":system"))
    return read_plant(store_of(graph), NamedNode(f"urn:homeostat:{system.removesuffix(':system')}#system"))


def worst_sum(violations: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest cumulative sum of violations, shape (members, seconds), of every member."""
    total = worst = np.zeros(len(violations))
    for second in violations.T:
        total = np.maximum(0.0, total + second)
        worst = np.maximum(worst, total)
    return worst


def trips_after(violations: NDArray[np.float64], allowed: float) -> NDArray[np.float64]:
    """Seconds until the cumulative sum exceeds ``allowed``; inf where it does not, shape (members,)."""
    total, after = np.zeros(len(violations)), np.full(len(violations), math.inf)
    for k, second in enumerate(violations.T, start=1):
        total = np.maximum(0.0, total + second)
        after = np.where(np.isinf(after) & (total > allowed), k, after)
    return after


def longest_constant(values: NDArray[np.float64]) -> int:
    """Longest time for which a reading of any member does not change [s]."""
    longest = np.zeros(len(values), dtype=np.int64)
    found = 0
    for same in (np.diff(values, axis=1) == 0.0).T:
        longest = np.where(same, longest + 1, 0)
        found = max(found, int(longest.max()))
    return found


SELDOM = 5e-5
"""Share of true readings that noise alone may make uncertain for their grace time [1]."""


def mistaken(rules: Mapping[str, QualityRule], readings: Readings) -> list[str]:
    """What true readings are taken for that they are not: frozen, or too fast to be true."""
    found = []
    for tag, rule in rules.items():
        if tag not in readings:
            continue
        if rule.frozen_s is not None and longest_constant(readings[tag]) >= rule.frozen_s:
            found.append(f"{tag} frozen")
        possible = (rule.fastest or math.inf) + 4.5 * math.sqrt(2.0) * (rule.noise or 0.0)
        if (np.abs(np.diff(readings[tag], axis=1)) > possible).mean() > SELDOM:
            found.append(f"{tag} too fast")
    return found
