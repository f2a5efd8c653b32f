"""Simulation: action sets on the twin, under every plausible hypothesis."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from homeostat.assurance.checks import target_name
from homeostat.domain.advice import Sensitivity
from homeostat.domain.behaviour import SetpointRange, State
from homeostat.domain.diagnosis import Diagnosis, Hypothesis
from homeostat.domain.limits import Criterion, Limit, Limits
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.tag import Tag
from homeostat.domain.verdict import Rollout
from homeostat.twin.twin import Twin

PLAUSIBLE = 0.02
"""Hypotheses below this probability are not rolled out [1]."""
RULED_OUT = 0.05
"""Below this a hypothesis no longer keeps a reading from being corrected [1]."""
MOST = 10
"""Most hypotheses that are rolled out."""
LIKELY = 0.05
"""Hypotheses below this are left out of finite differences [1]."""
STEP = 0.02
"""Step of a finite difference as a fraction of the command's range [1]."""


def plausible(diagnosis: Diagnosis, least: float = PLAUSIBLE, most: int = MOST) -> tuple[Hypothesis, ...]:
    """The hypotheses that a proposal must hold for, most probable first; at least one."""
    ranked = sorted(diagnosis.hypotheses, key=lambda h: -h.probability)
    kept = tuple(h for h in ranked if h.probability >= least)[:most]
    return kept or (Hypothesis((), 1.0),)


class TwinSimulation:
    """Implements :class:`homeostat.agents.crew.Simulation` over the twin."""

    def __init__(self, twin: Twin, tags: Mapping[str, Tag], limits: Limits) -> None:
        """``twin`` is shared with monitoring, which keeps it up to date."""
        self._twin = twin
        self._rules: dict[str, Criterion | Limit] = {}
        self._rules |= {c.name: c for c in limits.criteria} | {x.name: x for x in limits.limits}
        self._scales = {name: tag.scale for name, tag in tags.items()}

    def observe(self, snapshots: tuple[Snapshot, ...]) -> None:
        """Bring the twin up to the present."""
        for snapshot in snapshots:
            self._twin.observe(snapshot)

    def instrument_errors(self, diagnosis: Diagnosis) -> tuple[Mapping[str, float], ...]:
        """Errors of at least one scale of the tag, under every hypothesis that is not all but ruled out."""
        likely = plausible(diagnosis, RULED_OUT)
        scale = self._scales
        found = self._twin.instrument_errors(likely)
        return tuple({t: e for t, e in errors.items() if abs(e) >= scale[t]} for errors in found)

    async def roll_out(self, diagnosis: Diagnosis, actions: ActionSet) -> Rollout:
        """What ``actions`` would do; runs beside the event loop, so that deadlines are kept."""
        return await asyncio.to_thread(self._twin.roll_out, actions, plausible(diagnosis))

    async def sensitivities(
        self, diagnosis: Diagnosis, actions: ActionSet, target: State, criteria: Sequence[str]
    ) -> tuple[Sensitivity, ...]:
        """Central differences over the ensemble, every variation in one call of the engine."""
        return await asyncio.to_thread(self._differences, diagnosis, actions, target, criteria)

    def _differences(
        self, diagnosis: Diagnosis, actions: ActionSet, target: State, criteria: Sequence[str]
    ) -> tuple[Sensitivity, ...]:
        pairs = [(r, *_neighbours(actions, r)) for r in target.setpoints if _varies(actions, r)]
        if not pairs:
            return ()
        ensemble = self._twin.ensemble(plausible(diagnosis, LIKELY), self._twin.settings.draws, purpose=-1)
        horizon, members = self._twin.settings.horizon_s, len(ensemble.states)
        varied = [_with(actions, r.tag, value) for r, low, high in pairs for value in (low, high)]
        signals, dt_s = self._twin.try_many(ensemble, np.stack([self._twin.schedule(a, horizon) for a in varied]))
        found = []
        for name in criteria:
            rule = self._rules.get(name)
            formula = target.settled_when if name == target_name(target) else rule.formula if rule else None
            if formula is None:
                continue
            if isinstance(rule, Criterion):
                margins = formula.evaluate(signals, dt_s).value
            else:
                over_time = np.atleast_2d(formula.margins(signals, dt_s))
                margins = over_time.min(axis=1) if rule else over_time[:, -1]
            worst = np.broadcast_to(margins, (len(varied) * members,)).reshape(len(varied), members).min(axis=1)
            for k, (r, low, high) in enumerate(pairs):
                slope = float(worst[2 * k + 1] - worst[2 * k]) / (high - low)
                found.append(Sensitivity(name, r.tag, slope))
        return tuple(found)


def _varies(actions: ActionSet, admitted: SetpointRange) -> bool:
    """Whether the command can be moved a little: it has a value, and its range has a width."""
    command = actions.command(admitted.tag)
    return command is not None and command.value is not None and admitted.high > admitted.low


def _neighbours(actions: ActionSet, admitted: SetpointRange) -> tuple[float, float]:
    """Values a step below and above the proposal, inside the range."""
    command = actions.command(admitted.tag)
    assert command is not None and command.value is not None
    step = STEP * (admitted.high - admitted.low)
    value = min(max(command.value, admitted.low), admitted.high)
    return max(value - step, admitted.low), min(value + step, admitted.high)


def _with(actions: ActionSet, tag: str, value: float) -> ActionSet:
    """The action set with another value of one command."""
    changed = tuple(replace(c, value=value) if c.tag == tag else c for c in actions.commands)
    return ActionSet(changed, actions.target)
