"""How often what was released violates a hard limit, where parameters are further off than the tables state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from benchmarks.decisions.measure import outside_s
from benchmarks.unknown.causes import Cause
from homeostat.evaluate import runner
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.proposing import Proposing
from homeostat.evaluate.scenario import Fault, departing, scenario_of
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant

SPREADS: Mapping[str, int] = {"none": 1, "twice": 2, "thrice": 3}
"""Mismatch of the true plant -> how many times their stated uncertainty its parameters are off [1]."""
ENSEMBLE, NOMINAL = "ensemble", "nominal"
"""Validators: what is released holds for all that is plausible, or for the likeliest fault and parameters alone."""


@dataclass(frozen=True, slots=True)
class Released:
    """What one run with a fault of the tables came to."""

    fault: str
    seed: int
    outcome: str
    released_s: float | None
    """When something was released first [s]; None where nothing was."""
    outside_s: float
    """Seconds outside a hard limit from then on [s]."""

    @property
    def violated(self) -> bool:
        """Whether a hard limit was violated after a release."""
        return self.outside_s > 0.0


def measure_risk(plant: Plant, cause: Cause, seed: int, mismatch: str) -> Released:
    """Run a fault of the tables with everything on, judged by all that is plausible; thinking costs one second."""
    return _measured(plant, cause, seed, mismatch, Conditions())


def measure_nominal(plant: Plant, cause: Cause, seed: int, mismatch: str) -> Released:
    """The same, judged by one rollout of what is likeliest, and released without a certificate."""
    return _measured(plant, cause, seed, mismatch, Conditions(ensemble=False))


def _measured(plant: Plant, cause: Cause, seed: int, mismatch: str, conditions: Conditions) -> Released:
    (state,) = cause.faults
    told = scenario_of(plant, [Fault(state.fault, state.severity, state.onset_s)], seed)
    chosen = departing(plant, told, (), mismatch)
    run = runner.run(plant, chosen, MemoryTrace(), DeclaredClock(1.0), Proposing(conditions=conditions))
    at_s = run.released_s
    return Released(
        state.fault, seed, run.outcome.value, at_s, 0.0 if at_s is None else outside_s(run.truth, run.force, at_s)
    )
