"""What a run truly cost, by the same prices that decisions are made by."""

from collections.abc import Sequence
from itertools import pairwise

from homeostat.agents.pricing import Pricing
from homeostat.domain.cost import PRODUCT, RELEASE, Cost, CostItem
from homeostat.domain.plant.prices import HOUR_S
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import made
from homeostat.plants.plant import Plant


def run_cost(
    plant: Plant,
    truth: Trajectory,
    healthy: Trajectory,
    from_s: float,
    states: Sequence[tuple[str, float]] = (),
    releases: int = 0,
    force: LimitsInForce | None = None,
) -> Cost:
    """What ``truth`` cost from ``from_s`` to its end, against the fault-free run ``healthy``.

    ``states`` were entered in this order, each at its process time [s]; so many ``releases`` were made. Product is that
    which is delivered, or still in the plant; a hard limit that is violated costs what one violation costs. Limits
    count while they are in ``force``, by default all the time. What cannot be known costs NaN.
    """
    prices, hard = plant.prices, plant.description.limits.hard
    held = LimitsInForce(plant.description.limits) if force is None else force
    late = truth.times_s > from_s
    violated = {limit.name for limit in hard if held.outside(limit, truth)[late].any()}
    late &= ~held.starting(truth)
    signals = {tag: values[:, late] for tag, values in truth.signals.items() if tag in plant.description.tags_by_name}
    pricing = Pricing(prices, plant.description.limits, plant.description.scales)
    outside = pricing.outside(signals, truth.dt_s) if late.any() else {}
    items = {name: float(each[0]) for name, each in outside.items()}
    possible = made(healthy, plant.delivered, from_s)
    items[PRODUCT] = prices.product * max(possible - made(truth, plant.delivered, from_s), 0.0)
    end_s = float(truth.times_s[-1])
    for (state, entered_s), (_, left_s) in pairwise([*states, ("", end_s)]):
        hours = max(left_s - max(entered_s, from_s), 0.0) / HOUR_S
        items[state] = items.get(state, 0.0) + prices.states[state] * hours
    items[RELEASE] = releases * prices.release
    items |= {limit.name: prices.violation[limit.name] for limit in hard if limit.name in violated}
    return Cost(
        tuple(CostItem(name, amount) for name, amount in items.items() if amount != 0.0), prices.product * possible
    )
