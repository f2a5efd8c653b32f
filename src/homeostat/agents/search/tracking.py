"""Tracking: the controller of a stuck actuator is held by hand, so that nothing winds up behind it.

A controller of a stuck actuator drives its command to the end of its range; repaired, the actuator goes there at once.
By hand the command stands where the controller would have it if the actuator moved: repaired, it goes there, and the
integral has followed. Where that is where it is stuck, it stands a little beside it, so that a repair is seen.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from statistics import fmean

from homeostat.agents.hypotheses import plausible
from homeostat.agents.roles import Situation
from homeostat.agents.search.candidates import SearchSpace
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, Command
from homeostat.process.batch import ProcessError
from homeostat.twin.twin import Twin

STUCK = 0.9
"""An actuator that is taken away with this probability is held [1]."""
BESIDE = 0.06
"""How far from its position it is commanded to stand at least, as a share of its range [1]."""
LAST_S = 60.0
"""Stretch at the end of a rollout in which a controller has come to where it stays [s]."""
SETTLED_S = 2.0
"""After it got stuck, when an actuator has come to where it stays [s]."""
READ = 30
"""Readings whose mean is the position."""


def held(plant: PlantDescription, situation: Situation) -> dict[str, float]:
    """Manual output -> where the actuator behind it stands, of each that is stuck."""
    found = {}
    for signal in plant.signals:
        if signal.relation is Relation.OVERRIDES and _taken_away(plant, situation.diagnosis, signal.component):
            position = _position(plant, situation, signal.component)
            if position is not None:
                found[signal.tag.name] = signal.tag.nearest(signal.tag.range.clip(position))
    return found


def tracking(plant: PlantDescription, twin: Twin, actions: ActionSet, stuck: Mapping[str, float]) -> ActionSet:
    """``actions`` with the manual outputs of ``stuck`` actuators where their controllers would come to if they moved.

    Where their state leaves no choice, or a healthy plant would leave the physical world, they stay as they are.
    """
    choices = {r.tag: r for r in plant.machine.state(actions.target).setpoints if r.high > r.low}
    outputs = [c.tag for c in actions.commands if c.tag in stuck and c.tag in choices]
    if not outputs:
        return actions
    free = tuple(Command(c.tag, None, None) if c.tag in outputs else c for c in actions.commands)
    healthy = twin.ensemble((Hypothesis((), 1.0),), twin.settings.search_draws)
    try:
        schedules = twin.schedules([replace(actions, commands=free)], twin.horizon)
        signals, dt_s = twin.try_many(healthy, schedules)
    except ProcessError:
        return actions
    last, commands = math.ceil(twin.timing.time_s(LAST_S) / dt_s), []
    for c in actions.commands:
        if c.tag in outputs:
            wanted = float(signals[plant.overridden[c.tag]][:, -last:].mean())
            stands = _beside(plant.tag(c.tag), choices[c.tag], stuck[c.tag], wanted)
            c = Command(c.tag, stands, plant.tag(c.tag).rate_limit)
        commands.append(c)
    return replace(actions, commands=tuple(commands))


def _beside(tag: Tag, admitted: SetpointRange, position: float, wanted: float) -> float:
    """What is commanded of an actuator that is stuck at ``position`` and would be ``wanted`` elsewhere."""
    least = BESIDE * tag.range.span
    if abs(wanted - position) < least:
        wanted = position + math.copysign(least, wanted - position)
    if not admitted.low <= wanted <= admitted.high:
        wanted = position - least if position + least > admitted.high else position + least
    if tag.increment is not None:
        wanted = round(round(wanted / tag.increment) * tag.increment, 9)
    return min(max(wanted, admitted.low), admitted.high)


def search_space(plant: PlantDescription, state: State, fixed: Mapping[str, float]) -> SearchSpace:
    """What may be commanded in ``state``, where the outputs that are ``fixed`` have no other value."""
    ranges = tuple(
        SetpointRange(r.tag, fixed[r.tag], fixed[r.tag], fixed[r.tag])
        if r.tag in fixed and r.low <= fixed[r.tag] <= r.high and r.high > r.low
        else r
        for r in state.setpoints
    )
    return SearchSpace(replace(state, setpoints=ranges), plant.tags_by_name)


def _taken_away(plant: PlantDescription, diagnosis: Diagnosis, component: str) -> bool:
    """Whether ``component`` is probably not to be relied on."""
    taken = sum(
        h.probability
        for h in plausible(diagnosis)
        if any(plant.fault_mode(f.fault).disables == component for f in h.faults)
    )
    return taken >= STUCK


def _position(plant: PlantDescription, situation: Situation, component: str) -> float | None:
    """Where an actuator has stood lately, and since it is stuck; None where nothing shows it."""
    tag, since_s = plant.positions.get(component, ""), _stuck_since(situation) + SETTLED_S
    every = [s for s in situation.recent if tag in s.values and tag not in s.bad]
    read = [s.values[tag] for s in every if s.at_s >= since_s][-READ:] or [s.values[tag] for s in every[-1:]]
    return fmean(read) if read else None


def _stuck_since(situation: Situation) -> float:
    """When what is most probable began [s]."""
    return max((f.onset_s for f in plausible(situation.diagnosis)[0].faults), default=-math.inf)
