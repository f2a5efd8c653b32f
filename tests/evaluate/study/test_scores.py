"""Scores of small groups of rows, by hand."""

from __future__ import annotations

import pytest

from homeostat.evaluate.report.contents import contents
from homeostat.evaluate.report.groups import Group, Origin, arm, arms, by_scenario, overall, scenarios, source
from homeostat.evaluate.report.measures import References, comparisons, reliability, tokens_of
from homeostat.evaluate.report.statistics import Rate, Spread
from homeostat.evaluate.report.tables.scores import (
    DIAGNOSIS,
    EFFORT,
    LATENCY,
    RUNS,
    SUCCESS,
    Scores,
    beside,
    mean,
    safety,
    words,
)
from homeostat.evaluate.report.tables.table import Cell
from homeostat.record.row import DO_NOTHING, HINDSIGHT, Row
from tests.evaluate.study.fake_rows import campaign, plain

ENDS = ((True, True), (True, False), (False, True), (False, False))
"""Whether this one succeeded, and whether the reference did."""


def cells(scores: Scores, rows: list[Row]) -> dict[str, Cell]:
    """Heading -> what the group of ``rows`` has there."""
    group = Group("cstr", "all", "search", "none", tuple(rows))
    return {score.column.name: score.of(group) for score in scores}


def counted(cell: Cell) -> tuple[int, int]:
    assert isinstance(cell, Rate)
    return cell.count, cell.of


def test_recovery_counts_the_runs_in_which_something_was_refused() -> None:
    rows = [plain(refused=2), plain(refused=1, success=False), plain(refused=0, success=False), plain()]
    scores = cells((RUNS, *SUCCESS), rows)
    assert scores["runs"] == 4
    assert counted(scores["success"]) == (2, 4)
    assert counted(scores["recovery"]) == (1, 2)
    assert cells(SUCCESS, [plain()])["recovery"] is None


def test_a_fallback_is_a_failure() -> None:
    rows = [plain(fallbacks=1, actor="fallback"), plain()]
    assert counted(cells(SUCCESS, rows)["success"])[0] == 1
    (actors,) = (table for table in contents(rows).main if table.name == "actors")
    (line,) = actors.lines
    assert [name for name in actors.header if name.startswith(("by ", "left"))] == ["by search"]
    assert dict(zip(actors.header, line, strict=True))["by search"] == 1


def test_steps_are_pooled_and_unknown_where_nothing_was_asked() -> None:
    asked = {"plans": 4, "plans_right": 3, "actions": 5, "actions_right": 5, "on_right": 6, "on_wrong": 2}
    scores = cells(SUCCESS, [plain(**asked, on_missed=0), plain(**asked, on_missed=3), plain()])
    assert counted(scores["plan correctness"]) == (6, 8)
    assert scores["plan correctness"].interval is None
    assert scores["action correctness"].share == 1.0
    assert scores["precision"].share == pytest.approx(12 / 16)
    assert scores["recall"].share == pytest.approx(12 / 15)
    silent = cells(SUCCESS, [plain()])
    assert (silent["plan correctness"], silent["action correctness"], silent["precision"], silent["recall"]) == (
        None,
    ) * 4


def test_effort_is_that_of_the_runs_in_which_a_model_was_asked() -> None:
    asked = plain(planning_calls=2, planning_in=100, planning_out=10, tokens_by="server", cost_usd=0.25, failures=1)
    more = plain(action_calls=1, action_in=300, action_out=30, tokens_by="estimate", cost_usd=0.5)
    effort = cells(EFFORT, [asked, more, plain()])
    assert (effort["runs asked"], effort["unanswered"], effort["counted by"]) == (2, 1, "estimate, server")
    assert effort["tokens in [k]"].mean == 200.0
    assert effort["calls"] == Spread(1.5, 2.0, 2)
    assert effort["price [USD]"] == Spread(0.375, 0.5, 2)
    assert [tokens.agent for tokens in tokens_of([asked, more, plain()])] == ["planning", "action"]
    assert cells(EFFORT, [asked, plain(action_calls=1)])["price [USD]"] is None
    nothing = cells(EFFORT, [plain()])
    assert (nothing["runs asked"], nothing["tokens in [k]"], nothing["price [USD]"]) == (0, None, None)
    assert tokens_of([plain()]) == []


