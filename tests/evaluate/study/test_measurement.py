"""Rows of real runs: short ones, shared by all tests of this file."""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyarrow import parquet

from homeostat.domain.plant.limits import LimitKind
from homeostat.evaluate import beginning
from homeostat.evaluate.reference.best_constant import BestConstant
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.measurement import KeptRuns, measure, without_faults
from homeostat.evaluate.study.plan.job import Job
from homeostat.evaluate.study.plan.plants import loaded
from homeostat.journal import read_events
from homeostat.journal.verify.verify import verify
from homeostat.plants.plant import Plant
from homeostat.record.row import Row
from tests.evaluate.study.plans import BATCH, COOLING, PUMP, lasting, one

pytestmark = pytest.mark.filterwarnings("ignore:open_binary is deprecated:DeprecationWarning")  # on counting tokens

ARMS = ("search", "scripted:reasonable", "constant", "fallback-only", "do-nothing", "hindsight")
UNKNOWN = {**COOLING, "unknown": True}
VALUES = {"P102.cmd": 0.8}
"""What the constant answer commands where it may."""


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    yield tmp_path_factory.mktemp("measured")
    ran.cache_clear()


@functools.cache
def ran(root: Path, who: str, which: str, ablation: str = "none", told: bool = False) -> tuple[Job, Row]:
    """A run that is kept, and its row."""
    scenario: dict[str, Any] = {"batch": BATCH, "pump": PUMP, "cooling": COOLING, "unknown": UNKNOWN}[which]
    proposer: dict[str, Any] = {
        "who": who,
        "label_given": told,
        "name": f"{who.partition(':')[2] or who}{' told' if told else ''}",
    }
    proposer |= {"values": VALUES} if who == "constant" else {}
    job = one(proposer, scenario, ablation, keep="all")
    return job, measure(job, KeptRuns(root))


def events(root: Path, row: Row, kind: str) -> list[tuple[float, dict[str, Any]]]:
    return [(e.at_s, dict(e.fields)) for e in read_events(root / row.trace) if e.kind == kind]


def truth(root: Path, row: Row) -> dict[str, np.ndarray[Any, Any]]:
    table = parquet.read_table(root / row.trace / "trajectory.parquet")
    return {name: table[name].to_numpy() for name in table.schema.names}


def by_tag(columns: dict[str, np.ndarray[Any, Any]]) -> dict[str, np.ndarray[Any, Any]]:
    return {name.removeprefix("true "): values[None] for name, values in columns.items() if name.startswith("true ")}


@pytest.mark.slow
@pytest.mark.parametrize("which", ["pump", "cooling"])
@pytest.mark.parametrize("who", [pytest.param("search", marks=pytest.mark.wide), *ARMS[1:-1]])
def test_a_row_says_what_the_kept_run_holds(root: Path, who: str, which: str) -> None:
    if (who, which) in (("constant", "cooling"), ("search", "pump"), ("scripted:reasonable", "pump")):
        pytest.skip("seconds for nothing that another pair does not show")
    job, row = ran(root, who, which)
    assert row.trace == f"runs/{job.name}" and verify(root / row.trace).intact and verify(root / row.trace).complete
    columns, limits = truth(root, row), loaded(row.case).description.limits
    states = events(root, row, "state-entered")
    started = states[0][0] if states else columns["t_s"][0]
    after = columns["t_s"] > started
    outside, margins = [0.0], []
    for limit in limits.hard:
        assert limit.kind is not LimitKind.PERMISSIVE
        margin = np.broadcast_to(limit.formula.margins(by_tag(columns), 1.0), (1, after.size))[0]
        outside.append(float((margin[after] < 0.0).sum()))
        scale = loaded(row.case).description.scales.get(limit.formula.unit, 1.0)
        margins.append((float(margin[after].min()) / scale, limit.name))
    assert row.exposure_s == max(outside)
    assert (row.least_margin, row.least_margin_limit) == (pytest.approx(min(margins)[0]), min(margins)[1])
    onset = job.scenario.onset_s
    assert onset is not None
    reports = [at_s for at_s, _ in events(root, row, "diagnosed") if at_s >= onset]
    assert row.detection_s == (reports[0] - onset if reports else None)
    attempts = events(root, row, "attempted")
    assert (row.attempts, row.refused) == (len(attempts), sum(not e["approved"] for _, e in attempts))
    released, fell = events(root, row, "released"), events(root, row, "fallback-activated")
    assert (row.releases, row.fallbacks) == (len(released), len(fell))
    assert row.released_s == (released[0][0] - onset if released else None)
    assert row.success == (row.outcome == "recovered") and row.acted == bool(released or fell)
    assert row.state == (states[-1][1]["state"] if states else row.state)
    result = json.loads((root / row.trace / "result.json").read_text())
    assert result["outcome"] == row.outcome


