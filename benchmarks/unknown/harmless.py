"""Whether what is called harmless is: which criteria and limits a run with nobody acting does not satisfy."""

from __future__ import annotations

import numpy as np

from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.unsupervised import unsupervised
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.evaluate.score.scoring import exposures
from homeostat.plants.plant import Plant

STARTED_S = {"cstr": 600.0, "mixing_module": 1.0}
"""Plant -> when its start-up is over [s]."""


def violated(plant: Plant, scenario: Scenario) -> tuple[str, ...]:
    """Acceptance criteria, judged as if the disturbance were a recovery, and hard limits that are not kept."""
    truth = unsupervised(plant, scenario).truth
    limits = plant.description.limits
    hard = {limit.name for limit in limits.hard}
    force = LimitsInForce.after(plant.description, STARTED_S[plant.name])
    outside = [e.limit for e in exposures(truth, force, None) if e.total_s > 0.0 and e.limit in hard]
    after = _from(truth, plant.onset_s if scenario.onset_s is None else scenario.onset_s)
    criteria = [c.name for c in limits.criteria if not c.formula.evaluate(after.signals, after.dt_s).value >= 0.0]
    return (*outside, *criteria)


def _from(truth: Trajectory, at_s: float) -> Trajectory:
    """``truth`` from ``at_s`` [s] on."""
    first = int(np.searchsorted(truth.times_s, at_s))
    return Trajectory(float(truth.times_s[first]), truth.dt_s, {k: v[:, first:] for k, v in truth.signals.items()})
