"""One run in which the fault is repaired, and how the plant came back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.unknown.causes import Cause
from homeostat.domain.events.recovery import FaultsEnded
from homeostat.evaluate import runner
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import Fault, departing, repaired, scenario_of
from homeostat.evaluate.score.scoring import outside_after
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant

AFTER_S = 1500.0
"""How long a fault is there before it is repaired [s]."""
FOLLOWED_S = 2700.0
"""How long the plant is followed after that [s]."""
WITHIN_S = 1800.0
"""In what time it should be back [s]."""


@dataclass(frozen=True, slots=True)
class Repair:
    """What one run came to; times count from the repair [s]."""

    fault: str
    severity: float
    onset_s: float
    seed: int
    outcome: str
    stopped: bool
    """Whether a fallback had stopped the plant before the repair."""
    stayed: bool
    """Whether it was in normal operation when the fault was repaired, and never left it again: there is no way back."""
    noticed_s: float | None
    """When recovery said that it is over."""
    back_s: float | None
    """When the plant entered the ordinary state that it ends in; None where it ends in none, or was there before."""
    off: dict[str, float]
    """Controlled variable -> furthest from its ramped setpoint after the return, in its unit."""
    outside_s: float
    """Seconds outside a hard limit from the repair on [s]."""

    @property
    def returned(self) -> bool:
        """Whether it was back in time."""
        return self.back_s is not None and self.back_s <= WITHIN_S


def measure_repair(plant: Plant, cause: Cause, seed: int, mismatch: str) -> Repair:
    """Run a fault of the tables that is repaired, with everything on; thinking costs one second."""
    (state,) = cause.faults
    repair_s = state.onset_s + AFTER_S
    told = scenario_of(plant, [Fault(state.fault, state.severity, state.onset_s)], seed, repair_s + FOLLOWED_S)
    chosen = repaired(departing(plant, told, (), mismatch), repair_s)
    run = runner.run(plant, chosen, MemoryTrace(), DeclaredClock(1.0))
    said = [e.at_s for e in run.record.entries if isinstance(e.event, FaultsEnded) and e.at_s >= repair_s]
    last, entered_s = list(run.record.states)[-1]
    ordinary = last in plant.description.machine.ordinary
    back_s = entered_s if ordinary and entered_s >= repair_s else None
    outside = outside_after(run.truth, run.force, repair_s)
    return Repair(
        state.fault,
        state.severity,
        state.onset_s,
        seed,
        run.outcome.value,
        any(at_s < repair_s and plant.description.machine.state(name).risk >= 5 for name, at_s in run.record.states),
        ordinary and entered_s < repair_s,
        said[0] - repair_s if said else None,
        None if back_s is None else back_s - repair_s,
        {} if back_s is None else _off(plant, run, back_s),
        float(len({float(at_s) for times in outside.values() for at_s in times})) * run.truth.dt_s,
    )


def _off(plant: Plant, run: Run, from_s: float) -> dict[str, float]:
    after = run.truth.times_s >= from_s
    signals = run.truth.signals
    return {
        loop.process_variable: float(
            np.abs(signals[loop.process_variable][0] - signals[loop.setpoint][0])[after].max(initial=0.0)
        )
        for loop in plant.description.loops
    }
