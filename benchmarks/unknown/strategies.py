"""What else could have been done about a run, on its true plant: the cheapest first, and only where it is asked."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np

from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Trajectory
from homeostat.evaluate.reference.alternatives import diverted, released_set
from homeostat.evaluate.reference.best_route import best_route, sequencer_along
from homeostat.evaluate.reference.unsupervised import once, open_process, watch
from homeostat.evaluate.run import Run
from homeostat.evaluate.score.scoring import kept_until, outside_after, worse
from homeostat.guard.sequence.sequencer import Sequencer
from homeostat.plants.wired.assembly import fallbacks, new_sequencer
from homeostat.process.batch import ProcessError
from homeostat.process.types import Vec

LEVELS = 3
"""Values of each setpoint that are tried, and its design value."""
NONE = ""
"""Name of no strategy."""


def kept_by(done: Run, outside: dict[str, Vec], from_s: float) -> str:
    """The first strategy that keeps a hard limit that ``done`` does not: name; empty where none of them does.

    ``outside``: limit -> times after ``from_s`` at which ``done`` is outside [s]. What is outside at ``from_s`` already
    is kept by what brings it back.
    """
    for name, truth in _tried(done, from_s):
        if truth is None:
            continue
        until = kept_until(outside_after(truth, done.force, from_s), truth, done.force.settled_s(from_s))
        if until is not None and worse(outside, until):
            return name
    return NONE


def _tried(done: Run, from_s: float) -> Iterator[tuple[str, Trajectory | None]]:
    """Each strategy with the true values of the same plant under it; None where it leaves the physical world.

    Left alone is local control, too: the plant's own recipe and controllers.
    """
    plant, scenario, record = done.plant, done.scenario, done.record
    yield "left alone", _by(done, new_sequencer(plant))
    for strategy in fallbacks(plant):
        yield f"fallback {strategy.name}", diverted(plant, scenario, from_s, strategy.actions, aborting=True)
    for release in record.released:
        actions = released_set(plant, release, record.attempts)
        if actions is not None:
            yield f"released at {release.at_s:.0f} s", diverted(plant, scenario, from_s, actions)
    if done.nominal_s is None:
        yield from _constants(done, from_s)
    elif (route := best_route(plant, scenario)) is not None:
        yield "best route", _by(done, sequencer_along(plant, route.path, route.values))


def _constants(done: Run, from_s: float) -> Iterator[tuple[str, Trajectory | None]]:
    """Setpoints that are ramped to from ``from_s`` [s] on, at their rate limits, and then stay: a grid of them."""
    machine, tags = done.plant.description.machine, done.plant.description.tags_by_name
    choices = max((s.open_setpoints for s in machine.states if s.recovery_target), key=len)
    ranges = [r for r in choices if r.design is not None]
    levels = [sorted({*np.linspace(r.low, r.high, LEVELS).tolist(), r.design}) for r in ranges]
    for point in product(*levels):
        values = {r.tag: value for r, value in zip(ranges, point, strict=True)}
        commands = tuple(Command(tag, value, tags[tag].rate_limit) for tag, value in values.items())
        text = ", ".join(f"{tag} = {value:g}" for tag, value in values.items())
        yield f"constant {text}", _by(done, new_sequencer(done.plant), from_s, commands)


def _by(done: Run, sequencer: Sequencer, at_s: float = np.inf, commands: tuple[Command, ...] = ()) -> Trajectory | None:
    """True values with nobody but ``sequencer``, ``commands`` being given at ``at_s`` [s]."""
    process = open_process(done.plant, done.scenario)
    try:
        return watch(process, once(sequencer, at_s, partial(_given, commands))).truth()
    except ProcessError:
        return None


def _given(commands: tuple[Command, ...], at_s: float) -> tuple[Command, ...]:
    """``commands``, whenever they are asked for."""
    return commands
