"""The study of Tennessee Eastman has the scenarios that qualified, as the list of candidates has them."""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.tennessee import campaign, page
from benchmarks.tennessee.alone import stuck, upsets
from benchmarks.tennessee.bars import missed
from benchmarks.tennessee.following import explained, looks
from benchmarks.tennessee.operated import Looked, everything
from benchmarks.tennessee.qualify import CANDIDATES, QUALIFIED, WANTED, Kind, qualified
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.ledger import write_dataset
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.plan import read_plan
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import new_sequencer
from tests.evaluate.study.fake_rows import plain

STUDY = CANDIDATES.with_name("tennessee.toml")
ONSET_S = 18000.0


def scenarios(path: Path) -> dict[str, list[Scenario]]:
    """Name -> its scenario in each seed, in the file's order."""
    found: dict[str, dict[int, Scenario]] = {}
    for job in jobs_of(read_plan(path), path.parent):
        found.setdefault(job.label, {})[job.scenario.seed] = job.scenario
    return {name: list(each.values()) for name, each in found.items()}


def test_the_first_thirteen_are_the_first_that_qualified_in_the_order_of_the_list() -> None:
    with QUALIFIED.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    candidates, study = scenarios(CANDIDATES), scenarios(STUDY)
    kinds = {row["candidate"]: Kind(row["kind"]) for row in rows}
    assert list(kinds) == list(candidates) and all(n == 3 for n in Counter(r["candidate"] for r in rows).values())
    first = [name for kind, most in WANTED.items() for name in [n for n, k in kinds.items() if k is kind][:most]]
    assert first == list(study)[:13] == list(dict.fromkeys(n for k in WANTED for n in first if kinds[n] is k))
    assert {row["candidate"] for row in rows if row["taken"] == "yes"} == set(first)
    for name in first:
        assert study[name] == candidates[name], name


def test_the_study_runs_everybody_whom_its_page_asks_for() -> None:
    kinds, proposers = qualified(), [each.label for each in read_plan(STUDY).proposers]
    rows = [
        plain(scenario=name, seed=seed, proposer=who, acted=kind is not Kind.NOTHING)
        for name, kind in kinds.items()
        for seed in (1, 2, 3)
        for who in proposers
    ]
    assert list(campaign.missing(rows, kinds)) == []


@pytest.mark.parametrize("path", [CANDIDATES, STUDY], ids=lambda path: path.stem)
def test_nothing_begins_before_monitoring_knows_the_plant(path: Path) -> None:
    plant = load_plant("tennessee_eastman", learned=False)
    known_s = plant.monitoring.settle_s + plant.monitoring.centre_s
    for name, each in scenarios(path).items():
        for case in each:
            begins = [f.onset_s for f in case.faults] + [d.from_s for d in case.disturbances]
            assert all(at_s > known_s + plant.monitoring.repeat_s for at_s in begins), name
            assert case.end_s - max(begins, default=0.0) >= 24 * 3600.0, name


def test_every_published_disturbance_stands_in_the_study_as_it_is_said_once() -> None:
    study = scenarios(STUDY)
    for idv, upset in upsets().items():
        (scenario, *_) = study[f"design, IDV {idv}"]
        assert [f.fault for f in scenario.faults] == ([upset.fault] if upset.fault else [])
        assert [str(d).replace(f" from {ONSET_S:g}", "") for d in scenario.disturbances] == list(upset.disturbances)
        assert scenario.mismatch == "plant"


def one(**changed: Any) -> Looked:
    """A run in which nothing had to be done, with what a test changes."""
    plain = Looked(
        name="IDV 16", told="warming_C * 1.25", hidden=True, seed=1, alone_h=None, alone_limit="", outcome="no action",
        detected_s=None, called="", probability=None, foreseen_s=None, released_s=None, action="", least_margin=0.4,
        least_margin_limit="LIM-PR-HIGH", lost=0.0, outside_s=0.0, decision_s=None, cpu_s=9.0, kept_by=0, tried=0,
        best_lost=None,
    )  # fmt: skip
    return replace(plain, **changed)


def test_every_disturbance_and_every_valve_stuck_in_three_ways_can_be_looked_after() -> None:
    plant = load_plant("tennessee_eastman", learned=False)
    every = {each.name: each.upset for each in everything(plant)}
    assert list(every)[:28] == [f"IDV {idv}" for idv in range(1, 29)]
    for valve in range(1, 13):
        assert {f"V{valve} {how}" for how in ("closed", "open", "as it stands")} <= every.keys()
    assert len(every) == 28 + 3 * 12
    case = every["V10 as it stands"].scenario(plant, 1, 18000.0, 46800.0, "plant")
    assert not case.faults and case.onset_s == 18000.0 and case.disturbances[0].size == 1.0
    assert [f.fault for f in every["V10 closed"].scenario(plant, 1, 18000.0, 46800.0).faults] == ["V10_stuck_closed"]