def test_latency_leaves_out_runs_in_which_nobody_acted() -> None:
    latency = cells(
        (*LATENCY, mean("mean call [s]", lambda row: row.wall_call_s)),
        [plain(wall_decision_s=None), plain(wall_decision_s=3.0, wall_s=5.0)],
    )
    assert latency["first decision [s]"] == Spread(3.0, 3.0, 1)
    assert latency["run [s]"].mean == 4.0
    assert (latency["call [s]"], latency["mean call [s]"]) == (None, None)


def test_safety_shows_the_worst_run() -> None:
    bad = plain(exposure_s=90.0, least_margin=-0.5, least_margin_limit="L1 high", production_loss=0.5)
    found = cells(safety([]), [plain(), plain(), bad])
    assert (found["no limit broken"].count, found["no limit broken"].of) == (2, 3)
    assert found["exposure [s]"] == Spread(0.0, 90.0, 3)
    assert found["least margin"] == Spread(0.1, -0.5, 3)
    assert found["closest limit"] == "L1 high"
    assert (found["batches complete"], found["delay [s]"]) == (None, None)


def test_a_total_is_a_column_by_its_name_where_a_plant_reports_it() -> None:
    rows = [
        plain(totals={"spilled_L": 0.5}),
        plain(totals={"spilled_L": 0.1}),
        plain(totals={"dry_run_s": 3.0}),
        plain(),
    ]
    always = {score.column.name for score in safety([plain()])}
    assert {score.column.name for score in safety(rows)} - always == {"dry run [s]", "spilled [L]"}
    found, none = cells(safety(rows), rows), cells(safety(rows), [plain()])
    assert (found["dry run [s]"], found["spilled [L]"]) == (Spread(3.0, 3.0, 1), Spread(0.3, 0.5, 2))
    assert (none["dry run [s]"], none["spilled [L]"]) == (None, None)


def test_delay_is_that_of_completed_batches() -> None:
    rows = [plain(batch=True, complete_s=310.0, nominal_s=300.0), plain(batch=True, nominal_s=300.0, success=False)]
    found = cells(safety(rows), rows)
    assert counted(found["batches complete"]) == (1, 2)
    assert found["delay [s]"] == Spread(10.0, 10.0, 1)


def test_diagnosis_is_right_in_any_order_of_the_faults() -> None:
    rows = [
        plain(fault="a+b", believed="b+a", believed_p=0.95), plain(believed="leak", believed_p=0.91, true_p=0.0),
        plain(fault="none", believed="", believed_p=None, true_p=None, brier=None, detection_s=None, false_alarm=True),
    ]  # fmt: skip
    scores = cells(DIAGNOSIS, rows)
    assert counted(scores["diagnosis right"]) == (1, 2)
    assert counted(scores["detected"]) == (2, 2)
    assert scores["false alarms"].count == 1
    assert scores["probability of the truth"].mean == pytest.approx(0.45)
    (one,) = reliability(rows)
    assert (one.low, one.high, one.believed) == pytest.approx((0.9, 1.0, 0.93))
    assert counted(one.right) == (1, 2)


def test_certainty_belongs_to_the_last_bin() -> None:
    assert [one.low for one in reliability([plain(believed_p=1.0), plain(believed_p=0.0)])] == [0.0, 0.9]


