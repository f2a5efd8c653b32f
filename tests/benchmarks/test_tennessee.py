"""The study of Tennessee Eastman has the scenarios that qualified, as the list of candidates has them."""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path

import pytest

from benchmarks.tennessee.alone import upsets
from benchmarks.tennessee.qualify import CANDIDATES, QUALIFIED, WANTED, Kind
from homeostat.evaluate.scenario import Scenario
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.plan import read_plan
from homeostat.plants.plant import load_plant

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