def test_production_of_a_batch_is_what_was_drained(root: Path) -> None:
    done, idle = ran(root, "constant", "pump")[1], ran(root, "do-nothing", "pump")[1]
    healthy = ran(root, "do-nothing", "batch")[1]
    drained = {row.job: truth(root, row)["true batch.delivered"] for row in (done, idle, healthy)}
    made = {job: values[-1] - values[0] for job, values in drained.items()}
    for row in (done, idle):
        assert row.production_loss == pytest.approx(1.0 - made[row.job] / made[healthy.job], abs=1e-6)
    assert (done.batch, done.nominal_s) == (True, healthy.complete_s)
    assert done.complete_s is not None and done.nominal_s is not None and done.complete_s >= done.nominal_s - 60.0


def test_who_does_nothing_writes_nothing(root: Path) -> None:
    for which in ("pump", "cooling", "batch"):
        row = ran(root, "do-nothing", which)[1]
        kinds = {e.kind for e in read_events(root / row.trace)}
        assert kinds <= {"run-started", "state-entered", "run-finished", "signed"}
        assert (row.actor, row.acted, row.releases, row.fallbacks, row.attempts, row.decisions) == (
            "none",
            False,
            0,
            0,
            0,
            0,
        )
        assert (row.detection_s, row.believed, row.wall_decision_s) == (None, "", None)


def test_only_the_fallback_acts_where_nobody_proposes(root: Path) -> None:
    for which in ("pump", "cooling"):
        row = ran(root, "fallback-only", which)[1]
        assert (row.actor, row.attempts, row.releases, row.success) == ("fallback", 0, 0, False)
        assert row.fallbacks == 1 and row.outcome == "fallback" and row.reason


def test_a_constant_answer_is_constant(root: Path) -> None:
    row = ran(root, "constant", "pump")[1]
    assert row.actor == row.proposer == "constant"
    sets = events(root, row, "attempted") + events(root, row, "released")
    speeds = {c["value"] for _, e in sets for c in e["commands"] if c["tag"] == "P102.cmd"}
    assert 0.8 in speeds and speeds <= {0.0, 0.8}  # off where a state leaves nothing open


def test_a_script_s_calls_are_counted(root: Path) -> None:
    row = ran(root, "scripted:reasonable", "cooling")[1]
    calls = events(root, row, "model-called")
    by_agent = {agent: sum(e["agent"] == agent for _, e in calls) for agent in ("planning", "action", "reprompting")}
    assert by_agent == {
        "planning": row.planning_calls, "action": row.action_calls, "reprompting": row.reprompting_calls,
    }  # fmt: skip
    assert row.planning_calls > 0 and row.planning_in > row.planning_out > 0 and row.tokens_by == "estimate"
    assert row.proposer == "scripted:reasonable" and row.actor == "language" and row.plans is None


