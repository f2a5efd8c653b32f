"""Sensitivities: how each margin changes with each command, by differences that one call of the engine yields."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from homeostat.agents.checks import target_name
from homeostat.agents.hypotheses import PLAUSIBLE
from homeostat.agents.pricing import Pricing
from homeostat.agents.simulation import STEP, TwinSimulation
from homeostat.domain.advice import COST, Sensitivity
from homeostat.domain.diagnosis import Diagnosis, FaultState, Hypothesis
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.state_machine import SetpointRange, State, StateMachine
from homeostat.domain.recovery import ActionSet, Command
from homeostat.process.batch import ProcessError
from homeostat.stl.formula import parse
from tests.agents.scripted import diagnosis
from tests.recovery.line import FULL, HALF, priced, slope
from tests.safety.world import CALM, COLD, HOT, TAGS, criterion, rule

HORIZON = 100
START = {"T": 300.0, "L": 8.0}
PER_FEED = slope(0.1, 1.0 + FULL) - slope(0.1, 1.0)
"""How much faster the temperature rises for the whole feed more [K/s], at 0.1 heating."""
RUNNING = State(
    "running", "Running", 1, False, True, parse("F.sp >= 0.01 and T <= 320", TAGS), frozenset(),
    (
        SetpointRange("F.sp", 0.0, 0.05, FULL), SetpointRange("T.sp", 298.0, 312.0, 310.0),
        SetpointRange("V.man", 0.0, 1.0, None), SetpointRange("L.sp", 8.0, 8.0, 8.0),
    ),
)  # fmt: skip
LATER = rule("PRM-LATER", LimitKind.PERMISSIVE, "T <= 305")
LIMITS = Limits((HOT, COLD, LATER), (CALM, criterion("ACC-END", "always[99,99] (T <= 312)")))


@dataclass
class Line:
    """A twin whose temperature is a straight line in every member; counts what it is asked for."""

    heating: tuple[float, ...] = (0.1,)
    broken: bool = False
    horizon: int = HORIZON

    def __post_init__(self) -> None:
        self.settings = SimpleNamespace(judged_draws=6, horizon_s=HORIZON)
        self.asked: list[tuple[Hypothesis, ...]] = []
        self.calls: list[np.ndarray] = []

    def ensemble(self, hypotheses: Sequence[Hypothesis], draws: int, purpose: int) -> Any:
        self.asked.append(tuple(hypotheses))
        return SimpleNamespace(
            start_s=0.0, states=np.zeros((len(self.heating), 1)), weights=np.full(len(self.heating), 1.0)
        )

    def frozen(self) -> Line:
        return self

    def schedules(self, sets: Sequence[ActionSet], steps: int) -> np.ndarray:
        found = []
        for actions in sets:
            values = [c.value if c else None for c in (actions.command("F.sp"), actions.command("T.sp"))]
            found.append(np.tile([np.nan if v is None else v for v in values], (steps, 1)))
        return np.stack(found)

    def try_many(self, ensemble: Any, schedules: np.ndarray) -> tuple[dict[str, np.ndarray], float]:
        self.calls.append(schedules)
        if self.broken:
            raise ProcessError("member 0 left the physical world")
        count, members = len(schedules), len(self.heating)
        seconds = np.arange(HORIZON, dtype=float)
        feed = np.repeat(schedules[:, :, 0], members, axis=0)
        rates = np.array([slope(h, float(f)) for f in schedules[:, 0, 0] for h in self.heating])
        signals = {tag: np.full((count * members, HORIZON), value) for tag, value in START.items()}
        signals["T"] = 300.0 + rates[:, None] * seconds
        return signals | {"F.sp": feed, "F": feed}, 1.0


def differences(
    twin: Line, criteria: Sequence[str], actions: ActionSet | None = None, given: Diagnosis | None = None
) -> dict[tuple[str, str], float]:
    """(criterion, tag) -> slope."""
    simulation = TwinSimulation(twin, TAGS, LIMITS)  # type: ignore[arg-type]
    found = asyncio.run(
        simulation.sensitivities(given or diagnosis(50.0), actions or feeding(FULL), (RUNNING,), criteria)
    )
    assert all(isinstance(s, Sensitivity) for s in found)
    slopes = {(s.criterion, s.tag): s.slope for s in found}
    assert len(slopes) == len(found), "each of them once"
    return slopes


def feeding(value: float, **others: float | None) -> ActionSet:
    commands = {"F.sp": value, "T.sp": 305.0, "V.man": None, "L.sp": 8.0} | {
        tag.replace("_", "."): v for tag, v in others.items()
    }
    return ActionSet(tuple(Command(tag, v, None) for tag, v in commands.items()), "running")


# --- by hand ----------------------------------------------------------------------------------------------------


def test_slopes_are_what_can_be_worked_out_in_the_head() -> None:
    """Rising for 99 s: 100 / 0.03 L/s of feed make a difference of 0.2 K/s."""
    found = differences(Line(), ["ACC-CALM", "LIM-HOT", "ACC-END", "LIM-COLD"])
    expected = -0.2 * 99.0 / FULL
    assert expected == pytest.approx(-PER_FEED * 99.0 / FULL)
    for name in ("ACC-CALM", "LIM-HOT", "ACC-END"):
        assert found[name, "F.sp"] == pytest.approx(expected, rel=1e-6)
        assert found[name, "T.sp"] == 0.0, "this plant does not look at its setpoint"
    assert found["LIM-COLD", "F.sp"] == pytest.approx(0.0, abs=1e-6), "while it rises the lowest value is the first"


def test_what_a_litre_of_feed_costs_is_a_slope_with_the_range_that_it_was_taken_from() -> None:
    """Over 100 s every L/s of feed that is missing loses 100 L at 1 EUR; twice 2 % of the range lie between."""
    pricing = Pricing(priced(LIMITS, StateMachine("line", (replace(RUNNING, initial=True),), ())), LIMITS, {"K": 2.0})
    simulation = TwinSimulation(Line(), TAGS, LIMITS, pricing)  # type: ignore[arg-type]
    found = asyncio.run(simulation.sensitivities(diagnosis(50.0), feeding(HALF), (RUNNING,), [COST]))
    (feed,) = [s for s in found if s.tag == "F.sp"]
    assert feed.criterion == COST and feed.slope == pytest.approx(-100.0)
    assert (feed.low, feed.high) == pytest.approx((HALF - STEP * 0.05, HALF + STEP * 0.05))
    assert differences(Line(), [COST]) == {}, "who knows no prices tells no cost"


def test_a_limit_below_is_moved_the_other_way_where_it_cools() -> None:
    found = differences(Line(), ["LIM-COLD", "ACC-CALM"], feeding(0.005))
    assert found["LIM-COLD", "F.sp"] == pytest.approx(0.2 * 99.0 / FULL, rel=1e-6)
    assert found["ACC-CALM", "F.sp"] == pytest.approx(0.0, abs=1e-6)


def test_the_target_is_judged_at_the_end() -> None:
    """Its margin is what is nearest: the feed in scales of 0.001, the temperature in kelvins."""
    found = differences(Line(), [target_name(RUNNING)])
    assert found[target_name(RUNNING), "F.sp"] == pytest.approx(-0.2 * 99.0 / FULL, rel=1e-6)
    assert differences(Line(), ["TARGET-elsewhere"]) == {}


def test_the_worst_member_counts_on_either_side() -> None:
    slow_and_fast = differences(Line((0.1, 0.3)), ["ACC-CALM"])["ACC-CALM", "F.sp"]
    assert slow_and_fast == pytest.approx(-0.6 * 99.0 / FULL, rel=1e-6)
    kink = differences(Line((0.1, -0.1)), ["ACC-CALM"], feeding(HALF))["ACC-CALM", "F.sp"]
    assert kink == pytest.approx(0.0, abs=1e-6), "one member rises where the other cools"


def test_a_permissive_is_judged_at_the_release() -> None:
    """What happens later does not count for it, and the temperature at the release is what it is."""
    assert differences(Line(), ["PRM-LATER"])["PRM-LATER", "F.sp"] == pytest.approx(0.0, abs=1e-6)


def test_criteria_that_nobody_knows_are_left_out() -> None:
    assert set(differences(Line(), ["CHK-RANGE", "ACC-CALM", "nothing"])) == {
        ("ACC-CALM", "F.sp"),
        ("ACC-CALM", "T.sp"),
    }
    assert differences(Line(), []) == {}


# --- what is tried ----------------------------------------------------------------------------------------------


def test_the_engine_is_called_once_with_every_variation() -> None:
    twin = Line()
    differences(twin, ["ACC-CALM", "LIM-HOT", "ACC-END"])
    (schedules,) = twin.calls
    step = STEP * 0.05
    assert schedules.shape[:2] == (4, HORIZON), "feed and temperature, below and above"
    assert schedules[:, 0, 0].tolist() == pytest.approx([FULL - step, FULL + step, FULL, FULL])
    assert schedules[:, 0, 1].tolist() == pytest.approx([305.0, 305.0, 305.0 - STEP * 14.0, 305.0 + STEP * 14.0])


@pytest.mark.parametrize(("value", "low", "high"), [(0.0, 0.0, 0.001), (0.05, 0.049, 0.05), (0.0004, 0.0, 0.0014)])
def test_at_the_edge_of_the_range_it_stays_inside(value: float, low: float, high: float) -> None:
    twin = Line()
    found = differences(twin, ["ACC-CALM"], feeding(value))
    assert twin.calls[0][:2, 0, 0].tolist() == pytest.approx([low, high])
    rising = [max(slope(0.1, f), 0.0) * 99.0 for f in (low, high)]
    assert found["ACC-CALM", "F.sp"] == pytest.approx((rising[0] - rising[1]) / (high - low), abs=1e-6)


@pytest.mark.parametrize("value", [-1.0, 0.3])
def test_a_proposal_outside_of_its_range_is_varied_inside(value: float) -> None:
    twin = Line()
    differences(twin, ["ACC-CALM"], feeding(value))
    assert np.all((twin.calls[0][:2, 0, 0] >= 0.0) & (twin.calls[0][:2, 0, 0] <= 0.05))


def test_where_nothing_can_be_moved_nothing_is_computed() -> None:
    twin = Line()
    fixed = ActionSet((Command("L.sp", 8.0, None), Command("V.man", None, None)), "running")
    assert differences(twin, ["ACC-CALM"], fixed) == {} and twin.calls == []
    assert differences(twin, ["ACC-CALM"], ActionSet((), "running")) == {} and twin.calls == []


def test_a_manual_output_is_moved_where_it_has_a_value() -> None:
    assert ("ACC-CALM", "V.man") in differences(Line(), ["ACC-CALM"], feeding(FULL, V_man=0.5))


def test_hypotheses_that_are_hardly_believed_are_left_out() -> None:
    twin, names = Line(), ("a", "b", "c")
    hypotheses = tuple(
        Hypothesis((FaultState(n, 1.0, 0.0),), p) for n, p in zip(names, (0.9, PLAUSIBLE, 0.019), strict=True)
    )
    differences(twin, ["ACC-CALM"], given=Diagnosis(0.0, (), hypotheses))
    assert [h.name for h in twin.asked[0]] == ["a", "b"]


def test_a_twin_that_breaks_down_nearby_has_no_sensitivities() -> None:
    """It is not a bug of the agents that the physical world ends beside a proposal: the loop must go on."""
    assert differences(Line(broken=True), ["ACC-CALM"]) == {}


def test_the_loop_is_not_blocked_meanwhile() -> None:
    goes_on = threading.Event()
    went_on: list[bool] = []

    class Slow(Line):
        def try_many(self, ensemble: Any, schedules: np.ndarray) -> tuple[dict[str, np.ndarray], float]:
            went_on.append(goes_on.wait(20.0))
            return super().try_many(ensemble, schedules)

    async def both() -> None:
        simulation = TwinSimulation(Slow(), TAGS, LIMITS)  # type: ignore[arg-type]
        task = asyncio.create_task(simulation.sensitivities(diagnosis(50.0), feeding(FULL), (RUNNING,), ["ACC-CALM"]))
        for _ in range(10):
            await asyncio.sleep(0.001)
            assert not task.done()
        goes_on.set()
        await task

    asyncio.run(both())
    assert went_on and all(went_on), "the loop has gone on while the twin was at it"
