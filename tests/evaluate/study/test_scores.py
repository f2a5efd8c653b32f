"""Scores of small groups of rows, by hand."""

from __future__ import annotations

import pytest

from homeostat.evaluate.report.groups import (
    Source,
    by_published,
    by_scenario,
    entrant,
    entrants,
    overall,
    scenarios,
    source,
)
from homeostat.evaluate.report.measures.comparison import comparisons
from homeostat.evaluate.report.measures.diagnosis import diagnosis_of, reliability
from homeostat.evaluate.report.measures.references import against, yardsticks
from homeostat.evaluate.report.measures.safety import safety_of
from homeostat.evaluate.report.measures.scores import effort_of, latency_of, solvers, success_of
from homeostat.evaluate.report.statistics import Spread
from homeostat.evaluate.study.row import DO_NOTHING, HINDSIGHT
from tests.evaluate.study.fake_rows import campaign, plain


def test_recovery_counts_the_runs_in_which_something_was_refused() -> None:
    rows = [plain(refused=2), plain(refused=1, success=False), plain(refused=0, success=False), plain()]
    scores = success_of(rows)
    assert scores.n == 4
    assert (scores.success.count, scores.success.of) == (2, 4)
    assert scores.recovery is not None
    assert (scores.recovery.count, scores.recovery.of) == (1, 2)
    assert success_of([plain()]).recovery is None


def test_a_fallback_is_a_failure() -> None:
    rows = [plain(fallbacks=1, actor="fallback"), plain()]
    assert success_of(rows).success.count == 1
    assert solvers(rows) == {"search": 1}


def test_steps_are_pooled_and_unknown_where_nothing_was_asked() -> None:
    asked = {"plans": 4, "plans_right": 3, "actions": 5, "actions_right": 5, "on_right": 6, "on_wrong": 2}
    scores = success_of([plain(**asked, on_missed=0), plain(**asked, on_missed=3), plain()])
    assert scores.plans is not None and (scores.plans.count, scores.plans.of) == (6, 8)
    assert scores.plans.interval is None
    assert scores.actions is not None and scores.actions.share == 1.0
    assert scores.precision is not None and scores.precision.share == pytest.approx(12 / 16)
    assert scores.recall is not None and scores.recall.share == pytest.approx(12 / 15)
    silent = success_of([plain()])
    assert (silent.plans, silent.actions, silent.precision, silent.recall) == (None,) * 4


def test_effort_is_that_of_the_runs_in_which_a_model_was_asked() -> None:
    asked = plain(planning_calls=2, planning_in=100, planning_out=10, tokens_by="server", cost_usd=0.25, failures=1)
    more = plain(action_calls=1, action_in=300, action_out=30, tokens_by="estimate", cost_usd=0.5)
    effort = effort_of([asked, more, plain()])
    assert (effort.asked, effort.failures, effort.counted_by) == (2, 1, "estimate, server")
    assert effort.read is not None and effort.read.mean == 200.0
    assert effort.calls == Spread(1.5, 2.0, 2)
    assert effort.cost == Spread(0.375, 0.5, 2)
    assert [agent.agent for agent in effort.agents] == ["planning", "action"]
    assert effort_of([asked, plain(action_calls=1)]).cost is None
    nothing = effort_of([plain()])
    assert (nothing.asked, nothing.read, nothing.cost, nothing.agents) == (0, None, None, ())


def test_latency_leaves_out_runs_in_which_nobody_acted() -> None:
    latency = latency_of([plain(wall_decision_s=None), plain(wall_decision_s=3.0, wall_s=5.0)])
    assert latency.decision == Spread(3.0, 3.0, 1)
    assert latency.run is not None and latency.run.mean == 4.0
    assert (latency.call, latency.mean_call) == (None, None)


def test_safety_shows_the_worst_run() -> None:
    bad = plain(exposure_s=90.0, least_margin=-0.5, least_margin_limit="L1 high", production_loss=0.5)
    safety = safety_of([plain(), plain(), bad])
    assert (safety.none_outside.count, safety.none_outside.of) == (2, 3)
    assert safety.exposure == Spread(0.0, 90.0, 3)
    assert safety.margin == Spread(0.1, -0.5, 3)
    assert safety.closest == "L1 high"
    assert (safety.complete, safety.delay, safety.spilled) == (None, None, None)


def test_delay_is_that_of_completed_batches() -> None:
    rows = [plain(batch=True, complete_s=310.0, nominal_s=300.0), plain(batch=True, nominal_s=300.0, success=False)]
    safety = safety_of(rows)
    assert safety.complete is not None and (safety.complete.count, safety.complete.of) == (1, 2)
    assert safety.delay == Spread(10.0, 10.0, 1)