@pytest.mark.slow
def test_hindsight_is_never_worse(root: Path) -> None:
    """It searches a grid: on the reactor a percent of the production may lie between its points."""
    best = ran(root, "hindsight", "cooling")[1]
    for who in ("search", "scripted:reasonable"):
        row = ran(root, who, "cooling")[1]
        assert row.success and best.success and best.exposure_s == 0.0
        assert row.production_loss is not None and best.production_loss is not None
        assert best.production_loss <= row.production_loss + 0.01
    best, row = ran(root, "hindsight", "pump")[1], ran(root, "constant", "pump")[1]
    assert best.complete_s is not None and row.complete_s is not None and best.complete_s <= row.complete_s + 1.0
    assert (best.outcome, best.actor, best.trace, best.attempts) == ("possible", "hindsight", "", 0)


@pytest.mark.parametrize(
    ("changed", "success"),
    [
        ({"onset_s": 0.0, "end_s": 600.0}, False), ({"onset_s": 1199.5}, True), ({"onset_s": 900.4}, True),
        ({"fault": "none", "onset_s": None}, True), ({"fault": "none", "onset_s": None, "end_s": 100.0}, False),
    ],
)  # fmt: skip
def test_hindsight_at_the_edges(changed: dict[str, Any], success: bool) -> None:
    """No onset is too early, too late or between two seconds; and it succeeds where doing nothing does."""
    row = measure(one("hindsight", {**COOLING, **changed}), KeptRuns(None))
    idle = measure(one("do-nothing", {**COOLING, **changed}), KeptRuns(None))
    assert row.success is success and row.success >= idle.success
    assert row.outcome == ("possible" if success else "impossible")


@pytest.mark.slow
def test_hindsight_sees_that_a_plant_comes_back_by_itself() -> None:
    scenario = {"case": "cstr", "fault": "inlet_stuck_open", "end_s": 3000.0}
    idle, best = (measure(one(who, scenario), KeptRuns(None)) for who in ("do-nothing", "hindsight"))
    assert idle.exposure_s > 0.0 and idle.success <= best.success


def test_a_run_that_ends_before_anything_can_be_judged_is_a_failure() -> None:
    with pytest.raises(ValueError, match=r"the run ends at 1 s, before there is anything to judge; make it longer"):
        measure(one("do-nothing", {"case": "cstr", "end_s": 1.0}), KeptRuns(None))


@pytest.mark.parametrize(
    ("who", "which"),
    [
        ("fallback-only", "pump"),
        *(
            pytest.param(*job, marks=pytest.mark.wide)
            for job in (("scripted:reasonable", "cooling"), ("hindsight", "pump"))
        ),
    ],
)
def test_the_same_job_gives_the_same_row(root: Path, tmp_path: Path, who: str, which: str) -> None:
    job, row = ran(root, who, which)
    again = measure(job, KeptRuns(tmp_path))
    assert lasting(again) == lasting(row)
    assert verify(tmp_path / again.trace).complete or who == "hindsight"


@pytest.mark.slow
def test_what_is_kept(tmp_path: Path) -> None:
    def kept(who: str, scenario: dict[str, Any], keep: str) -> tuple[Row, list[str]]:
        row = measure(one(who, scenario, keep=keep), KeptRuns(tmp_path))
        return row, [path.name for path in (tmp_path / "runs").glob("*")]

    for keep in ("none", "failures"):  # reference policies are there to fail, and this one succeeds
        row, there = kept("do-nothing", PUMP, keep)
        assert (row.trace, there, row.success) == ("", [], False)
    row, there = kept("search", BATCH, "failures")
    assert (row.trace, there, row.success) == ("", [], True)
    row, there = kept("scripted:stubborn", COOLING, "failures")
    assert (row.success, there, row.trace) == (False, [row.job], f"runs/{row.job}")
    assert verify(tmp_path / row.trace).complete and (tmp_path / row.trace / "figure.png").exists()
    row, there = kept("do-nothing", BATCH, "all")
    assert verify(tmp_path / row.trace).complete and (tmp_path / row.trace / "figure.png").exists()


