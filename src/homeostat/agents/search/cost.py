"""Cost of what a search tried: its price, and a penalty for every margin that must not be missing."""

from collections.abc import Mapping, Sequence

import numpy as np

from homeostat.agents.no_worse import SLACK
from homeostat.agents.pricing import Pricing, Signals
from homeostat.domain.plant.limits import Criterion, Limit, LimitKind, Limits
from homeostat.domain.recovery import ActionSet
from homeostat.process.types import Table, Vec

MISSING = 10.0
"""Penalty for one scale of missing margin, in design production [1]."""


class Cost:
    """Judges candidates by the margins of everything that forbids, over the members, and by what they cost."""

    def __init__(self, limits: Limits, pricing: Pricing, scales: Mapping[str, float], slack: float) -> None:
        """``scales``: unit -> what counts as one unit of margin in it; ``slack``: margin that is kept, in scales."""
        criteria, needed = limits.watched.forbidding
        self._criteria: tuple[Criterion | Limit, ...] = (*criteria, *needed)
        self._pricing, self._scales, self._slack = pricing, scales, slack

    def of(
        self,
        signals: Signals,
        dt_s: float,
        weights: Vec,
        candidates: Sequence[ActionSet],
        required: Mapping[str, float] | None = None,
    ) -> Vec:
        """Cost of each candidate, shape (candidates,), from ``signals`` of shape (candidates * members, times)."""
        return self.total(self.judge(signals, dt_s, weights, candidates), required or {})

    def judge(self, signals: Signals, dt_s: float, weights: Vec, candidates: Sequence[ActionSet]) -> Table:
        """What each candidate comes to, whatever is required: shape (candidates, 2 + criteria).

        Expected price over the members by their ``weights``, as a share of the design production [1], then the worst
        member's margin of everything that forbids, in scales: infinite and -inf where a member is undecided, as is one
        that has left the physical world. Last how much of them heads for a hard limit (:func:`heading`).
        """
        count = len(candidates)
        seconds = next(iter(signals.values())).shape[1] * dt_s
        each = self._pricing.members(signals, dt_s).reshape(count, -1)
        known = np.isfinite(each)
        price = np.where(known, each, 0.0) @ (weights / weights.sum())
        price[~known.all(axis=1)] = np.inf
        states = [sum(self._pricing.of_states(a.states, seconds).values()) for a in candidates]
        found = [(price + np.array(states)) / self._pricing.prices.worth(seconds)]
        headed = np.zeros(each.size)
        for c in self._criteria:
            if isinstance(c, Criterion):
                margin = c.formula.evaluate(signals, dt_s).value
            elif c.kind is LimitKind.PERMISSIVE:
                margin = self._at_release(c, signals, candidates)
            else:
                course = c.formula.margins(signals, dt_s)
                margin = course.min(axis=1)
                headed = np.maximum(headed, heading(course)) if c.hard else headed
            worst = np.broadcast_to(margin, (next(iter(signals.values())).shape[0],))
            least = worst.reshape(count, -1).min(axis=1) / self._scales.get(c.formula.unit, 1.0)
            found.append(np.where(np.isnan(least), -np.inf, least))
        found.append(headed.reshape(count, -1) @ (weights / weights.sum()))
        return np.stack(found, axis=1)

    def where_held(self, judged: Table, held: Table, alone: Vec) -> Table:
        """``judged`` with the hard margins that are less where actuators stay at rest: rows of ``held``.

        ``alone``: what leaving the plant alone comes to with the same actuators at rest; what it misses itself is not
        asked for, within :data:`SLACK`.
        """
        hard = [c.hard and (isinstance(c, Criterion) or c.kind is not LimitKind.PERMISSIVE) for c in self._criteria]
        missed = np.where(alone[1:-1] < 0.0, alone[1:-1] - SLACK, 0.0)
        asked = np.where(np.array(hard) & np.isfinite(missed), held[:, 1:-1] - missed, np.inf)
        found = judged.copy()
        found[:, 1:-1] = np.minimum(judged[:, 1:-1], asked)
        return found

    def total(self, judged: Table, required: Mapping[str, float]) -> Vec:
        """Cost of candidates that were judged, shape (candidates,).

        Their price, plus :data:`MISSING` for each scale of margin that is missing; ``required``: criterion -> margin
        that is wanted beyond the slack, in its unit.
        """
        missing = np.zeros(len(judged))
        for c, worst in zip(self._criteria, judged[:, 1:-1].T, strict=True):
            scale = self._scales.get(c.formula.unit, 1.0)
            kept = 0.0 if isinstance(c, Limit) and c.kind is LimitKind.PERMISSIVE else self._slack
            missing += np.clip(kept + required.get(c.name, 0.0) / scale - worst, 0.0, 100.0)
        return np.asarray(judged[:, 0] + MISSING * missing)

    def margins(self, judged: Vec) -> dict[str, float]:
        """Name of everything that forbids -> its margin in its unit, of one candidate that was judged."""
        found = zip(self._criteria, judged[1:-1].tolist(), strict=True)
        return {c.name: margin * self._scales.get(c.formula.unit, 1.0) for c, margin in found}

    @staticmethod
    def _at_release(permissive: Limit, signals: Signals, candidates: Sequence[ActionSet]) -> Vec:
        """Least margin of a permissive over the steps of each candidate, shape (candidates * members,)."""
        first = {tag: signals[tag][:, :1] for tag in permissive.formula.tags}
        members = next(iter(first.values())).shape[0] // len(candidates)
        least, manual = np.full(len(candidates) * members, np.inf), dict(permissive.by_hand)
        for step in range(max(len(a.states) for a in candidates)):
            for tag in first:
                sent = [_sent(a, step, tag, manual.get(tag, tag)) for a in candidates]
                known = np.repeat([v is not None for v in sent], members)[:, None]
                value = np.repeat([0.0 if v is None else v for v in sent], members)[:, None]
                first[tag] = np.where(known, value, first[tag])
            least = np.minimum(least, permissive.formula.margins(first, 1.0)[:, 0])
        return least


def heading(margins: Table) -> Vec:
    """How soon after a rollout its members would be at a limit if it went on as it ends, shape (members,) [1].

    1 at once, 0 where it takes as long again as the rollout, or never comes; by the course of the ``margins`` over its
    last half, shape (members, times). A level that is held by nothing reaches no limit in any one horizon, and one in
    the end.
    """
    times = margins.shape[1]
    sixth = max(times // 6, 1)
    with np.errstate(invalid="ignore"):
        before, last = (margins[:, k : k + sixth].mean(axis=1) for k in (max(times - 3 * sixth, 0), times - sixth))
        falls = (before - last) * times / max(2 * sixth, 1)
    left = np.divide(last, falls, out=np.full(len(margins), np.inf), where=falls > 0.0)
    return np.asarray(np.clip(1.0 - left, 0.0, 1.0))


def _sent(actions: ActionSet, step: int, *tags: str) -> float | None:
    """What ``actions`` command the first of ``tags`` to at their ``step``; None where they do not, or to automatic."""
    every = (actions.commands, *(s.commands for s in actions.then))
    if step >= len(every):
        return None
    return next((c.value for c in every[step] if c.tag in tags), None)
