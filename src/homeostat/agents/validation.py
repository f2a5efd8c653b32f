"""Validation: the deterministic judgement of a rollout."""

from collections.abc import Mapping

from homeostat.agents.checks import judge
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.state_machine import State
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Rollout, Verdict


class LimitValidation:
    """Implements :class:`homeostat.agents.roles.Validation` with the limits of the graph."""

    def __init__(self, limits: Limits, tags: Mapping[str, Tag]) -> None:
        """The same ``limits`` that the guard reads."""
        self._limits = limits
        self._tags = tags

    def judge(self, actions: ActionSet, rollout: Rollout, target: State, path: RecoveryPath | None = None) -> Verdict:
        """Approve only if every criterion, permissive and command check holds in every member."""
        return judge(actions, rollout, self._limits, target, self._tags, path)
