"""The language agents against the contracts of their roles, with scripts in place of a model."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from homeostat.agents.language.scripts import SCRIPTS
from homeostat.agents.roles import Action, Planning, Reprompting, Situation
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import RecoveryPath
from homeostat.llm.scripted import ScriptedModel
from tests.agents.language.situations import FAULTS, Agents, situation
from tests.contracts.action import ActionContract
from tests.contracts.planning import PlanningContract
from tests.contracts.reprompting import RepromptingContract
from tests.twin.followed import reactor

PATHS = ("reasonable", "stubborn")
"""Scripts that propose paths for good; what else may be proposed is judged in tests/recovery."""


@pytest.fixture(params=[(name, fault) for name in PATHS for fault in ("cool_stuck_closed", "outlet_block")], ids=str)
def agents(request: pytest.FixtureRequest) -> Agents:
    """Both scripts, on a fault that takes a state away and on one that does not."""
    script, fault = request.param
    return Agents(ScriptedModel(script, SCRIPTS[script]), fault)


@pytest.fixture
def machine() -> StateMachine:
    return reactor().description.machine


class TestLanguagePlanning(PlanningContract):
    @pytest.fixture
    def planning(self, agents: Agents) -> Planning:
        return agents.planning

    @pytest.fixture
    def situation(self, agents: Agents) -> Situation:
        return situation(agents.fault)


class TestLanguageAction(ActionContract):
    @pytest.fixture
    def action(self, agents: Agents) -> Action:
        return agents.action

    @pytest.fixture
    def situation(self, agents: Agents) -> Situation:
        return situation(agents.fault)

    @pytest.fixture(params=["t_reduce", "t_hold", "t_compensate"])
    def path(self, request: pytest.FixtureRequest, machine: StateMachine) -> RecoveryPath:
        return RecoveryPath(machine, (next(t for t in machine.transitions if t.name == request.param),))

    @pytest.fixture
    def tags(self) -> Mapping[str, Tag]:
        return reactor().description.tags_by_name


class TestTeachingReprompting(RepromptingContract):
    @pytest.fixture
    def reprompting(self, agents: Agents) -> Reprompting:
        return agents.reprompting

    @pytest.fixture
    def path(self, machine: StateMachine) -> RecoveryPath:
        return RecoveryPath(machine, (next(t for t in machine.transitions if t.name == "t_reduce"),))


def test_the_contracts_faults_are_those_of_the_plant() -> None:
    """So that the contract's situations are what they are said to be."""
    assert {"cool_stuck_closed", "outlet_block"} <= set(FAULTS)