def test_diagnosis_is_right_in_any_order_of_the_faults() -> None:
    rows = [
        plain(fault="a+b", believed="b+a", believed_p=0.95), plain(believed="leak", believed_p=0.91, true_p=0.0),
        plain(fault="none", believed="", believed_p=None, true_p=None, brier=None, detection_s=None, false_alarm=True),
    ]  # fmt: skip
    scores = diagnosis_of(rows)
    assert scores.right is not None and (scores.right.count, scores.right.of) == (1, 2)
    assert scores.detected is not None and (scores.detected.count, scores.detected.of) == (2, 2)
    assert scores.false_alarms.count == 1
    assert scores.truth is not None and scores.truth.mean == pytest.approx(0.45)
    (one,) = reliability(rows)
    assert (one.low, one.high, one.believed) == pytest.approx((0.9, 1.0, 0.93))
    assert (one.right.count, one.right.of) == (1, 2)


def test_certainty_belongs_to_the_last_bin() -> None:
    assert [one.low for one in reliability([plain(believed_p=1.0), plain(believed_p=0.0)])] == [0.0, 0.9]


def test_over_reaction_needs_a_run_that_shows_that_nothing_had_to_be_done() -> None:
    harmless = plain(proposer=DO_NOTHING, seed=1, acted=False)
    harmful = plain(proposer=DO_NOTHING, seed=2, acted=False, exposure_s=5.0)
    rows = [plain(seed=1, acted=True), plain(seed=2, acted=True), plain(seed=3, acted=True)]
    beside = against(rows, yardsticks([harmless, harmful]))
    assert beside.over_reaction is not None
    assert (beside.over_reaction.count, beside.over_reaction.of) == (1, 1)
    assert against(rows, yardsticks([harmful])).over_reaction is None
    assert against(rows, yardsticks([])).missed is None


def test_regret_is_the_difference_to_hindsight_of_the_same_pair() -> None:
    best = [plain(proposer=HINDSIGHT, seed=1, production_loss=0.01), plain(proposer=HINDSIGHT, seed=2, success=False)]
    rows = [plain(seed=1, production_loss=0.05, success=False), plain(seed=2, success=False)]
    beside = against(rows, yardsticks(best))
    assert beside.missed is not None and (beside.missed.count, beside.missed.of) == (1, 1)
    assert beside.loss_regret is not None and beside.loss_regret.worst == pytest.approx(0.04)
    assert beside.time_regret is None
    batch = {"batch": True, "nominal_s": 290.0}
    late = against(
        [plain(**batch, complete_s=320.0)], yardsticks([plain(proposer=HINDSIGHT, **batch, complete_s=300.0)])
    )
    assert late.time_regret == Spread(20.0, 20.0, 1)
    assert late.loss_regret is None


def test_comparisons_are_made_pair_by_pair() -> None:
    ours = [plain(seed=s, success=s != 1, exposure_s=10.0 * (s == 1)) for s in (1, 2, 3)]
    other = [plain(proposer="m", seed=s, success=s == 1, exposure_s=0.0) for s in (1, 2, 3, 4)]
    (one,) = comparisons([*ours, *other])
    assert (one.name, one.reference, one.pairs) == ("m", "search", 3)
    assert (one.both, one.only_this, one.only_reference, one.neither) == (0, 1, 2, 0)
    assert one.p == one.p_adjusted == 1.0
    assert one.exposure is not None and one.exposure.mean == pytest.approx(-10 / 3)
    assert one.delay is None
    (turned,) = comparisons([*ours, *other], reference="m")
    assert (turned.name, turned.only_this, turned.only_reference) == ("search", 2, 1)
    assert comparisons([*ours, *other], reference="nobody") == []


def test_groups_are_in_order_whatever_the_order_of_the_rows() -> None:
    rows = campaign(range(1, 3))
    assert overall(rows) == overall(rows[::-1])
    assert by_scenario(rows) == by_scenario(rows[::-1])
    assert {group.scenario for group in by_published(rows)} >= {"normal", "fouling", "leak"}
    assert entrants(rows[::-1])[:2] == ["search", "search, graph"]
    assert entrants(rows)[-2:] == [DO_NOTHING, HINDSIGHT]
    assert scenarios([row for row in rows if row.case == "cstr"])[0] == "normal"


@pytest.mark.parametrize(
    ("proposer", "expected"),
    [
        ("search", Source.MEASURED), ("openai:gpt-4o-mini", Source.MEASURED), ("replay:a.jsonl", Source.REPLAYED),
        ("scripted:reasonable", Source.SCRIPTED), (HINDSIGHT, Source.YARDSTICK), (DO_NOTHING, Source.YARDSTICK),
    ],
)  # fmt: skip
def test_what_no_model_said_there_and_then_is_marked(proposer: str, expected: Source) -> None:
    assert source(proposer) is expected
    assert entrant(plain(proposer=proposer, ablation="graph")) == f"{proposer}, graph"
