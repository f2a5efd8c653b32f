"""The measurement of adopted causes: what its causes are, and what its table counts."""

from __future__ import annotations

from typing import Any

import pytest

from benchmarks.plants.adopted import FAULTS_OF, causes, table, truths
from benchmarks.unknown.causes import PLANTS
from homeostat.plants.plant import load_plant


def row(truth: str, seed: int, before: dict[str, float], after: dict[str, float]) -> dict[str, Any]:
    said = [[{"name": n, "probability": p} for n, p in each.items()] for each in (before, after)]
    return {"truth": truth, "seed": seed, "before": said[0], "after": said[1]}


@pytest.mark.parametrize("name", PLANTS)
def test_every_plant_has_three_causes_that_its_true_plant_can_have(name: str) -> None:
    plant, mine = load_plant(name), causes(name)
    assert len(mine) == 3 and all(each.low <= each.first <= each.high for each in mine)
    found = list(truths(plant, [401, 402], "plant"))
    assert len(found) == 2 * 3 + min(2, FAULTS_OF[name]) * len(plant.description.faults)
    for truth, seed, scenario in found:
        assert scenario.seed == seed and bool(scenario.disturbances) is (truth in {each.name for each in mine})
    sizes = {each.drawn(seed) for each in mine for seed in (401, 402)}
    assert len(sizes) == 6 and all(any(each.low <= size <= each.high for each in mine) for size in sizes)


def test_the_table_counts_what_was_said() -> None:
    rows = [
        row("larger_impeller", 1, {"unknown_P1_K_P1": 1.0}, {"larger_impeller": 1.0}),
        row("larger_impeller", 2, {"leak": 1.0}, {"leak": 0.95, "larger_impeller": 0.05}),
        row("larger_impeller", 3, {}, {}),
        row("leak", 1, {"leak": 1.0}, {"leak": 0.7, "lagging_lost": 0.3}),
        row("fouling", 1, {"fouling": 0.6, "none": 0.4}, {"lagging_lost": 0.6, "fouling": 0.4}),
    ]
    lines = list(table("cstr", rows))
    assert "| larger_impeller | 2 of 3 | 1 | 1 | 1 | 1 |" in lines
    told = next(line for line in lines if "Faults of the tables" in line)
    assert "2 runs, 1 with the same best" in told and "moved by 0.300" in told and "1 with an adopted name" in told
    assert lines[-1] == "- fouling 1: 60 % fouling, 40 % none -> 60 % lagging_lost, 40 % fouling"
