"""Stakes: what acting on several explanations at once costs more than acting on the right one.

A table says what each answer costs under each explanation. Whoever does not know which one is right takes the answer
that is best on the mean among those that none of them forbids; whoever knows takes the best one for it. The
difference of the two expected costs is the value of perfect information (Howard, 1966). No answer costs more than the
fallback, which gives all production up.
"""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from homeostat.process.types import Flags, Table, Vec

FALLBACK = 1.0
"""What the fallback costs: all production [1]."""
SAME_ANSWER = 0.01
"""Answers whose costs differ by no more than this are as good as each other, in production [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class Stakes:
    """What answers cost under explanations; the fallback stands among the answers."""

    cost: Table
    """Cost of each answer under each explanation [1], infinite where it forbids it, shape (answers, classes)."""
    probability: Vec
    """Probability of each explanation, shape (classes,)."""

    @classmethod
    def of(cls, cost: Table, probability: Vec) -> Self:
        """What costs more than the fallback is forbidden; ``cost``: shape (answers, classes)."""
        admitted = np.where(cost <= FALLBACK, cost, np.inf)
        return cls(np.vstack([admitted, np.full((1, len(probability)), FALLBACK)]), probability)

    @property
    def value(self) -> float:
        """Value of knowing which explanation is right [1]."""
        return float((self.cost @ self.probability).min() - self.cost.min(axis=0) @ self.probability)

    def regret(self, cost: Vec) -> float:
        """What an answer of this ``cost`` under each explanation, shape (classes,), loses against the right one [1]."""
        worse = np.minimum(cost, FALLBACK) - self.cost.min(axis=0)
        return float(np.maximum(worse, 0.0) @ self.probability)

    @property
    def opposed(self) -> Flags:
        """Which pairs of explanations have no good answer in common, shape (classes, classes)."""
        good = (self.cost <= self.cost.min(axis=0) + SAME_ANSWER).astype(int)
        return np.asarray(good.T @ good == 0)

    def told_apart(self, nats: Table) -> float:
        """Share of what is at stake between opposed explanations that evidence of ``nats`` is expected to decide [1].

        ``nats``: shape (classes, classes). Two normal distributions that are n nats apart are taken for each other as
        often as chance would with probability 1 - erf(sqrt(n) / 2): 1 nat decides 52 %, 4 nats 84 %.
        """
        weight = np.where(self.opposed, np.outer(self.probability, self.probability), 0.0)
        if not weight.any():
            return 0.0
        decided = np.vectorize(math.erf)(0.5 * np.sqrt(np.minimum(nats, nats.T)))
        return float((weight * decided).sum() / weight.sum())
