"""The best route by hindsight: every way through the machine, on the true plant; no agent may see it."""

from __future__ import annotations

import itertools
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from homeostat.domain.plant.description import Relation
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.state_machine import State, Transition
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step, open_setpoints
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.plants.plant import Plant

LEVELS = 3
"""Values of each open command that are tried."""
MOST = 256
"""Most scenarios whose best route is remembered."""
_found: OrderedDict[tuple[int, Scenario], tuple[Plant, Route | None]] = OrderedDict()


@dataclass(frozen=True, slots=True)
class Route:
    """One way to run the batch from its start, and what came of it."""

    path: RecoveryPath
    """The way through the machine."""
    values: Mapping[str, float]
    """Values of the commands that are open on the way."""
    complete_s: float | None
    """Process time at which it ended [s]; None where it did not end, or violated a hard limit or criterion."""

    @property
    def states(self) -> tuple[str, ...]:
        """States on the way."""
        return self.path.states


def best_route(plant: Plant, scenario: Scenario) -> Route | None:
    """The route of the earliest completion inside every limit; None where none is possible. The last are remembered."""
    key = id(plant), scenario
    if key not in _found:
        _found[key] = plant, _search(plant, scenario)  # the plant keeps its number
        if len(_found) > MOST:
            _found.popitem(last=False)
    return _found[key][1]


def _search(plant: Plant, scenario: Scenario) -> Route | None:
    tried = (_carry_out(plant, scenario, path, values) for path, values in _ways(plant))
    complete = [r for r in tried if r.complete_s is not None]
    return min(complete, key=lambda r: r.complete_s or 0.0, default=None)


def _ways(plant: Plant) -> Iterator[tuple[RecoveryPath, dict[str, float]]]:
    """Every path from the initial state to an end, by each set of instruments, with every combination of values."""
    machine = plant.description.machine
    measured = {s.tag.name for s in plant.description.signals if s.relation is Relation.MEASURES}
    read = sorted({tag for t in machine.transitions if not t.on_decision for tag in t.guard.tags} & measured)
    found: dict[tuple[Transition, ...], None] = {}
    for lying in ((), *((tag,) for tag in read)):
        for way in machine.paths(machine.initial.name, {}, machine.recovery_event, (), longest=0, unreliable=lying):
            found[way] = None
    for transitions in found:
        path = RecoveryPath(machine, transitions)
        if not machine.is_end(path.target, machine.recovery_event):
            continue
        ranges = {
            r.tag: sorted(set(map(plant.description.tag(r.tag).nearest, np.linspace(r.low, r.high, LEVELS).tolist())))
            for r in open_setpoints([machine.state(name) for name in path.states])
        }
        for values in itertools.product(*ranges.values()):
            yield path, dict(zip(ranges, values, strict=True))


def _carry_out(plant: Plant, scenario: Scenario, path: RecoveryPath, values: Mapping[str, float]) -> Route:
    """Run the batch along ``path`` with nobody watching."""
    description, sequencer = plant.description, sequencer_along(plant, path, values)
    process = watch(open_process(plant, scenario), sequencer.sample, lambda snapshot: sequencer.state == path.target)
    complete = sequencer.state == path.target and inside(process.truth(), description.limits)
    at_s = sequencer.drain()[-1][1] if complete else None
    return Route(path, dict(values), at_s)


def sequencer_along(plant: Plant, path: RecoveryPath, values: Mapping[str, float]) -> Sequencer:
    """A sequencer that runs the batch along ``path``; ``values``: tag -> value of what is open on the way."""
    steps = ActionSet.along(path, partial(_commands, plant, values)).then
    chosen = tuple(Step(s.transition, s.commands) for s in steps)
    return Sequencer(plant.description.machine, plant.description.limits, chosen)


def _commands(plant: Plant, values: Mapping[str, float], state: State) -> tuple[Command, ...]:
    tags = plant.description.tags_by_name
    return tuple(
        Command(r.tag, values.get(r.tag, r.design) if r.high > r.low else r.design, tags[r.tag].rate_limit)
        for r in state.setpoints
    )


def inside(truth: Trajectory, limits: Limits) -> bool:
    """Whether every hard limit and hard criterion holds throughout."""
    kept = [limit.formula.margins(truth.signals, truth.dt_s).min() >= 0.0 for limit in limits.hard]
    met = [c.formula.evaluate(truth.signals, truth.dt_s).value.min() >= 0.0 for c in limits.criteria if c.hard]
    return all((*kept, *met))
