"""What every simulation agent must do. A test class inherits this and says which agent it is about."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence

import numpy as np
import pytest

from homeostat.agents.certificates import Course
from homeostat.agents.roles import Simulation
from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.plant.limits import Limits
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Rollout, RolloutResult
from homeostat.twin.twin import Interruption


class SimulationContract:
    """Inherit, and provide the fixtures ``simulation``, ``diagnosis``, ``actions``, ``limits`` and ``fresh``."""

    def rolled_out(self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet) -> Rollout:
        return asyncio.run(simulation.roll_out(diagnosis, actions))

    def test_a_rollout_carries_the_digest_of_what_was_tried(
        self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet
    ) -> None:
        assert self.rolled_out(simulation, diagnosis, actions).digest == actions.digest

    def test_a_rollout_has_every_tag_that_is_judged_and_no_gaps(
        self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet, limits: Limits
    ) -> None:
        rollout = self.rolled_out(simulation, diagnosis, actions)
        assert rollout.result is RolloutResult.COMPLETED
        for rule in (*limits.criteria, *limits.limits):
            for tag in rule.formula.tags:
                assert np.isfinite(rollout.trajectory.signals[tag]).all(), tag

    def test_every_member_has_a_weight(self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet) -> None:
        rollout = self.rolled_out(simulation, diagnosis, actions)
        assert len(rollout.weights) == rollout.trajectory.members > 0
        assert all(w >= 0.0 for w in rollout.weights) and 0.0 < sum(rollout.weights) <= 1.0 + 1e-9

    def test_the_horizon_covers_what_is_asked(
        self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet, limits: Limits
    ) -> None:
        trajectory = self.rolled_out(simulation, diagnosis, actions).trajectory
        asked = [c.formula.horizon_s for c in limits.criteria if math.isfinite(c.formula.horizon_s)]
        assert trajectory.length * trajectory.dt_s >= max(asked, default=0.0)

    def test_the_same_question_has_the_same_answer(
        self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet
    ) -> None:
        one, two = (self.rolled_out(simulation, diagnosis, actions) for _ in range(2))
        for tag, values in one.trajectory.signals.items():
            assert np.array_equal(values, two.trajectory.signals[tag], equal_nan=True), tag

    def test_the_rollout_starts_at_the_last_observation(
        self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet, fresh: tuple[Snapshot, ...]
    ) -> None:
        simulation.observe(fresh)
        simulation.observe(fresh[:1])
        start_s = self.rolled_out(simulation, diagnosis, actions).trajectory.start_s
        assert start_s == pytest.approx(fresh[-1].at_s, abs=1.0)

    def test_what_counts_against_a_course_is_among_the_draws(
        self, simulation: Simulation, diagnosis: Diagnosis, actions: ActionSet
    ) -> None:
        courses = [Course(actions), Course(actions, Interruption(30.0, actions)), Course(actions)]

        async def found(of: Sequence[Course]) -> list[int | None]:
            return [each async for each in simulation.violations(diagnosis, of, 8)]

        first, ended, again = asyncio.run(found(courses))
        assert all(k is not None and 0 <= k <= 8 for k in (first, ended, again))
        assert first == again, "the draws are the same for all"
        assert asyncio.run(found(())) == []

    def test_instrument_errors_are_finite_and_never_empty(self, simulation: Simulation, diagnosis: Diagnosis) -> None:
        errors = simulation.instrument_errors(diagnosis)
        assert len(errors) >= 1
        assert all(math.isfinite(e) for mapping in errors for e in mapping.values())
