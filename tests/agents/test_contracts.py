"""Every agent against the contract of its role: the ones that act, and the scripted ones that tests drive."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from homeostat.agents.monitoring.monitoring import TwinMonitoring
from homeostat.agents.roles import Action, Monitoring, Planning, Reprompting, Simulation, Situation, Validation
from homeostat.agents.search.planning import SearchPlanning
from homeostat.agents.search.reprompting import MarginReprompting
from homeostat.agents.simulation import TwinSimulation
from homeostat.agents.validation import LimitValidation
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.state_machine import State, StateMachine
from homeostat.domain.plant.tag import Tag
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Rollout
from tests.agents.scripted import (
    ScriptedAction,
    ScriptedMonitoring,
    ScriptedPlanning,
    ScriptedReprompting,
    ScriptedSimulation,
    ScriptedValidation,
)
from tests.agents.scripted import diagnosis as runaway
from tests.agents.stuck_valve import DIAGNOSIS, NOW_S, QUICK, grounding, now, search, stuck
from tests.contracts.action import ActionContract
from tests.contracts.monitoring import MonitoringContract
from tests.contracts.planning import PlanningContract
from tests.contracts.reprompting import RepromptingContract
from tests.contracts.simulation import SimulationContract
from tests.contracts.validation import ValidationContract
from tests.recovery.line import HALF, MACHINE, LineTwin, feed
from tests.safety.world import ACTIONS, LIMITS, RUNNING, TAGS, reading, rollout
from tests.twin.followed import follow, reactor


def on_the_line() -> Situation:
    return Situation(reading(50.0), runaway(50.0), "running")


class TestSearchPlanning(PlanningContract):
    @pytest.fixture
    def machine(self) -> StateMachine:
        return reactor().description.machine

    @pytest.fixture
    def planning(self) -> Planning:
        return SearchPlanning(reactor().description, grounding())

    @pytest.fixture
    def situation(self) -> Situation:
        return now()


class TestScriptedPlanning(PlanningContract):
    @pytest.fixture
    def machine(self) -> StateMachine:
        return MACHINE

    @pytest.fixture
    def planning(self) -> Planning:
        return ScriptedPlanning(MACHINE, ("reduce",))

    @pytest.fixture
    def situation(self) -> Situation:
        return on_the_line()


class TestSearchAction(ActionContract):
    @pytest.fixture
    def action(self) -> Action:
        return search(QUICK)

    @pytest.fixture
    def situation(self) -> Situation:
        return now()

    @pytest.fixture
    def path(self) -> RecoveryPath:
        machine = reactor().description.machine
        return RecoveryPath(machine, (next(t for t in machine.transitions if t.name == "t_reduce"),))

    @pytest.fixture
    def tags(self) -> Mapping[str, Tag]:
        return reactor().description.tags_by_name


class TestScriptedAction(ActionContract):
    @pytest.fixture
    def action(self) -> Action:
        return ScriptedAction(feed(HALF, "reduced"))

    @pytest.fixture
    def situation(self) -> Situation:
        return on_the_line()

    @pytest.fixture
    def path(self) -> RecoveryPath:
        return RecoveryPath(MACHINE, (next(t for t in MACHINE.transitions if t.name == "reduce"),))

    @pytest.fixture
    def tags(self) -> Mapping[str, Tag]:
        return TAGS


class TestTwinSimulation(SimulationContract):
    @pytest.fixture
    def simulation(self) -> Simulation:
        return TwinSimulation(follow(stuck()[:NOW_S]), reactor().description.tags_by_name, reactor().description.limits)

    @pytest.fixture
    def diagnosis(self) -> Diagnosis:
        return DIAGNOSIS

    @pytest.fixture
    def actions(self) -> ActionSet:
        return ActionSet((), "normal")

    @pytest.fixture
    def limits(self) -> Limits:
        return reactor().description.limits

    @pytest.fixture
    def fresh(self) -> tuple[Snapshot, ...]:
        return stuck()[NOW_S:]


class TestSimulationOnTheLine(SimulationContract):
    """The straight-line twin that recovery's tests use, behind the same simulation agent."""

    @pytest.fixture
    def simulation(self) -> Simulation:
        twin = LineTwin()
        twin.observe(reading(50.0))
        return TwinSimulation(twin, TAGS, LIMITS)  # type: ignore[arg-type]

    @pytest.fixture
    def diagnosis(self) -> Diagnosis:
        return runaway(50.0)

    @pytest.fixture
    def actions(self) -> ActionSet:
        return feed(HALF)

    @pytest.fixture
    def limits(self) -> Limits:
        return LIMITS

    @pytest.fixture
    def fresh(self) -> tuple[Snapshot, ...]:
        return tuple(reading(50.0 + k) for k in range(1, 4))


class TestScriptedSimulation(TestSimulationOnTheLine):
    @pytest.fixture
    def simulation(self) -> Simulation:
        twin = LineTwin()
        scripted = ScriptedSimulation(lambda actions: twin.roll_out(actions, ()))

        def observe(snapshots: tuple[Snapshot, ...]) -> None:
            for snapshot in snapshots:
                twin.observe(snapshot)

        scripted.observe = observe  # type: ignore[method-assign]
        scripted.observe((reading(50.0),))
        return scripted


class TestLimitValidation(ValidationContract):
    @pytest.fixture
    def validation(self) -> Validation:
        return LimitValidation(LIMITS, TAGS)

    @pytest.fixture
    def actions(self) -> ActionSet:
        return ACTIONS

    @pytest.fixture
    def target(self) -> State:
        return RUNNING

    @pytest.fixture
    def good(self) -> Rollout:
        return rollout()

    @pytest.fixture
    def bad(self) -> Rollout:
        return rollout(T=314.0)


class TestScriptedValidation(TestLimitValidation):
    @pytest.fixture
    def validation(self) -> Validation:
        return ScriptedValidation(LimitValidation(LIMITS, TAGS).judge)


class TestMarginReprompting(RepromptingContract):
    @pytest.fixture
    def reprompting(self) -> Reprompting:
        return MarginReprompting({"K": 2.0, "1": 1.0})

    @pytest.fixture
    def path(self) -> RecoveryPath:
        return RecoveryPath(MACHINE, (next(t for t in MACHINE.transitions if t.name == "reduce"),))


class TestScriptedReprompting(TestMarginReprompting):
    @pytest.fixture
    def reprompting(self) -> Reprompting:
        return ScriptedReprompting()


class TestTwinMonitoring(MonitoringContract):
    @pytest.fixture
    def snapshots(self) -> tuple[Snapshot, ...]:
        return stuck()

    @pytest.fixture
    def monitoring(self) -> Monitoring:
        plant = reactor()
        twin = follow(())
        return TwinMonitoring(twin, grounding(), plant.description, plant.baselines, plant.started, plant.monitoring)


class TestScriptedMonitoring(MonitoringContract):
    @pytest.fixture
    def snapshots(self) -> tuple[Snapshot, ...]:
        return tuple(reading(float(k)) for k in range(1, 60))

    @pytest.fixture
    def monitoring(self) -> Monitoring:
        return ScriptedMonitoring(50.0)