def test_what_an_earlier_try_left_is_replaced(tmp_path: Path) -> None:
    job = one("do-nothing", BATCH, keep="all")
    left = tmp_path / "runs" / job.name
    left.mkdir(parents=True)
    (left / "events.jsonl").write_text("half a line")
    row = measure(job, KeptRuns(tmp_path))
    assert verify(tmp_path / row.trace).complete


@pytest.mark.slow
def test_without_ensemble_there_is_one_member(root: Path) -> None:
    whole, alone = (
        ran(root, "scripted:reasonable", "cooling")[1],
        ran(root, "scripted:reasonable", "cooling", "no-ensemble")[1],
    )
    members = {e["members"] for _, e in events(root, alone, "attempted")} - {0}
    assert members == {1} and max(e["members"] for _, e in events(root, whole, "attempted")) > 1
    assert all(len(e["hypotheses"]) <= 1 for _, e in events(root, alone, "diagnosed"))
    assert alone.believed_p == 1.0 and alone.ablation == "no-ensemble"


@pytest.mark.slow
def test_without_reprompting_there_is_one_attempt_each(root: Path) -> None:
    row = ran(root, "scripted:reasonable", "cooling", "no-reprompting")[1]
    noticed = [at_s for at_s, _ in events(root, row, "noticed")]
    assert row.attempts >= 1 and row.reprompting_calls == 0
    attempted = [e for _, e in events(root, row, "attempted")]
    assert {e["number"] for e in attempted} == {1}
    for proposer in {e["proposer"] for e in attempted}:
        mine = [e for e in attempted if e["proposer"] == proposer and not e["polished"]]
        assert 1 <= len(mine) <= len(noticed)


@pytest.mark.slow
@pytest.mark.parametrize("how", [pytest.param("ablation", marks=pytest.mark.wide), "proposer"])
def test_who_is_told_believes_the_truth(root: Path, how: str) -> None:
    ablation, told = ("label-given", False) if how == "ablation" else ("none", True)
    row = ran(root, "scripted:reasonable", "cooling", ablation, told)[1]
    assert (row.believed, row.believed_p, row.true_p, row.brier) == ("cool_stuck_closed", 1.0, 1.0, 0.0)
    assert (row.detection_s, row.false_alarm) == (0.0, False)
    (hypothesis,) = events(root, row, "diagnosed")[0][1]["hypotheses"]
    assert hypothesis["probability"] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize("ablation", ["none", "documents", pytest.param("no-graph", marks=pytest.mark.wide)])
def test_nobody_is_shown_an_unknown_fault(root: Path, ablation: str) -> None:
    row = ran(root, "scripted:reasonable", "unknown", ablation)[1]
    name = "cool_stuck_closed"
    assert (row.kind, row.fault) == ("unknown", name)
    assert row.believed not in ("", name) and row.true_p == 0.0 and row.brier is not None and row.brier >= 1.0
    folders = ("prompts", "answers", "subgraphs", "queries")
    shown = [path for folder in folders for path in (root / row.trace / folder).glob("*")]
    assert [path for path in shown if path.suffix == ".md"]
    assert not [path for path in shown if name in path.read_text()]
    assert not [e for _, e in events(root, row, "diagnosed") if name in json.dumps(e, default=str)]
    # The plant has it all the same: left alone, it gets as hot as one whose tables have the fault.
    assert (
        measure(one("do-nothing", UNKNOWN), KeptRuns(None)).exposure_s
        == ran(root, "do-nothing", "cooling")[1].exposure_s
    )


