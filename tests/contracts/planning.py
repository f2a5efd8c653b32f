"""What every planning agent must do. A test class inherits this and says which agent it is about."""

from __future__ import annotations

import asyncio

from homeostat.agents.roles import NoAdmissiblePlan, Planning, Situation
from homeostat.domain.advice import Advice
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.recovery import RecoveryPath


class PlanningContract:
    """Inherit, and provide the fixtures ``planning``, ``situation`` (with an admissible path) and ``machine``."""

    def test_the_path_starts_where_the_plant_is(self, planning: Planning, situation: Situation) -> None:
        path = asyncio.run(planning.plan(situation, Advice()))
        assert isinstance(path, RecoveryPath) and path.states[0] == situation.state

    def test_the_path_is_one_of_the_machine_and_open_now(
        self, planning: Planning, situation: Situation, machine: StateMachine
    ) -> None:
        path = asyncio.run(planning.plan(situation, Advice()))
        assert set(path.transitions) <= set(machine.transitions)
        assert all(t.guard.holds(situation.snapshot.values) for t in path.decisions)

    def test_the_path_ends_where_a_recovery_may_end(
        self, planning: Planning, situation: Situation, machine: StateMachine
    ) -> None:
        path = asyncio.run(planning.plan(situation, Advice()))
        assert machine.state(path.target).recovery_target

    def test_running_out_of_paths_is_said_in_one_line(self, planning: Planning, situation: Situation) -> None:
        """Whatever is refused, the answer is another path or the one exception that ends the proposer's turn."""
        refused: tuple[tuple[str, ...], ...] = ()
        for _ in range(12):
            try:
                path = asyncio.run(planning.plan(situation, Advice(refused_paths=refused)))
            except NoAdmissiblePlan as end:
                assert str(end) and "\n" not in str(end)
                break
            refused = (*refused, path.commanded)
