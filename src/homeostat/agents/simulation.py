"""Simulation: action sets on the twin, under every plausible hypothesis."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from homeostat.domain.diagnosis import Diagnosis, Hypothesis
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


def plausible(diagnosis: Diagnosis, least: float = PLAUSIBLE, most: int = MOST) -> tuple[Hypothesis, ...]:
    """The hypotheses that a proposal must hold for, most probable first; at least one."""
    ranked = sorted(diagnosis.hypotheses, key=lambda h: -h.probability)
    kept = tuple(h for h in ranked if h.probability >= least)[:most]
    return kept or (Hypothesis((), 1.0),)


class TwinSimulation:
    """Implements :class:`homeostat.agents.crew.Simulation` over the twin."""

    def __init__(self, twin: Twin, tags: Mapping[str, Tag]) -> None:
        """``twin`` is shared with monitoring, which keeps it up to date."""
        self._twin = twin
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