@pytest.mark.slow
def test_a_valve_that_sticks_where_it_stands_stands_there() -> None:
    plant = load_plant("tennessee_eastman", learned=False)
    case = stuck(plant)["V10 as it stands"].scenario(plant, 1, 1800.0, 5400.0)
    process = open_process(plant, case)
    watch(process, new_sequencer(plant).sample, lambda snapshot: False)
    truth = process.truth()
    after, opened = truth.times_s > 1800.0 + 60.0, truth.signals["V10_travel"][0]
    assert np.ptp(opened[after]) == 0.0 < np.ptp(opened[~after])


TRIPS = {"alone_h": 2.0, "alone_limit": "LIM-PR-HIGH"}
UNSAID, AFTER = "none was said in IDV 16 seed 1", "it was after it in IDV 16 seed 1"


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({}, ""),
        ({"called": "unknown_C1_warming_C", "probability": 0.8}, ""),
        ({"called": "V9_weak", "probability": 0.8}, "called unknown: another name in IDV 16 seed 1"),
        ({"hidden": False, "called": "V9_weak", "probability": 0.8}, ""),
        ({"decision_s": 20.0}, ""),
        ({"decision_s": 25.0}, "a decision within 20 s: 1 of 1 took longer, up to 25 s"),
        ({"outside_s": 60.0, "kept_by": 3, "tried": 9}, "a constant answer keeps them: not in IDV 16 seed 1"),
        ({"outside_s": 60.0, "kept_by": 0, "tried": 9}, ""),
        ({**TRIPS, "foreseen_s": 7000.0}, ""),
        ({**TRIPS, "foreseen_s": 7300.0}, f"a time to act by before the true trip: {AFTER}"),
        (TRIPS, f"a time to act by before the true trip: {UNSAID}"),
    ],
)
def test_what_is_asked_for_and_not_there_follows_from_what_is_in(changed: dict[str, Any], told: str) -> None:
    runs = [one(**changed)]
    lines = list(missed(runs, 1))
    assert any(told in line for line in lines)
    wrong = ("another name", "took longer", "not in IDV", AFTER, UNSAID)
    assert [word for word in wrong if any(word in line for line in lines)] == [word for word in wrong if word in told]
    assert any("1 of 192 runs are in" in line for line in missed(runs, 192))
    assert "IDV 16" in page._operated(runs) and "of 1 leave a trip limit" in page._summary(runs)


def test_a_bar_for_which_no_run_is_in_is_not_measured_and_not_met() -> None:
    lines = [*missed([], 192), *campaign.missing([], qualified())]
    said = {line.partition(":")[0] for line in lines if line.endswith(": not measured")}
    assert said == {
        "IDV 8 to 28 looked after",
        "a decision within 20 s",
        "inside the trip limits wherever a constant answer keeps them",
        "IDV 16, 17, 18, 20, which stand in no table, called unknown",
        "a time to act by before the true trip",
        "39 of 39 episodes inside the trip limits by search",
        "15 of 15 episodes without an action where nothing is needed",
        "9 of 9 episodes of quality at their grade in the end",
    }
    assert not any("rates within" in line for line in lines), "that bar is met"


def test_the_campaign_has_a_table_of_its_own_and_what_it_lacks_is_said(tmp_path: Path) -> None:
    kinds = qualified()
    assert list(kinds) == list(scenarios(STUDY))[:13]
    rows = [
        plain(
            case="tennessee_eastman",
            scenario=name,
            seed=seed,
            proposer=who,
            exposure_s=0.0,
            acted=kind is not Kind.NOTHING,
        )
        for name, kind in kinds.items()
        for seed in (1, 2, 3)
        for who in ("search", "do-nothing", "hindsight")
    ]
    assert list(campaign.missing(rows, kinds)) == []
    assert "39 of 39 kept, 24 acted, 9 of 9 at the grade" in campaign.told(rows, kinds)
    rows[0] = replace(rows[0], exposure_s=60.0, acted=True)
    found = "; ".join(campaign.missing(rows, kinds))
    assert "39 of 39 episodes inside the trip limits by search: 38 of 39 that are in" in found
    assert "there was one in 1 episodes (IDV 2 seed 1)" in found
    write_dataset(tmp_path / "results.parquet", [*rows, plain(scenario="design, IDV 1")])
    assert len(campaign.rows_of(tmp_path, kinds)) == len(rows) and campaign.rows_of(None, kinds) == []


def test_who_never_brings_the_grade_back_does_not_meet_the_bar_of_quality() -> None:
    kinds = qualified()
    rows = [plain(scenario=name, seed=seed, missed="ACC-PR+ACC-G") for name in kinds for seed in (1, 2, 3)]
    assert "9 of 9 episodes of quality at their grade in the end: 0 of 9 that are in" in list(
        campaign.missing(rows, kinds)
    )
    assert "3 of 3 kept, 3 acted, 0 of 3 at the grade" in campaign.told(rows, kinds)


@pytest.mark.slow
def test_a_healthy_plant_that_its_twin_is_not_is_explained_at_rest_and_after_a_move() -> None:
    every = list(looks(load_plant("tennessee_eastman"), 31))
    assert [moved for moved, _ in every] == [False] * 2 + [True] * 6
    assert all(explained(fits.values()) for _, fits in every)
