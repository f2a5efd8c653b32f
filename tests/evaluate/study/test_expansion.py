"""From a plan to its jobs: paired, reproducible, and told apart by everything that changes a row."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from homeostat.agents.language.named_model import NamedModel
from homeostat.evaluate.operation import Thinking
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.job import ABLATIONS
from homeostat.evaluate.study.plan.plan import read_plan
from homeostat.evaluate.study.plan.plants import loaded
from tests.cli.command import environment
from tests.evaluate.study.plans import COOLING, PUMP, jobs, one

ROBUST = Path(__file__).parents[3] / "campaigns" / "robust.toml"


def test_draws_follow_from_seed_and_scenario_s_name_alone() -> None:
    plan = read_plan(ROBUST)
    mixed = list(plan.scenarios)
    random.Random(3).shuffle(mixed)
    for order in (mixed, mixed[: len(mixed) // 2]):
        other = plan.model_copy(update={"scenarios": tuple(order), "seeds": (5, 3), "proposers": plan.proposers[:1]})
        expected = {job.name: job for job in jobs_of(plan, ROBUST.parent)}
        for job in jobs_of(other, ROBUST.parent):
            assert job.scenario == expected[job.name].scenario
            assert job.fingerprint == expected[job.name].fingerprint


def test_everybody_meets_the_same_plants() -> None:
    met = defaultdict(set)
    jobs_there = jobs_of(read_plan(ROBUST), ROBUST.parent)
    for job in jobs_there:
        met[job.scenario.case, job.label, job.scenario.seed].add(job.scenario)
    assert len(met) == 65 and all(len(found) == 1 for found in met.values())
    # Seeds are worth something: what is drawn differs between them.
    drawn = {job.scenario.faults for job in jobs_there if job.label == "heat removal"}
    assert len(drawn) == 5


def test_what_is_drawn_lies_in_its_range() -> None:
    for job in jobs_of(read_plan(ROBUST).model_copy(update={"seeds": 40}), ROBUST.parent):
        modes = {f.name: f for f in loaded(job.scenario.case).description.faults}
        low, high = (1000.0, 3000.0) if job.scenario.case == "cstr" else (5.0, 230.0)
        for fault in job.scenario.faults:
            assert modes[fault.fault].severity_range.contains(fault.severity)
            assert low <= fault.onset_s <= high
        assert len({f.fault for f in job.scenario.faults}) == (
            2 if job.label == "two at once" else len(job.scenario.faults)
        )


def test_a_narrow_range_is_drawn_from_as_a_whole() -> None:
    leaks = jobs(seeds=50, scenarios=[{"case": "cstr", "fault": "leak", "severity": [0.00021, 0.00029]}])
    drawn = [job.scenario.faults[0].severity for job in leaks]
    assert len(set(drawn)) > 40 and 0.00021 <= min(drawn) < 0.00022 and 0.00028 < max(drawn) <= 0.00029
    assert all(float(f"{severity:.5g}") == severity for severity in drawn)


def test_ablations_where_they_matter() -> None:
    proposers: list[Any] = [
        "search", {"who": "search", "name": "told", "label_given": True}, "scripted:reasonable", "constant",
        "fallback-only", "do-nothing", "hindsight",
    ]  # fmt: skip
    by_proposer = defaultdict(list)
    for job in jobs(proposers=proposers, scenarios=[COOLING], ablations=list(ABLATIONS)):
        by_proposer[job.arm.label].append(job.ablation)
    assert by_proposer == {
        "search": ["none", "no-reprompting", "no-ensemble", "label-given"],
        "told": ["none", "no-reprompting", "no-ensemble"],
        "scripted:reasonable": list(ABLATIONS),
        **{name: ["none"] for name in ("constant", "fallback-only", "do-nothing", "hindsight")},
    }


def test_nobody_is_told_a_fault_that_nobody_knows() -> None:
    proposers: list[Any] = ["search", {"who": "search", "name": "told", "label_given": True}]
    unknown = jobs(proposers=proposers, scenarios=[{**PUMP, "unknown": True}], ablations=list(ABLATIONS))
    assert {(job.arm.label, job.ablation) for job in unknown} == {
        ("search", "none"), ("search", "no-reprompting"), ("search", "no-ensemble"),
    }  # fmt: skip
    assert {job.kind for job in unknown} == {"unknown"}


@pytest.mark.parametrize(
    ("fault", "kind"),
    [("none", "none"), ("leak", "single"), ("leak+fouling", "paired"), ("leak+fouling+temp_bias", "paired")],
)
def test_kinds(fault: str, kind: str) -> None:
    assert one("search", {"case": "cstr", "fault": fault}).kind == kind


def test_the_fingerprint_follows_whatever_changes_a_row(tmp_path: Path) -> None:
    job = one("scripted:reasonable", COOLING)
    assert job.arm.model is not None
    (fault,), arm, model = job.scenario.faults, job.arm, job.arm.model
    others = [
        replace(job, scenario=replace(job.scenario, seed=2)),
        replace(job, scenario=replace(job.scenario, end_s=1201.0)),
        replace(job, scenario=replace(job.scenario, faults=())),
        replace(job, scenario=replace(job.scenario, faults=(replace(fault, severity=0.71),))),
        replace(job, scenario=replace(job.scenario, faults=(replace(fault, onset_s=900.0001),))),
        replace(job, label="other"), replace(job, kind="unknown"), replace(job, published="x"),
        replace(job, ablation="no-graph"),
        replace(job, thinking=Thinking(declared_s=2.0)), replace(job, thinking=Thinking()),
        replace(job, arm=replace(arm, who="x")), replace(job, arm=replace(arm, label="x")),
        replace(job, arm=replace(arm, label_given=True)),
        replace(job, arm=replace(arm, then_search=True)),
        replace(job, arm=replace(arm, values={"F1.sp": 0.02})),
        replace(job, arm=replace(arm, model=replace(model, temperature=0.5))),
        replace(job, arm=replace(arm, model=replace(model, seed=7))),
        replace(job, arm=replace(arm, model=replace(model, name="scripted:stubborn"))),
        one({"who": "scripted:reasonable", "protocol": "per-step"}, PUMP), one("scripted:reasonable", PUMP),
    ]  # fmt: skip
    prints = [job.fingerprint, *(other.fingerprint for other in others)]
    assert len(set(prints)) == len(prints)
    assert replace(job, keep="all").fingerprint == job.fingerprint
    assert {len(p) for p in prints} == {32}


def test_the_fingerprint_follows_recorded_answers_and_not_their_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replayed(folder: Path) -> str:
        (job,) = jobs(folder, proposers=["replay:answers.jsonl"], scenarios=[COOLING])
        assert job.arm.model is not None and job.arm.model.recorded is not None
        assert job.arm.model.recorded.is_absolute()  # workers may stand elsewhere
        return job.fingerprint

    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "answers.jsonl").write_text("")
    monkeypatch.chdir(tmp_path)
    before = replayed(Path("a"))
    assert before == replayed(tmp_path / "a") == replayed(tmp_path / "b")
    (tmp_path / "b" / "answers.jsonl").write_text("\n")
    assert replayed(tmp_path / "b") != before == replayed(tmp_path / "a")


def test_the_same_in_every_process() -> None:
    code = (
        "from pathlib import Path; import sys\n"
        "from homeostat.evaluate.study.plan.expansion import jobs_of\n"
        "from homeostat.evaluate.study.plan.plan import read_plan\n"
        "path = Path(sys.argv[1])\n"
        "for job in jobs_of(read_plan(path), path.parent):\n"
        "    print(job.name, job.fingerprint, job.scenario)"
    )
    other = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    told = subprocess.run(
        [sys.executable, "-c", code, str(ROBUST)], env={**environment(), "PYTHONHASHSEED": other},
        capture_output=True, text=True, timeout=240, check=True,
    ).stdout  # fmt: skip
    here = jobs_of(read_plan(ROBUST), ROBUST.parent)
    assert told.splitlines() == [f"{job.name} {job.fingerprint} {job.scenario}" for job in here]


def test_models_are_asked_as_the_command_says() -> None:
    plan = read_plan(ROBUST)
    asked = jobs_of(plan, ROBUST.parent, NamedModel("", local_only=True, temperature=0.7, seed=3))
    models = {job.arm.model for job in asked if job.arm.model}
    assert models == {NamedModel("scripted:reasonable", True, (), 0.7, 3)}
