"""Trial: a plant that nobody supervises, simulated and shown, before anything was learned of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from homeostat.domain.events.guard import StateEntered
from homeostat.domain.outcome import Outcome
from homeostat.domain.plant.limits import LimitKind
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.limits_in_force import LimitsInForce
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.record.run_record import RunRecord


@dataclass(frozen=True, slots=True)
class Missed:
    """A trip limit or envelope that did not hold."""

    name: str
    """Its name."""
    formula: str
    """What was to hold."""
    hard: bool
    """Whether it must hold, and not only should."""
    first_s: float
    """When it did not hold first [s]."""
    total_s: float
    """For how long in all [s]."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A run in which nobody acts but the recipe; a :class:`homeostat.record.figure.shown.ShownRun`."""

    plant: Plant
    """The plant."""
    scenario: Scenario
    """What was truly wrong."""
    record: RunRecord
    """The states that were entered."""
    truth: Trajectory
    """True values."""
    measured: Trajectory
    """What the instruments said."""
    missed: tuple[Missed, ...]
    """Limits that did not hold, those that must hold first."""
    detected_s: None = None
    """Nobody watches."""
    complete_s: None = None
    """Nobody follows a batch."""
    nominal_s: None = None
    """Nobody compares it with another run."""

    @property
    def state(self) -> str:
        """The state at its end; that at its start where it never left start-up."""
        states = self.record.states
        return states[-1][0] if states else self.plant.description.machine.initial.name

    @property
    def started_s(self) -> float:
        """When it left start-up, which may have several states [s]; infinite where it did not."""
        rules = self.plant.description.start_up.states
        return next((at_s for state, at_s in self.record.states if state not in rules), math.inf)

    @property
    def longest_s(self) -> float:
        """How long its tables say that start-up takes at most [s]; infinite where they do not."""
        return min(self.plant.description.start_up.longest_s.values(), default=math.inf)

    @property
    def late(self) -> bool:
        """Whether start-up took longer than the tables say, or had not ended by then."""
        return min(self.started_s, self.scenario.end_s) > self.longest_s

    @property
    def well(self) -> bool:
        """Whether it left start-up in its time and kept every hard limit."""
        return math.isfinite(self.started_s) and not self.late and not any(each.hard for each in self.missed)

    @property
    def outcome(self) -> Outcome:
        """Whether a hard limit was violated."""
        return Outcome.LIMIT_VIOLATED if any(each.hard for each in self.missed) else Outcome.NO_ACTION


def try_out(plant: Plant, scenario: Scenario) -> Trial:
    """``scenario`` with nobody acting but the recipe; ProcessError where the plant leaves the physical world."""
    sequencer, record = new_sequencer(plant), RunRecord()
    process = watch(open_process(plant, scenario), sequencer.sample)
    for state, at_s in sequencer.drain():
        record(StateEntered(state), at_s)
    truth = process.truth()
    missed = _missed(plant, truth, record.started_s(math.inf))
    return Trial(plant, scenario, record, truth, process.measured(), missed)


def _missed(plant: Plant, truth: Trajectory, started_s: float) -> tuple[Missed, ...]:
    """Limits that did not hold: those of start-up until ``started_s`` [s], the usual ones after it."""
    found, force = [], LimitsInForce.after(plant.description, started_s)
    for limit in plant.description.limits.limits:
        if limit.kind is LimitKind.PERMISSIVE:
            continue
        outside = force.outside(limit, truth)
        if outside.any():
            first_s = float(truth.times_s[np.argmax(outside)])
            found.append(Missed(limit.name, str(limit.formula), limit.hard, first_s, float(outside.sum()) * truth.dt_s))
    return tuple(sorted(found, key=lambda each: (not each.hard, each.first_s)))
