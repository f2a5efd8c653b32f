"""What every action agent must do. A test class inherits this and says which agent it is about."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping

from homeostat.agents.checks import command_findings
from homeostat.agents.roles import Action, Situation
from homeostat.domain.advice import Advice
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, RecoveryPath


class ActionContract:
    """Inherit, and provide the fixtures ``action``, ``situation``, ``path`` and ``tags``."""

    def test_the_commands_lead_to_the_path_s_target(
        self, action: Action, situation: Situation, path: RecoveryPath
    ) -> None:
        actions = asyncio.run(action.act(situation, path, Advice()))
        assert isinstance(actions, ActionSet) and actions.target == path.target

    def test_the_commands_are_what_the_target_state_admits(
        self, action: Action, situation: Situation, path: RecoveryPath, tags: Mapping[str, Tag]
    ) -> None:
        actions = asyncio.run(action.act(situation, path, Advice()))
        assert command_findings(actions, path.machine.state(path.target), tags) == ()

    def test_asking_for_more_margin_is_answered_as_well(
        self, action: Action, situation: Situation, path: RecoveryPath
    ) -> None:
        advice = Advice(keep_path=path, tries=1, required=(("ACC-T-HIGH", 0.2),))
        assert asyncio.run(action.act(situation, path, advice)).target == path.target
