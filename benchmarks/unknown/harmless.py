"""Whether what is called harmless is: which criteria and limits a run with nobody acting does not satisfy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from homeostat.agents.pricing import Pricing
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.unsupervised import fault_free, unsupervised
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import SAME_LOSS, exposures
from homeostat.plants.plant import Plant

STARTED_S = {"cstr": 600.0, "mixing_module": 1.0}
"""Plant -> when its start-up is over [s]."""


def violated(plant: Plant, scenario: Scenario) -> tuple[str, ...]:
    """Hard limits and hard criteria that are not kept, and what is soft and costs more than it would without the cause.

    Criteria are judged as if the disturbance were a recovery. Costs that differ by less than :data:`SAME_LOSS` of what
    the plant makes meanwhile by design are the same: the fault-free plant's valves and pumps wear, too.
    """
    truth = unsupervised(plant, scenario).truth
    limits = plant.description.limits
    hard = {limit.name for limit in limits.hard}
    force = LimitsInForce.after(plant.description, STARTED_S[plant.name])
    outside = [e.limit for e in exposures(truth, force, None) if e.total_s > 0.0 and e.limit in hard]
    from_s = plant.onset_s if scenario.onset_s is None else scenario.onset_s
    after, healthy = _from(truth, from_s), _from(fault_free(plant, scenario).truth, from_s)
    needed, _ = limits.forbidding
    criteria = [c.name for c in needed if not c.formula.evaluate(after.signals, after.dt_s).value >= 0.0]
    paid, usual = _paid(plant, after), _paid(plant, healthy)
    same = SAME_LOSS * plant.prices.worth(after.length * after.dt_s)
    return (*outside, *criteria, *(name for name in paid if not paid[name] - usual[name] <= same))


def _paid(plant: Plant, truth: Trajectory) -> Mapping[str, float]:
    """What is soft -> what missing it costs over all of ``truth``, in the plant's currency."""
    d = plant.description
    pricing = Pricing(plant.prices, d.limits, d.scales)
    signals = {tag: values for tag, values in truth.signals.items() if tag in d.tags_by_name}
    return {name: float(each[0]) for name, each in pricing.outside(signals, truth.dt_s).items()}


def _from(truth: Trajectory, at_s: float) -> Trajectory:
    """``truth`` from ``at_s`` [s] on."""
    first = int(np.searchsorted(truth.times_s, at_s))
    return Trajectory(float(truth.times_s[first]), truth.dt_s, {k: v[:, first:] for k, v in truth.signals.items()})
