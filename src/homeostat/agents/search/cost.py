"""Cost of what a search tried: production loss, missing margin, change."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits
from homeostat.domain.plant.production import Production

MISSING = 10.0
"""Cost of one scale of missing margin, in production [1]."""


class Cost:
    """Judges candidates by the margins of every criterion over the members, and by what they produce."""

    def __init__(self, limits: Limits, production: Production, scales: Mapping[str, float], slack: float) -> None:
        """``scales``: unit -> what counts as one unit of margin in it; ``slack``: margin that is kept, in scales."""
        self._criteria: tuple[Criterion | Limit, ...] = (
            *limits.criteria,
            *limits.of_kind(LimitKind.TRIP_LIMIT),
            *limits.of_kind(LimitKind.ENVELOPE),
        )
        self._production, self._scales, self._slack = production, scales, slack

    def of(
        self, signals: Mapping[str, NDArray[np.float64]], dt_s: float, required: Mapping[str, float], count: int
    ) -> NDArray[np.float64]:
        """Cost of each of ``count`` candidates, shape (count,), from ``signals`` of shape (count * members, times)."""
        return self.total(self.judge(signals, dt_s, count), required)

    def judge(self, signals: Mapping[str, NDArray[np.float64]], dt_s: float, count: int) -> NDArray[np.float64]:
        """What each candidate comes to, whatever is required: shape (count, 1 + criteria).

        Production that is lost [1], then the worst member's margin of each criterion in scales: -inf where a member is
        undecided, and what is lost is infinite where the throughput is not known.
        """
        rate = signals[self._production.throughput].mean(axis=1).reshape(count, -1)
        lost = 1.0 - rate.mean(axis=1) / self._production.design_rate
        found = [np.where(np.isnan(lost), np.inf, lost)]
        for c in self._criteria:
            if isinstance(c, Criterion):
                margin = c.formula.evaluate(signals, dt_s).value
            else:
                margin = c.formula.margins(signals, dt_s).min(axis=1)
            worst = np.broadcast_to(margin, (next(iter(signals.values())).shape[0],))
            least = worst.reshape(count, -1).min(axis=1) / self._scale(c)
            found.append(np.where(np.isnan(least), -np.inf, least))
        return np.stack(found, axis=1)

    def total(self, judged: NDArray[np.float64], required: Mapping[str, float]) -> NDArray[np.float64]:
        """Cost of candidates that were judged, shape (count,).

        Production that is lost, plus :data:`MISSING` for each scale of margin that is missing; ``required``: criterion
        -> margin that is wanted beyond the slack, in its unit.
        """
        missing = np.zeros(len(judged))
        for c, worst in zip(self._criteria, judged[:, 1:].T, strict=True):
            wanted = self._slack + required.get(c.name, 0.0) / self._scale(c)
            missing += np.clip(wanted - worst, 0.0, 100.0)
        return np.asarray(judged[:, 0] + MISSING * missing)

    def _scale(self, criterion: Criterion | Limit) -> float:
        """What counts as one unit of margin."""
        return self._scales.get(criterion.formula.unit, 1.0)
