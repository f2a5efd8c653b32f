"""Tracking: the controller of a stuck actuator is held by hand, so that nothing winds up behind it.

A controller of a stuck actuator drives its command to the end of its range; repaired, the actuator goes there at once.
By hand the command stands where the controller would have it if the actuator moved: repaired, it goes there, and the
integral has followed. Where that is where it is stuck, it stands beside it, so that a repair is seen: on the side on
which the plant fares better once the actuator moves, for which nobody knows the time.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from statistics import fmean
from typing import TypeAlias

import numpy as np

from homeostat.agents.hypotheses import plausible
from homeostat.agents.roles import Situation
from homeostat.agents.search.candidates import SearchSpace
from homeostat.domain.diagnosis import Diagnosis, EffectKind, Hypothesis
from homeostat.domain.plant.description import PlantDescription, Relation
from homeostat.domain.plant.state_machine import SetpointRange, State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, Command
from homeostat.process.batch import ProcessError
from homeostat.process.types import Vec
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Twin

STUCK = 0.9
"""An actuator that is taken away with this probability is held [1]."""
BESIDE = 0.1
"""How far from its position it is commanded to stand at least, as a share of its range [1].

Where it is stuck is known within some hundredths: from what it is repaired to, explanations must differ by more.
"""
LAST_S = 60.0
"""Stretch at the end of a rollout in which a controller has come to where it stays [s]."""
SETTLED_S = 2.0
"""After it got stuck, when an actuator has come to where it stays [s]."""
READ = 30
"""Readings whose mean is the position."""

Judge: TypeAlias = Callable[[Sequence[ActionSet], Ensemble], Vec]
"""Cost of each of the action sets over an ensemble [1]."""


def held(plant: PlantDescription, situation: Situation) -> dict[str, float]:
    """Manual output -> where the actuator behind it stands, of each that is stuck."""
    found = {}
    for signal in plant.signals:
        if signal.relation is Relation.OVERRIDES and _taken_away(plant, situation.diagnosis, signal.component):
            position = _position(plant, situation, signal.component)
            if position is not None:
                found[signal.tag.name] = signal.tag.nearest(signal.tag.range.clip(position))
    return found


def blind(plant: PlantDescription, situation: Situation) -> dict[str, float]:
    """Manual output -> where its controller has it now, of each whose controller goes by a frozen instrument.

    What such a controller does is no answer to anything: it runs away by what is left of its error.
    """
    measured = {s.variable: s.tag.name for s in plant.signals if s.relation is Relation.MEASURES}
    frozen = {mode.name: measured.get(mode.effect.quantity, "") for mode in plant.fault_modes
              if mode.effect is not None and mode.effect.kind is EffectKind.FROZEN}  # fmt: skip
    manual, found = {command: tag for tag, command in plant.overridden.items()}, {}
    for loop in plant.loops:
        output = manual.get(loop.manipulated_variable, "")
        now = situation.snapshot.values.get(loop.manipulated_variable, math.nan)
        showing = {name for name, tag in frozen.items() if tag == loop.process_variable}
        likely = sum(h.probability for h in plausible(situation.diagnosis) if any(f.fault in showing for f in h.faults))
        if output and likely >= STUCK and math.isfinite(now):
            tag = plant.tag(output)
            found[output] = tag.nearest(tag.range.clip(now))
    return found


def tracking(
    plant: PlantDescription, twin: Twin, actions: ActionSet, stuck: Mapping[str, float], judge: Judge
) -> ActionSet:
    """``actions`` with the manual outputs of ``stuck`` actuators where their controllers would come to if they moved.

    Where that is where they are stuck, beside it, where ``judge`` finds a healthy plant to fare best. Where their state
    leaves no choice, or a healthy plant would leave the physical world, they stay as they are.
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
    last, found = math.ceil(twin.timing.time_s(LAST_S) / dt_s), replace(actions, commands=free)
    for output in outputs:
        wanted = float(signals[plant.overridden[output]][:, -last:].mean())
        tag, admitted = plant.tag(output), choices[output]
        places = dict.fromkeys(_stands(tag, admitted, v) for v in _beside(tag, admitted, stuck[output], wanted))
        sets = [_commanded(found, Command(output, value, tag.rate_limit)) for value in places]
        found = sets[0] if len(sets) == 1 else sets[int(np.argmin(judge(sets, healthy)))]
    return found


def _commanded(actions: ActionSet, command: Command) -> ActionSet:
    """``actions`` with ``command`` in place of what they command of its tag."""
    return replace(actions, commands=tuple(command if c.tag == command.tag else c for c in actions.commands))


def _beside(tag: Tag, admitted: SetpointRange, position: float, wanted: float) -> list[float]:
    """Where what is stuck at ``position`` and would be ``wanted`` elsewhere may be commanded to stand."""
    least = BESIDE * tag.range.span
    if abs(wanted - position) >= least and admitted.low <= wanted <= admitted.high:
        return [wanted]
    sides = [position + math.copysign(least, wanted - position), position - math.copysign(least, wanted - position)]
    return [side for side in sides if admitted.low <= side <= admitted.high] or [sides[0]]


def _stands(tag: Tag, admitted: SetpointRange, value: float) -> float:
    """The nearest to ``value`` that may be commanded."""
    if tag.increment is not None:
        value = round(round(value / tag.increment) * tag.increment, 9)
    return min(max(value, admitted.low), admitted.high)


def search_space(
    plant: PlantDescription, state: State, fixed: Mapping[str, float], by_hand: Mapping[str, float] | None = None
) -> SearchSpace:
    """What may be commanded in ``state``, where the outputs that are ``fixed`` have no other value.

    Those that are ``by_hand`` have any value, but are not on automatic; where they are now is no change.
    """

    def of(r: SetpointRange) -> SetpointRange:
        if r.high > r.low and r.low <= fixed.get(r.tag, math.nan) <= r.high:
            return SetpointRange(r.tag, fixed[r.tag], fixed[r.tag], fixed[r.tag])
        if r.high > r.low and r.design is None and by_hand and r.tag in by_hand:
            return replace(r, design=min(max(by_hand[r.tag], r.low), r.high))
        return r

    return SearchSpace(replace(state, setpoints=tuple(map(of, state.setpoints))), plant.tags_by_name)


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