def test_over_reaction_needs_a_run_that_shows_that_nothing_had_to_be_done() -> None:
    harmless = plain(proposer=DO_NOTHING, seed=1, acted=False)
    harmful = plain(proposer=DO_NOTHING, seed=2, acted=False, exposure_s=5.0)
    rows = [plain(seed=1, acted=True), plain(seed=2, acted=True), plain(seed=3, acted=True)]
    found = cells(beside(References.among([harmless, harmful])), rows)
    assert counted(found["over-reaction"]) == (1, 1)
    assert cells(beside(References.among([harmful])), rows)["over-reaction"] is None
    assert cells(beside(References.among([])), rows)["possible and missed"] is None


def test_regret_is_the_difference_to_hindsight_of_the_same_pair() -> None:
    best = [plain(proposer=HINDSIGHT, seed=1, production_loss=0.01), plain(proposer=HINDSIGHT, seed=2, success=False)]
    rows = [plain(seed=1, production_loss=0.05, success=False), plain(seed=2, success=False)]
    found = cells(beside(References.among(best)), rows)
    assert counted(found["possible and missed"]) == (1, 1)
    assert found["loss beyond hindsight [%]"].worst == pytest.approx(0.04)
    assert found["later than hindsight [s]"] is None
    batch = {"batch": True, "nominal_s": 290.0}
    possible = References.among([plain(proposer=HINDSIGHT, **batch, complete_s=300.0)])
    late = cells(beside(possible), [plain(**batch, complete_s=320.0)])
    assert late["later than hindsight [s]"] == Spread(20.0, 20.0, 1)
    assert late["loss beyond hindsight [%]"] is None


def test_comparisons_are_made_pair_by_pair() -> None:
    ours = [plain(seed=s, success=s != 1, exposure_s=10.0 * (s == 1)) for s in (1, 2, 3)]
    other = [plain(proposer="m", seed=s, success=s == 1, exposure_s=0.0) for s in (1, 2, 3, 4)]
    (one,) = comparisons([*ours, *other])
    assert (one.group.name, one.reference, len(one.pairs)) == ("m", "search", 3)
    assert tuple(one.ended(this, other) for this, other in ENDS) == (0, 1, 2, 0)
    assert one.p == one.p_adjusted == 1.0
    exposure = one.difference(lambda row: row.exposure_s)
    assert exposure is not None and exposure.mean == pytest.approx(-10 / 3)
    assert one.difference(lambda row: row.delay_s) is None
    (turned,) = comparisons([*ours, *other], reference="m")
    assert (turned.group.name, turned.ended(True, False), turned.ended(False, True)) == ("search", 2, 1)
    assert comparisons([*ours, *other], reference="nobody") == []


def test_what_is_said_of_a_column_is_said_of_one_that_is_there() -> None:
    shown = {table.name: table for table in contents(campaign(range(1, 3))).tables}
    for name, said in words().items():
        assert set(said.columns) - {"figures"} <= set(shown[name].header)
        told = {"spilled [L]": "total of a run: median (worst)", **said.columns}
        assert all(column.meaning == told.get(column.name, "") for column in shown[name].columns)


def test_groups_are_in_order_whatever_the_order_of_the_rows() -> None:
    rows = campaign(range(1, 3))
    assert overall(rows) == overall(rows[::-1])
    assert by_scenario(rows) == by_scenario(rows[::-1])
    assert arms(rows[::-1])[:2] == ["search", "search, graph"]
    assert arms(rows)[-2:] == [DO_NOTHING, HINDSIGHT]
    assert scenarios([row for row in rows if row.case == "cstr"])[0] == "normal"


@pytest.mark.parametrize(
    ("proposer", "expected"),
    [
        ("search", Origin.MEASURED), ("openai:gpt-4o-mini", Origin.MEASURED), ("replay:a.jsonl", Origin.REPLAYED),
        ("scripted:reasonable", Origin.SCRIPTED), (HINDSIGHT, Origin.REFERENCE), (DO_NOTHING, Origin.REFERENCE),
    ],
)  # fmt: skip
def test_what_no_model_said_there_and_then_is_marked(proposer: str, expected: Origin) -> None:
    assert source(proposer) is expected
    assert arm(plain(proposer=proposer, ablation="graph")) == f"{proposer}, graph"
