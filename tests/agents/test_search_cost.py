"""What a search goes by: the price of a candidate, and a penalty for every margin that must not be missing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.checks import rollout_findings
from homeostat.agents.pricing import Pricing, Signals
from homeostat.agents.search.cost import MISSING, Cost
from homeostat.domain.plant.limits import LimitKind, Limits
from homeostat.domain.plant.prices import Price, PriceKind, prices_of
from homeostat.domain.plant.production import Production
from homeostat.domain.recovery import ActionSet, Command, Step
from homeostat.domain.snapshot import Trajectory
from homeostat.domain.verdict import Rollout, RolloutResult
from tests.safety.world import CALM, COLD, EMPTY, HOT, MACHINE, REST, criterion, rule

SPARING = rule("PRM-SPARING", LimitKind.PERMISSIVE, "F.sp <= 0.025")
WARM = criterion("WARM", "T <= 310")
LIMITS = Limits((HOT, COLD, SPARING), (CALM, WARM))
COLUMNS = ("price", "ACC-CALM", "LIM-HOT", "PRM-SPARING")
ROWS = (Price(PriceKind.CRITERION, "WARM", 24.0), Price(PriceKind.STATE, "running", 0.0),
        Price(PriceKind.STATE, "emptying", 12.0), Price(PriceKind.STATE, "still", 0.0))  # fmt: skip
SCALES = {"K": 2.0, "L/s": 0.001}
PRICES = prices_of(ROWS, Production("F", 1.0 / 30.0), "EUR", LIMITS, MACHINE)
SLACK, DT_S, SAMPLES = 0.08, 5.0, 180
COST = Cost(LIMITS, Pricing(PRICES, LIMITS, SCALES), SCALES, SLACK)
ONE = np.ones(1)


def signals(rows: int = 1, **changed: object) -> Signals:
    """900 s of the vessel by design; values are numbers, or arrays of shape (rows, 1) or (rows, 180)."""
    values: dict[str, object] = {"F": 1.0 / 30.0, "T": 305.0, "F.sp": 0.02}
    values |= {tag.replace("_", "."): value for tag, value in changed.items()}
    return {tag: np.broadcast_to(np.asarray(v, dtype=float), (rows, SAMPLES)).copy() for tag, v in values.items()}


def feed(*values: float | None) -> ActionSet:
    """``F.sp`` is brought to one value after the other, a step each; None hands it back to automatic."""
    first, *later = [(Command("F.sp", v, None),) for v in values]
    return ActionSet(first, "running", tuple(Step(t, c) for t, c in zip((EMPTY, REST), later, strict=False)))


NOTHING = ActionSet((), "running")


def judged(of: Signals, *candidates: ActionSet, weights: tuple[float, ...] = (1.0,)) -> list[dict[str, float]]:
    table = COST.judge(of, DT_S, np.array(weights), candidates)
    return [dict(zip(COLUMNS, row[:-1], strict=True)) for row in table.tolist()]


# --- price ------------------------------------------------------------------------------------------------------


def test_the_price_is_a_share_of_the_design_production() -> None:
    """3 EUR of 30 for product, 12 EUR for two scales above the soft criterion."""
    (found,) = judged(signals(F=0.9 / 30.0, T=314.0), NOTHING)
    assert found["price"] == pytest.approx((3.0 + 12.0) / 30.0)


def test_of_the_states_that_a_candidate_leads_through_the_dearest_is_in_its_price() -> None:
    by_state = judged(signals(3), NOTHING, feed(0.02, 0.02), feed(0.02, 0.02, 0.02))
    assert [f["price"] for f in by_state] == pytest.approx([0.0, 3.0 / 30.0, 3.0 / 30.0])


def test_members_of_each_candidate_count_by_their_weights() -> None:
    """Two candidates with two members each; the second member of the second one makes nothing."""
    made = np.array([[1.0], [1.0], [1.0], [0.0]]) / 30.0
    found = judged(signals(4, F=made), NOTHING, NOTHING, weights=(3.0, 1.0))
    assert [f["price"] for f in found] == pytest.approx([0.0, 0.25])


# --- margins ----------------------------------------------------------------------------------------------------


def test_only_what_forbids_has_a_margin_and_the_worst_member_s_counts() -> None:
    hot = np.full((2, SAMPLES), 305.0)
    hot[1, 7] = 311.0
    (found,) = judged(signals(2, T=hot), NOTHING, weights=(0.99, 0.01))
    assert found["ACC-CALM"] == pytest.approx(1.9 / 2.0) and found["LIM-HOT"] == pytest.approx(1.0)
    assert COST.judge(signals(), DT_S, ONE, [NOTHING]).shape == (1, len(COLUMNS) + 1), "neither WARM nor LIM-COLD"


def test_a_member_that_is_undecided_has_no_margin() -> None:
    unknown = np.full((2, SAMPLES), 305.0)
    unknown[1, 3] = math.nan
    (found,) = judged(signals(2, T=unknown), NOTHING, weights=(0.5, 0.5))
    assert found["ACC-CALM"] == found["LIM-HOT"] == -math.inf and found["price"] == math.inf


PERMITTED = [
    ((0.02,), 5.0),
    ((0.03,), -5.0),
    ((0.02, 0.024), 1.0),
    ((0.02, 0.027), -2.0),
    ((0.027, 0.02), -2.0),
    ((0.02, 0.02, 0.026), -1.0),
    ((None,), -5.0),
    ((0.02, None, None), 5.0),
]
"""What is commanded step by step -> the permissive's margin [scales]; what is read at first is 0.03."""


