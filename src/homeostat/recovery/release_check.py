"""Rehearsal: the approved rollout, repeated from a fresh snapshot just before release."""

from __future__ import annotations

from collections.abc import Mapping

from homeostat.agents.checks import judge
from homeostat.agents.simulation import plausible
from homeostat.domain.behaviour import State
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.limits import Limits
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.tag import Tag
from homeostat.domain.verdict import Rollout, Verdict
from homeostat.twin.twin import Twin


class TwinReleaseCheck:
    """Implements :class:`homeostat.domain.ports.Rehearsal` over the twin."""

    def __init__(self, twin: Twin, limits: Limits, tags: Mapping[str, Tag]) -> None:
        """The same twin and limits as simulation and validation use."""
        self._twin, self._limits, self._tags = twin, limits, tags
        self._diagnosis: Diagnosis | None = None
        self._target: State | None = None
        self._path: RecoveryPath | None = None
        self.last: Rollout | None = None
        """The last rollout that was judged; None before the first."""

    def prepare(self, diagnosis: Diagnosis, target: State, path: RecoveryPath | None = None) -> None:
        """Under which diagnosis, towards which state and by which path the next action set was approved."""
        self._diagnosis, self._target, self._path = diagnosis, target, path

    def rehearse(self, fresh: tuple[Snapshot, ...], actions: ActionSet) -> Verdict:
        """The verdict after the ``fresh`` snapshots."""
        if self._diagnosis is None or self._target is None:
            raise RuntimeError("rehearse was called before prepare; there is no diagnosis to rehearse under")
        for snapshot in fresh:
            self._twin.observe(snapshot)
        rollout = self._twin.roll_out(actions, plausible(self._diagnosis))
        self.last = rollout
        return judge(actions, rollout, self._limits, self._target, self._tags, self._path)
