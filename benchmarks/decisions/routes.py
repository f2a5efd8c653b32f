"""A reference policy for batches: the route that costs least from detection on, by hindsight, on the true plant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from homeostat.agents.search.candidates import design_commands
from homeostat.domain.plant.state_machine import State
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, open_setpoints
from homeostat.domain.snapshot import Snapshot, Trajectory
from homeostat.evaluate.reference.alternatives import diverted_run
from homeostat.evaluate.reference.unsupervised import Unsupervised, open_process, unsupervised, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.score.costs import run_cost
from homeostat.evaluate.score.limits_in_force import in_force
from homeostat.evaluate.score.scoring import outside_after
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import new_sequencer

LEVELS = 3
"""Values of each open command that are tried."""


@dataclass(frozen=True, slots=True)
class BestRoute:
    """The route of the least cost that keeps every hard limit from detection on."""

    states: tuple[str, ...]
    """What it leads through; empty where the batch is left alone."""
    cost: float
    """What it costs from detection to the end of the run, in points of the design product."""


def best_route_from(plant: Plant, scenario: Scenario, healthy: Trajectory, from_s: float) -> BestRoute | None:
    """The best way on from the state that an unsupervised batch is in at ``from_s`` [s]; None where none is safe.

    Leaving it alone is one of the ways; of every other one each set of instruments, and every combination of
    :data:`LEVELS` values of what is open on the way, is tried on the same true plant.
    """
    found = []
    alone = unsupervised(plant, scenario)
    for states, releases, run in ((), 0, alone), *_diverted(plant, scenario, alone, from_s):
        if outside_after(run.truth, in_force(plant.description, run.states, run.truth.start_s), from_s):
            continue
        cost = run_cost(plant, run.truth, healthy, from_s, run.states, releases)
        found.append(BestRoute(states, 100.0 * cost.share))
    return min(found, key=lambda route: route.cost, default=None)


def _diverted(
    plant: Plant, scenario: Scenario, alone: Unsupervised, from_s: float
) -> Iterator[tuple[tuple[str, ...], int, Unsupervised]]:
    """What comes of every other way on: the states of the way, the number of releases, the run."""
    now = [state for state, entered_s in alone.states if entered_s <= from_s][-1]
    for path in ways(plant, now, _seen(plant, scenario, from_s)):
        opened = {
            r.tag: sorted(set(map(plant.description.tag(r.tag).nearest, np.linspace(r.low, r.high, LEVELS).tolist())))
            for r in open_setpoints([plant.description.machine.state(name) for name in path.commanded])
        }
        for values in product(*opened.values()):
            actions = ActionSet.along(path, partial(_of, plant, dict(zip(opened, values, strict=True))))
            run = diverted_run(plant, scenario, from_s, actions)
            if run is not None:
                yield path.states, 1, run


def _seen(plant: Plant, scenario: Scenario, at_s: float) -> Snapshot:
    """What an unsupervised batch shows at ``at_s`` [s]."""
    shown: list[Snapshot] = []

    def reached(snapshot: Snapshot) -> bool:
        shown[:] = [snapshot]
        return snapshot.at_s >= at_s

    watch(open_process(plant, scenario), new_sequencer(plant).sample, reached)
    return shown[0]


def ways(plant: Plant, now: str, seen: Snapshot) -> Iterator[RecoveryPath]:
    """Every way on from ``now``, by each set of instruments that guards on the way may read."""
    machine = plant.description.machine
    measured = set(plant.description.variables) & {tag for t in machine.transitions for tag in t.guard.tags}
    found = {}
    for lying in ((), *((tag,) for tag in sorted(measured))):
        for way in machine.paths(now, seen.values, machine.recovery_event, (), unreliable=lying):
            found[way] = RecoveryPath(machine, way)
    yield from found.values()


def _of(plant: Plant, values: dict[str, float], state: State) -> tuple[Command, ...]:
    """What ``state`` is commanded: by design, and ``values`` where it leaves a choice."""
    opened = {r.tag for r in state.open_setpoints}
    designed = design_commands(state, plant.description.tags_by_name)
    return tuple(replace(c, value=values[c.tag]) if c.tag in opened and c.tag in values else c for c in designed)
