"""Pricing: what a rollout costs by the tables, member by member.

    production  product x what is made less than by design: what is delivered or still there at the end, or, where
                an amount says how soon a batch makes it, what that is short of its design, summed over the rollout
    outside     price x scales by which a soft criterion or an envelope is missed, summed over the rollout [h]
    state       price of the dearest state that is commanded x length of the rollout [h]
    release     once, where something is commanded

What is made beyond the design is worth nothing, but for what it makes up for in the same rollout. A soft criterion
about one moment is missed at every moment by itself. One that looks ahead is missed as a whole, all the time, by its
margin at the beginning. Costs are means over the members by their probability; what is hard forbids and is not in them.

Hand check: a reactor that is designed for 0.0333 L/s at 1 EUR/L and makes 21 L in 900 s loses 9 EUR of 30, be it
fed with 0.0233 L/s, or as designed and loses 0.01 L/s.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

import numpy as np

from homeostat.domain.cost import PRODUCT, RELEASE, Cost, CostItem
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import HOUR_S, Prices
from homeostat.domain.plant.production import MADE
from homeostat.domain.verdict import Rollout
from homeostat.process.types import Flags, Table, Vec

Signals: TypeAlias = Mapping[str, Table]
"""Tag -> values, shape (members, times), and what was made so far as :data:`MADE`."""


class Pricing:
    """Prices rollouts, for everybody who compares decisions."""

    def __init__(self, prices: Prices, limits: Limits, scales: Mapping[str, float]) -> None:
        """``scales``: unit -> what counts as one unit of margin in it."""
        self.prices = prices
        self._soft = limits.priced
        self._scales = scales

    def of(self, rollout: Rollout, states: Iterable[str], releases: int = 0) -> Cost:
        """What ``rollout`` costs; ``states`` are those that are commanded, ``releases`` what is released for it."""
        signals, dt_s = rollout.trajectory.signals, rollout.trajectory.dt_s
        weights = np.asarray(rollout.weights) / sum(rollout.weights)
        length_s = rollout.trajectory.length * dt_s
        found = {name: float(weights @ each) for name, each in self._missed(signals, dt_s).items()}
        found |= self.of_states(states, length_s) | {RELEASE: releases * self.prices.release}
        items = tuple(CostItem(name, amount) for name, amount in found.items() if amount != 0.0)
        return Cost(items, self.prices.worth(length_s))

    def of_parts(self, rollout: Rollout, parts: Sequence[tuple[Iterable[str], float]], releases: int) -> Cost:
        """What ``rollout`` costs whose ``parts`` command so many states for so many seconds, one after the other."""
        whole = self.of(rollout, (), releases)
        held: dict[str, float] = {}
        for states, seconds in parts:
            for name, amount in self.of_states(states, seconds).items():
                held[name] = held.get(name, 0.0) + amount
        items = (*whole.items, *(CostItem(name, amount) for name, amount in held.items() if amount != 0.0))
        return Cost(items, whole.worth)

    def members(self, signals: Signals, dt_s: float) -> Vec:
        """What each member costs but for states and releases, in the plant's currency, shape (members,)."""
        return np.asarray(np.sum(list(self._missed(signals, dt_s).values()), axis=0))

    def of_states(self, states: Iterable[str], seconds: float) -> dict[str, float]:
        """The dearest of ``states`` -> what being in it for so many ``seconds`` costs; nothing where none is named."""
        ranked = sorted(states, key=lambda s: (-self.prices.states[s], s))
        return {name: self.prices.states[name] * seconds / HOUR_S for name in ranked[:1]}

    def outside(self, signals: Signals, dt_s: float) -> dict[str, Vec]:
        """Soft criterion or envelope -> what each member costs by missing it; infinite where it cannot be judged."""
        seconds = next(iter(signals.values())).shape[1] * dt_s
        found = {}
        for rule in self._soft:
            if rule.formula.horizon_s > 0.0:
                margins, hours = rule.formula.evaluate(signals, dt_s).value[:, None], seconds / HOUR_S
            else:
                margins, hours = np.atleast_2d(rule.formula.margins(signals, dt_s)), dt_s / HOUR_S
            missed = np.maximum(-margins / self._scales.get(rule.formula.unit, 1.0), 0.0).sum(axis=1)
            price = self.prices.outside[rule.name] * hours * missed
            found[rule.name] = np.where(np.isnan(price) | _wild(signals, rule.formula.tags), np.inf, price)
        return found

    def _missed(self, signals: Signals, dt_s: float) -> dict[str, Vec]:
        """Item -> what each member costs by it; infinite where it cannot be judged."""
        production = self.prices.production
        counted = signals[MADE if production.delivered else production.throughput]
        if production.delivered:
            short = np.maximum(production.made(counted.shape[1] * dt_s) - counted[:, -1], 0.0)
        else:
            short = np.maximum(production.design_rate - counted, 0.0).sum(axis=1) * dt_s / production.per_s
        known = np.isfinite(counted).all(axis=1)
        found = {PRODUCT: np.where(known, self.prices.product * short, np.inf)}
        for name, price in self.outside(signals, dt_s).items():
            found[name] = np.broadcast_to(price, short.shape)
        return found


def _wild(signals: Signals, tags: Iterable[str]) -> Flags:
    """Members in which one of ``tags`` is infinite, shape (members,): no limit is kept by an infinite margin."""
    return np.asarray(np.logical_or.reduce([np.isinf(signals[tag]).any(axis=1) for tag in tags]))
