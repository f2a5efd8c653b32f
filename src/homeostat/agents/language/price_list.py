"""The price list: what does not forbid and costs, for whoever is to choose what costs least."""

from collections.abc import Mapping
from itertools import groupby
from typing import Final

from homeostat.domain.cost import Cost
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import HOUR_S, Prices

MOST_PRICED: Final = 6
"""Most soft criteria, and most prices of states, that are listed: the dearest."""
MOST_ITEMS: Final = 4
"""Most items of a cost that are told: the dearest."""


def price_list(prices: Prices, limits: Limits, scales: Mapping[str, float]) -> str:
    """One line: what production is worth, a release, the dearest states and the dearest soft criteria."""
    outside = sorted(limits.priced, key=lambda rule: (-prices.outside[rule.name], rule.name))[:MOST_PRICED]
    soft = [
        f"{prices.outside[rule.name]:g} per {scales.get(rule.formula.unit, 1.0):g}"
        f"{'' if rule.formula.unit == '1' else ' ' + rule.formula.unit} outside {rule.name} ({rule.formula.text})"
        for rule in outside
        if prices.outside[rule.name] > 0.0
    ]
    made = prices.production
    told = [
        f"{made.throughput} at its design of {made.design_rate:.4g} is worth {prices.worth(HOUR_S):.4g} an hour",
        f"a release costs {prices.release:g}",
        *([f"an hour in a state: {_states(prices)}"] if any(prices.states.values()) else []),
        *([f"an hour outside: {'; '.join(soft)}"] if soft else []),
    ]
    return f"Costs in {prices.currency}: {'; '.join(told)}."


def cost_text(cost: Cost | None, currency: str) -> str:
    """One line on what it costs to do nothing: the sum, and the dearest items; empty where that is not known."""
    if cost is None:
        return ""
    dearest = sorted(cost.items, key=lambda item: -item.amount)[:MOST_ITEMS]
    told = ", ".join(f"{item.name} {item.amount:.3g}" for item in dearest if item.amount > 0.0)
    share = f"{100.0 * cost.share:.3g} % of full production"
    return f"Without action it costs {cost.total:.3g} {currency} ({share}){': ' if told else ''}{told}."


def _states(prices: Prices) -> str:
    """Those that cost anything, the dearest first, equals together."""
    ranked = sorted(((-amount, name) for name, amount in prices.states.items() if amount > 0.0))
    groups = [(-amount, [name for _, name in group]) for amount, group in groupby(ranked, key=lambda pair: pair[0])]
    return ", ".join(f"{amount:g} {' or '.join(names)}" for amount, names in groups[:MOST_PRICED])
