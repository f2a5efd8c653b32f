"""Sensitivities on the reactor: what a model is told about its commands is what the twin says about them."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from homeostat.agents.checks import target_name
from homeostat.agents.hypotheses import plausible
from homeostat.agents.simulation import STEP, TwinSimulation
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.recovery import ActionSet, Command
from homeostat.twin.twin import Purpose, Twin
from tests.agents.stuck_valve import DIAGNOSIS, NOW_S, stuck
from tests.twin.followed import follow, reactor

REDUCED = reactor().description.machine.state("reduced_load")
PROPOSAL = ActionSet(
    (Command("T1.sp", 310.0, 0.5), Command("L1.sp", 10.0, 0.1), Command("F1.sp", 0.024, 0.005),
     Command("V2.man", None, None), Command("XV1.cmd", 1.0, 1.0)),
    "reduced_load",
)  # fmt: skip


class Counted:
    """Counts the calls of the engine and hands everything on."""

    def __init__(self, twin: Twin) -> None:
        self._twin = twin
        self.settings, self.horizon = twin.settings, twin.horizon
        self.tried: list[int] = []

    def ensemble(self, hypotheses: Sequence[Hypothesis], draws: int, purpose: Purpose) -> Any:
        return self._twin.ensemble(hypotheses, draws, purpose)

    def frozen(self) -> Counted:
        return self

    def schedules(self, sets: Sequence[ActionSet], steps: int) -> Any:
        return self._twin.schedules(sets, steps)

    def try_many(self, ensemble: Any, schedules: Any) -> Any:
        self.tried.append(len(schedules))
        return self._twin.try_many(ensemble, schedules)


def with_feed(value: float) -> ActionSet:
    changed = tuple(replace(c, value=value) if c.tag == "F1.sp" else c for c in PROPOSAL.commands)
    return ActionSet(changed, PROPOSAL.target)


def worst(signals: Mapping[str, np.ndarray], dt_s: float) -> float:
    """The least margin of ACC-T-HIGH over the members."""
    formula = next(c.formula for c in reactor().description.limits.criteria if c.name == "ACC-T-HIGH")
    return float(formula.evaluate(signals, dt_s).value.min())


def test_on_the_reactor_the_slope_is_that_between_two_rollouts() -> None:
    """A valve stuck at 30 %: more feed is more heat than the valve can take away."""
    d = reactor().description
    twin = follow(stuck()[:NOW_S])
    counted = Counted(twin)
    simulation = TwinSimulation(counted, d.tags_by_name, d.limits)  # type: ignore[arg-type]
    names = ["ACC-T-HIGH", "LIM-T-HIGH", target_name(REDUCED)]
    found = asyncio.run(simulation.sensitivities(DIAGNOSIS, PROPOSAL, (REDUCED,), names))
    assert counted.tried == [6], "three commands with a value and a range, in one call"
    slopes = {(s.criterion, s.tag): s.slope for s in found}
    assert len(slopes) == 9
    step = STEP * (feed.high - feed.low) if (feed := REDUCED.setpoint("F1.sp")) else 0.0
    ensemble = twin.ensemble(plausible(DIAGNOSIS), twin.settings.judged_draws, Purpose.JUDGE)
    margins = []
    for value in (0.024 - step, 0.024 + step):
        signals, dt_s = twin.try_many(ensemble, twin.schedules([with_feed(value)], twin.settings.horizon_s))
        margins.append(worst(signals, dt_s))
    explicit = (margins[1] - margins[0]) / (2.0 * step)
    assert explicit < -100.0 and slopes["ACC-T-HIGH", "F1.sp"] == pytest.approx(explicit, rel=1e-9)
    assert slopes["LIM-T-HIGH", "F1.sp"] < 0.0
    assert abs(slopes["ACC-T-HIGH", "T1.sp"]) < 1e-3, "a stuck valve follows no setpoint"
    assert slopes[target_name(REDUCED), "F1.sp"] == pytest.approx(1.0, rel=1e-6), "its own margin is the feed"


def test_what_is_validated_later_moves_the_same_way() -> None:
    """Validation rolls each proposal out with draws and noise of its own: sign and size are those that were told."""
    d = reactor().description
    simulation = TwinSimulation(follow(stuck()[:NOW_S], 2), d.tags_by_name, d.limits)

    async def ask() -> tuple[float, float]:
        (told, *_) = await simulation.sensitivities(DIAGNOSIS, PROPOSAL, (REDUCED,), ["ACC-T-HIGH"])
        assert told.tag == "F1.sp"
        low, high = [await simulation.roll_out(DIAGNOSIS, with_feed(value)) for value in (0.020, 0.028)]
        margins = [worst(r.trajectory.signals, r.trajectory.dt_s) for r in (low, high)]
        return told.slope, (margins[1] - margins[0]) / 0.008

    told, seen = asyncio.run(ask())
    assert told < 0.0 and told == pytest.approx(seen, rel=0.3)


def test_the_same_question_has_the_same_answer() -> None:
    d = reactor().description
    one, two = (
        asyncio.run(
            TwinSimulation(follow(stuck()[:NOW_S]), d.tags_by_name, d.limits).sensitivities(
                DIAGNOSIS, PROPOSAL, (REDUCED,), ["ACC-T-HIGH"]
            )
        )
        for _ in range(2)
    )
    assert one == two
