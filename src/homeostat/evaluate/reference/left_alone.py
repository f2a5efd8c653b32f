"""What would have come of a run had nobody acted, in the currency that decisions go by."""

import math
from dataclasses import dataclass

from homeostat.domain.cost import Cost
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.unsupervised import unsupervised
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.costs import run_cost
from homeostat.evaluate.score.limits_in_force import in_force
from homeostat.evaluate.score.scoring import SAME_LOSS, outside_after
from homeostat.plants.plant import Plant
from homeostat.process.batch import ProcessError


@dataclass(frozen=True, slots=True)
class LeftAlone:
    """The same plant with the same faults and noise, commanded by its recipe alone."""

    keeps: bool
    """Whether it keeps every hard limit."""
    cost: Cost
    """What it costs over the span that the run is priced over, in the plant's currency."""
    same: float
    """Costs that differ by no more than this are the same, in the plant's currency."""

    def costs_no_more(self, cost: Cost) -> bool:
        """Whether it costs no more than a run that cost ``cost``. What is not known is never no more."""
        return math.isfinite(self.cost.total) and self.cost.total <= cost.total + self.same

    def makes_needless(self, cost: Cost) -> bool:
        """Whether it keeps every hard limit and costs no more than a run that cost ``cost``."""
        return self.keeps and self.costs_no_more(cost)


def left_alone(plant: Plant, scenario: Scenario, healthy: Trajectory, from_s: float) -> LeftAlone | None:
    """``scenario`` with nobody acting, priced from ``from_s`` [s] on against the fault-free ``healthy``.

    None where the plant leaves the physical world.
    """
    try:
        alone = unsupervised(plant, scenario)
    except ProcessError:
        return None
    truth, description = alone.truth, plant.description
    force = in_force(description, alone.states, truth.start_s)
    worth = plant.prices.worth(max(float(truth.times_s[-1]) - from_s, 0.0))
    cost = run_cost(plant, truth, healthy, from_s, alone.states, force=force)
    return LeftAlone(not outside_after(truth, force), cost, SAME_LOSS * worth)
