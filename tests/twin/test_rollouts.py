"""Rollouts: the same question has the same answer, every member is there, and a breakdown is a value."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest

from homeostat.agents.checks import judge, judge_safety
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.recovery import ActionSet, Command
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Revise, Rollout, RolloutResult
from homeostat.twin.twin import Twin
from tests.twin.followed import follow, reactor, readings

STUCK = (FaultState("cool_stuck_closed", 0.7, 1450.0),)
BOTH = (Hypothesis(STUCK, 0.6), Hypothesis((replace(STUCK[0], severity=0.8),), 0.3), Hypothesis((), 0.1))
IDLE = ActionSet((), "normal")
LESS_FEED = ActionSet(
    (
        Command("T1.sp", 310.0, 0.5),
        Command("L1.sp", 10.0, 0.1),
        Command("F1.sp", 0.02, 0.005),
        Command("V2.man", None, None),
    ),
    "reduced_load",
)


@functools.cache
def seen() -> tuple[Snapshot, ...]:
    return readings(2, 1470, STUCK)


@functools.cache
def rolled_out(actions: ActionSet, seed: int = 0) -> Rollout:
    return follow(seen(), seed).roll_out(actions, BOTH)


def test_every_hypothesis_meets_every_draw() -> None:
    rollout, settings = rolled_out(IDLE), reactor().twin
    members = len(BOTH) * settings.judged_draws
    assert rollout.result is RolloutResult.COMPLETED and rollout.note == ""
    assert (rollout.trajectory.members, rollout.trajectory.length) == (members, settings.horizon_s)
    assert len(rollout.weights) == members and sum(rollout.weights) == pytest.approx(1.0)
    of_first = rollout.weights[: settings.judged_draws]
    assert of_first == pytest.approx([0.6 / settings.judged_draws] * len(of_first))
    assert rollout.hypotheses == BOTH and rollout.digest == IDLE.digest
    assert rollout.trajectory.start_s == 1471.0 and rollout.trajectory.dt_s == 1.0


def test_every_rule_finds_its_tags() -> None:
    limits = reactor().description.limits
    asked = {tag for rule in (*limits.criteria, *limits.limits) for tag in rule.formula.tags}
    signals = rolled_out(IDLE).trajectory.signals
    assert asked <= signals.keys()
    assert all(values.shape == signals["T1"].shape for values in signals.values())
    assert all(np.isfinite(signals[tag]).all() for tag in asked)


def test_the_horizon_covers_every_criterion() -> None:
    covered = reactor().twin.horizon_s
    ahead = {c.name: c.formula.horizon_s for c in reactor().description.limits.criteria}
    assert {name: s for name, s in ahead.items() if covered < s < math.inf} == {}


def test_the_same_seed_gives_the_same_bits_and_another_one_other_draws() -> None:
    one, two, other = (follow(seen(), seed).roll_out(IDLE, BOTH).trajectory.signals["T1"] for seed in (0, 0, 1))
    assert (one == two).all() and (one != other).any()


def test_asking_again_gives_the_same_answer_whatever_was_asked_between() -> None:
    twin = follow(seen())
    first = twin.roll_out(LESS_FEED, BOTH).trajectory.signals["T1"]
    twin.roll_out(IDLE, BOTH)
    twin.explain(("cool_stuck_closed",), ())
    assert (twin.roll_out(LESS_FEED, BOTH).trajectory.signals["T1"] == first).all()


def test_a_snapshot_is_taken_once() -> None:
    twin = follow(seen())
    before = twin.roll_out(IDLE, BOTH).trajectory.signals["T1"]
    for snapshot in (seen()[-1], seen()[-50]):
        twin.observe(snapshot)
    assert (twin.roll_out(IDLE, BOTH).trajectory.signals["T1"] == before).all()


def test_members_differ_and_hypotheses_more_so() -> None:
    ends = rolled_out(IDLE).trajectory.signals["T1"][:, -60:].mean(axis=1).reshape(len(BOTH), -1)
    assert (ends.std(axis=1) > 0.0).all()
    nominal, worse, healthy = ends.mean(axis=1)
    assert healthy < nominal < worse, "the more the valve is closed, the hotter"


def test_without_action_the_truth_lies_among_the_members() -> None:
    """What truly happens to the untouched plant over the next minutes is within what the members say."""
    future = readings(2, 1470 + 300, STUCK)[1470:]
    truth = np.array([s.values["T1"] for s in future]).reshape(-1, 30).mean(axis=1)
    likely = rolled_out(IDLE).trajectory.signals["T1"][: reactor().twin.judged_draws]
    members = likely[:, :300].reshape(-1, 10, 30).mean(axis=2)
    assert (truth >= members.min(axis=0) - 0.5).all() and (truth <= members.max(axis=0) + 0.5).all()


def test_commands_reach_the_members_as_ramps() -> None:
    feed = rolled_out(LESS_FEED).trajectory.signals["F1.sp"]
    assert feed[0, 0] == pytest.approx(1.0 / 30.0 - 0.005, abs=1e-6) and (feed[:, 10:] == 0.02).all()
    less, same = (rolled_out(actions).trajectory.signals["T1"][:, -60:].mean() for actions in (LESS_FEED, IDLE))
    assert less < same


def broken(values: dict[str, float]) -> Twin:
    twin = follow(seen())
    twin.observe(Snapshot(1471.0, dict(seen()[-1].values) | values))
    return twin


@pytest.mark.parametrize("tag", ["T1", "L1", "T2"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_a_reading_that_says_nothing_for_a_second_changes_little(tag: str, value: float) -> None:
    """The last one that was known stands for it."""
    rollout = broken({tag: value}).roll_out(LESS_FEED, BOTH)
    held = broken({tag: seen()[-1].values[tag]}).roll_out(LESS_FEED, BOTH)
    assert rollout.result is RolloutResult.COMPLETED
    for name, values in rollout.trajectory.signals.items():
        assert np.allclose(values, held.trajectory.signals[name], equal_nan=True)


@pytest.mark.parametrize("values", [{"T1": -9999.0}, {"T1": -9999.0, "L1": 1e11}])
def test_a_breakdown_is_a_value_and_approves_nothing(values: dict[str, float]) -> None:
    rollout = broken(values).roll_out(LESS_FEED, BOTH)
    assert rollout.result is RolloutResult.BROKE_DOWN and rollout.note
    description = reactor().description
    target = description.machine.state("reduced_load")
    assert isinstance(judge(LESS_FEED, rollout, description.limits, target, description.tags_by_name), Revise)
    assert isinstance(judge_safety(LESS_FEED, rollout, description.limits), Revise)


def test_a_rollout_approves_its_own_action_set_only() -> None:
    description = reactor().description
    state = description.machine.state
    healthy = follow(readings(2, 1470)).roll_out(IDLE, (Hypothesis((), 1.0),))
    assert isinstance(judge(IDLE, healthy, description.limits, state("normal"), description.tags_by_name), Approve)
    other = judge(LESS_FEED, healthy, description.limits, state("reduced_load"), description.tags_by_name)
    assert isinstance(other, Revise)


def test_instrument_errors_are_what_the_hypotheses_say() -> None:
    biased = (FaultState("temp_bias", 5.0, 1450.0),)
    twin = follow(readings(2, 1470, biased))
    wrong, right = twin.instrument_errors((Hypothesis(biased, 0.9), Hypothesis((), 0.1)))
    assert wrong["T1"] - right["T1"] == pytest.approx(5.0, abs=0.05)
    assert abs(wrong["L1"] - right["L1"]) < 0.05 and abs(right["T1"]) < 0.5


def test_a_twin_that_has_seen_nothing_says_so() -> None:
    plant = reactor()
    with pytest.raises(ValueError, match="no snapshot yet"):
        Twin(plant.model, plant.description, plant.twin, 0).roll_out(IDLE, BOTH)