@pytest.mark.parametrize("name", ["cstr", "mixing_module"])
def test_an_unknown_fault_is_in_no_table_and_in_no_triple(name: str) -> None:
    plant = loaded(name)
    count = "SELECT ?s WHERE {{ {{ ?s ?p <{0}> }} UNION {{ <{0}> ?p ?s }} }}"
    for mode in plant.description.faults:
        known = without_faults(plant, [mode.name])
        assert not known.graph.select(count.format(f"{plant.namespace}fault_{mode.name}"))
        assert mode.name not in {f.name for f in known.description.faults}
        assert not [rule for rule in known.description.symptom_rules if mode.name in rule.faults]
        assert len(known.description.faults) == len(plant.description.faults) - 1
        assert len(known.description.symptom_rules) == len(plant.description.symptom_rules)
    assert plant.graph.select(count.format(f"{plant.namespace}fault_{mode.name}"))  # the plant itself is as it was


DISTURBED = {"case": "cstr", "end_s": 1200.0, "name": "warm coolant", "disturbances": ["T_coolant + 2 from 900"]}


def test_a_disturbed_plant_is_a_scenario_like_any_other(tmp_path: Path) -> None:
    job = one("do-nothing", DISTURBED, mismatch="plant")
    row = measure(job, KeptRuns(tmp_path))
    assert (row.kind, row.fault, row.mismatch) == ("disturbed", "none", "plant")
    assert row.disturbances == "T_coolant + 2 from 900" and row.scenario == "warm coolant"
    usual = measure(one("do-nothing", {**DISTURBED, "mismatch": "none"}, mismatch="plant"), KeptRuns(None))
    assert usual.mismatch == "none" and usual.least_margin != row.least_margin


@pytest.mark.slow
def test_a_grade_that_does_not_follow_is_missed_by_a_run_that_succeeds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beginning, "RUNS", 5)
    order = {"case": "tennessee_eastman", "name": "grade", "end_s": 36000.0, "begins_in": "regulatory"}
    rows = [measure(one("do-nothing", {**order, "setpoints": {"X11G.sp": g}}), KeptRuns(None)) for g in (60.0, 55.0)]
    assert [row.success for row in rows] == [True, True]
    assert [row.missed for row in rows] == ["ACC-G", ""]


def test_hindsight_searches_the_true_plant_and_not_its_model() -> None:
    disturbed = {**DISTURBED, "disturbances": ["T_coolant + 12 from 900"]}
    best, idle = (measure(one(who, disturbed, mismatch="plant"), KeptRuns(None)) for who in ("hindsight", "do-nothing"))
    assert idle.exposure_s > 0.0 and not idle.success
    assert best.exposure_s < idle.exposure_s and best.mismatch == "plant"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changed", "from_s"),
    [
        ({"fault": "none", "onset_s": None, "begins_in": "reduced_load", "setpoints": {"F1.sp": 0.02}}, 1.0),
        ({"begins_in": "reduced_load"}, 900.0),
        ({"setpoints": {"T1.sp": 305.0}}, 900.0),
        ({"fault": "none", "onset_s": None}, None),
    ],
)
def test_hindsight_searches_the_plant_as_it_stands_when_the_run_begins(
    changed: dict[str, Any], from_s: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What an operator has set, or a state to begin in, is enough to search from the start on."""
    asked: list[tuple[Plant, float]] = []

    def nothing(plant: Plant, scenario: Scenario, at_s: float) -> BestConstant:
        asked.append((plant, at_s))
        return BestConstant(None, math.nan, 0, 1)

    monkeypatch.setattr("homeostat.evaluate.study.hindsight.best_answer", nothing)
    scenario = {**COOLING, "name": "elsewhere", **changed}
    row, idle = (measure(one(who, scenario), KeptRuns(None)) for who in ("hindsight", "do-nothing"))
    assert [at_s for _, at_s in asked] == ([] if from_s is None else [from_s])
    for plant, _ in asked:
        start = dict(zip(plant.model.inputs, plant.start.tolist(), strict=True))
        for tag, value in changed.get("setpoints", {}).items():
            assert start[plant.description.variables[tag]] == value
        assert plant.description.machine.initial.name == changed.get("begins_in", "starting")
    assert (row.exposure_s, row.production_loss) == (idle.exposure_s, idle.production_loss)