@pytest.mark.parametrize(("values", "margin"), PERMITTED)
def test_a_permissive_is_judged_at_every_step_by_what_is_commanded_until_then(
    values: tuple[float | None, ...], margin: float
) -> None:
    (found,) = judged(signals(F_sp=0.03), feed(*values))
    assert found["PRM-SPARING"] == pytest.approx(margin)


def test_each_candidate_has_its_own_permissives_and_its_own_members() -> None:
    """What is not commanded is as it was read, in each member."""
    read = np.array([[0.02], [0.024], [0.02], [0.024]])
    found = judged(signals(4, F_sp=read), feed(0.021), NOTHING, weights=(0.5, 0.5))
    assert [f["PRM-SPARING"] for f in found] == pytest.approx([4.0, 1.0])


def test_what_happens_later_is_none_of_a_permissive_s_business() -> None:
    later = np.full(SAMPLES, 0.02)
    later[1:] = 0.05
    (found,) = judged(signals(F_sp=later), NOTHING)
    assert found["PRM-SPARING"] == pytest.approx(5.0)


STEPS = st.lists(st.none() | st.floats(0.0, 0.05), min_size=1, max_size=3)


@given(st.lists(st.floats(0.0, 0.05), min_size=1, max_size=3), STEPS)
def test_the_search_and_validation_agree_on_permissives(read: list[float], values: list[float | None]) -> None:
    actions, of = feed(*values), signals(len(read), F_sp=np.array(read)[:, None])
    rollout = Rollout("", Trajectory(0.0, DT_S, dict(of)), (), (1.0,) * len(read), RolloutResult.COMPLETED)
    (said,) = rollout_findings(rollout, (), (SPARING,), actions)
    (found,) = judged(of, actions, weights=(1.0,) * len(read))
    assert found["PRM-SPARING"] == pytest.approx(said.margin / SCALES["L/s"])


# --- the two together -------------------------------------------------------------------------------------------


def total(of: Signals, actions: ActionSet = NOTHING, **required: float) -> float:
    named = {name.replace("_", "-"): margin for name, margin in required.items()}
    (found,) = COST.of(of, DT_S, ONE, [actions], named)
    return float(found)


def test_what_keeps_everything_with_slack_costs_its_price() -> None:
    assert total(signals(F=0.9 / 30.0)) == pytest.approx(0.1)


def test_a_missing_margin_costs_more_than_anything_that_can_be_made() -> None:
    """At 313.9 K half a scale is missing of one and 0.45 of the other, and of each the slack; 3.9 K are soft."""
    soft = 24.0 * 0.25 * (3.9 / 2.0) / 30.0
    assert total(signals(T=313.9)) == pytest.approx(soft + MISSING * (0.5 + 0.45 + 2.0 * SLACK))


def test_slack_is_kept_to_limits_and_not_to_permissives() -> None:
    """A permissive is judged by what is commanded, which is known; what a limit will see is not."""
    assert total(signals(), feed(0.025)) == pytest.approx(0.0)
    just = signals(T=312.9)
    soft = 24.0 * 0.25 * (2.9 / 2.0) / 30.0
    assert total(just) == pytest.approx(soft + MISSING * (SLACK + SLACK - 0.05))


def test_what_is_required_beyond_comes_on_top() -> None:
    """2 K are required beyond the slack, and 1.9 K are there."""
    near = signals(T=311.0)
    assert total(near, ACC_CALM=2.0) - total(near) == pytest.approx(MISSING * (1.0 + SLACK - 0.95))
    assert total(signals(), feed(0.024), PRM_SPARING=0.002) == pytest.approx(MISSING * 1.0)


def test_there_is_an_end_to_what_is_missing() -> None:
    """However far outside: one that is undecided does not hide what another one misses."""
    assert total(signals(F_sp=math.nan)) == pytest.approx(MISSING * 100.0)
    assert total(signals(), feed(1e9)) == pytest.approx(MISSING * 100.0)


def test_a_permissive_on_a_command_is_met_by_the_manual_output_that_overrides_it() -> None:
    limits = Limits((rule("PRM", LimitKind.PERMISSIVE, "F.sp <= 0.025"),), ()).with_manual({"F.man": "F.sp"})
    cost = Cost(limits, Pricing(PRICES, limits, SCALES), SCALES, SLACK)
    closed, opened = (ActionSet((Command("F.man", v, None),), "running") for v in (0.02, 0.03))
    found = cost.judge(signals(2, F_sp=0.03), DT_S, ONE, (closed, opened))[:, 1]
    assert found[0] > 0.0 > found[1]
