"""Runs: what they print, what they keep, how they exit."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from homeostat.journal import read_events
from homeostat.journal.beside.manifest import read_manifest
from homeostat.journal.verify.verify import verify
from homeostat.plants.plant import load_plant
from tests.cli.command import Done, homeostat
from tests.equipment.journals import read_parquet, timeless

KEYS = (
    "schema", "case", "fault", "disturbances", "mismatch", "seed", "outcome", "actor", "onset_s",
    "detected_s", "released_s", "attempts",
    "hypotheses", "actions", "min_margin", "limit_exposure_s", "production_loss", "cost", "cost_alone",
    "foreseen", "state", "complete_s", "nominal_s", "totals", "steps", "probes", "thinking_s", "wall_s", "trace",
)  # fmt: skip


def strict(text: str) -> dict[str, Any]:
    """The one JSON object that is the whole of ``text``; no NaN, no infinity."""

    def refuse(name: str) -> None:
        raise ValueError(f"{name} is not JSON")

    content = json.loads(text, parse_constant=refuse)
    assert isinstance(content, dict)
    return content


def is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def test_a_recovery_as_json(recovered_json: Done) -> None:
    assert (recovered_json.status, recovered_json.err) == (0, "")
    result = strict(recovered_json.out)
    assert tuple(result) == KEYS
    assert (result["case"], result["fault"], result["seed"]) == ("cstr", "cool_stuck_closed", 1)
    assert (result["outcome"], result["actor"], result["trace"]) == ("recovered", "search", "run")
    assert result["state"] in ("compensated", "reduced_load", "holding")
    assert (result["complete_s"], result["nominal_s"], result["totals"]) == (None, None, {}), "the reactor has no batch"
    assert result["steps"] is None, "nobody asked for single steps"
    assert 900.0 == result["onset_s"] <= result["detected_s"] <= result["released_s"] <= 960.0
    assert isinstance(result["attempts"], int) and result["attempts"] >= 1
    for name in ("min_margin", "production_loss", "thinking_s", "wall_s"):
        assert is_number(result[name])
    assert result["min_margin"] >= 0.0 and 0.0 < result["thinking_s"] < result["wall_s"]
    cost = result["cost"]
    assert cost["currency"] == "EUR" and cost["total"] == pytest.approx(sum(cost["items"].values()))
    assert cost["worth"] == pytest.approx(150.0 / 30.0, rel=0.05)  # 150 s of a thirtieth of a litre at 1 EUR
    assert cost["items"]["production"] == pytest.approx(result["production_loss"] * cost["worth"])
    assert cost["items"]["release"] == pytest.approx(0.3), "one release"


def test_a_run_names_the_configuration_that_it_was_made_with(record: Path) -> None:
    first = next(iter(read_events(record)))
    stated = {setting["name"]: setting["value"] for setting in first.fields["configuration"]}
    manifest = read_manifest(record)
    assert manifest is not None
    assert stated["configuration"] == manifest.configuration == load_plant("cstr").configuration


def test_probabilities_and_actions_as_json(recovered_json: Done) -> None:
    result = strict(recovered_json.out)
    items = result["hypotheses"]
    assert all(tuple(b) == ("fault", "probability", "severity", "between", "period_s") for b in items)
    assert all(b["period_s"] is None for b in items), "a valve that is stuck does not swing"
    assert len({b["fault"] for b in items}) == len(items)
    assert [b["probability"] for b in items] == sorted((b["probability"] for b in items), reverse=True)
    assert 0.9 < sum(b["probability"] for b in items) <= 1.0 + 1e-9
    assert items[0]["fault"] == "cool_stuck_closed" and items[0]["severity"] == pytest.approx(0.7, abs=0.05)
    assert all(tuple(a) == ("tag", "value", "rate") for a in result["actions"])
    plant = load_plant("cstr").description
    for action in result["actions"]:
        tag = plant.tag(action["tag"])
        assert action["value"] is None or tag.range.contains(action["value"])
        assert action["rate"] is None or is_number(action["rate"])
    assert result["limit_exposure_s"].keys() == {"LIM-T-HIGH", "LIM-T-LOW", "LIM-L-HIGH", "LIM-L-LOW"}
    assert all(e == {"from_detection": 0.0, "total": 0.0} for e in result["limit_exposure_s"].values())


@pytest.mark.slow
def test_a_run_in_which_the_fallback_acted_as_json(handed_over: Done) -> None:
    result = strict(handed_over.out)
    assert (handed_over.status, handed_over.err) == (3, "")
    assert (result["outcome"], result["actor"], result["released_s"]) == ("fallback", "fallback", None)
    assert result["min_margin"] is None and is_number(result["detected_s"]) and result["actions"]
    assert result["trace"] == "runs/cstr-none-2"
    assert verify(handed_over.cwd / "runs" / "cstr-none-2").complete


def test_a_fault_that_violates_nothing_and_is_not_noticed(tmp_path: Path) -> None:
    arguments = ("run", "cstr", "--fault", "leak", "--onset", "699.9", "--end", "700", "--json", "--out", "a/b")
    done = homeostat(*arguments, cwd=tmp_path)
    result = strict(done.out)
    assert (done.status, result["outcome"], result["actor"]) == (0, "no_action", "none")
    assert result["detected_s"] is None and result["hypotheses"] == [] and result["actions"] == []
    assert result["production_loss"] is None  # nothing would have been made in a tenth of a second
    assert all(e == {"from_detection": None, "total": 0.0} for e in result["limit_exposure_s"].values())
    assert verify(tmp_path / "a" / "b").complete


def test_runs_without_fault_get_directories_of_their_own(tmp_path: Path) -> None:
    plain = homeostat("run", "cstr", "--end", "700", cwd=tmp_path)
    assert plain.status == 0 and "No action" in plain.out and plain.err == ""
    again = homeostat("run", "cstr", "--end", "700", "--json", cwd=tmp_path)
    result = strict(again.out)
    assert again.status == 0 and result["trace"] == "runs/cstr-none-1-2"
    assert (result["outcome"], result["fault"], result["onset_s"]) == ("no_action", "none", None)
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == ["cstr-none-1", "cstr-none-1-2"]


@pytest.mark.slow
def test_several_faults(tmp_path: Path) -> None:
    arguments = ("run", "cstr", "--fault", "inlet_stuck_open+leak", "--onset", "900", "--end", "1000", "--json")
    done = homeostat(*arguments, cwd=tmp_path)
    result = strict(done.out)
    assert done.status in (0, 3) and result["fault"] == "inlet_stuck_open+leak"
    for item in result["hypotheses"]:
        several = "+" in item["fault"]
        assert isinstance(item["severity"], dict) == several
        assert not several or item["severity"].keys() == set(item["fault"].split("+"))


def test_the_lines_of_a_run(recovered: Done) -> None:
    assert (recovered.status, recovered.err) == (0, "")
    assert "\x1b" not in recovered.out and "\r" not in recovered.out
    lines, summary = recovered.out.split("\n\n")
    labels = [line.split()[2] for line in lines.splitlines()]
    assert labels[:5] == ["run", "state", "onset", "asked", "detected"] and labels[-1] == "end"
    assert labels.index("detected") < labels.index("proposed") < labels.index("released")
    assert "900 s  onset     Cooling valve stuck towards closed: cool_stuck_closed 0.7 (ground truth)" in lines
    assert "worst margin +" in lines and "L/s" in lines
    assert summary.startswith("Recovered") and "run/figure.png" in summary
    assert [line.split()[0] for line in summary.splitlines()[1:]] == [
        "Fault", "Detected", "Done", "Limits", "Production", "Cost", "Left", "Thinking", "Trace", "Figure",
    ]  # fmt: skip


def test_what_a_run_keeps(record: Path) -> None:
    names = {path.relative_to(record).as_posix() for path in record.rglob("*") if path.is_file()}
    assert names >= {"events.jsonl", "manifest.json", "trajectory.parquet", "figure.png", "result.json"}
    assert verify(record).complete
    assert tuple(strict((record / "result.json").read_text())) == KEYS
    png = (record / "figure.png").read_bytes()
    width, height = (int.from_bytes(png[at : at + 4]) for at in (16, 20))
    assert png.startswith(b"\x89PNG") and width > 900 and height > 700
    for event in read_events(record):
        if event.kind == "retrieved":
            assert f"queries/{event.fields['query_sha256']}.rq" in names
            if event.fields["answer_sha256"]:
                assert f"subgraphs/{event.fields['answer_sha256']}.ttl" in names


def test_the_trajectory_of_a_run(record: Path) -> None:
    stored = read_parquet(record / "trajectory.parquet")
    tags = load_plant("cstr").description.tags
    assert set(stored.columns) == {f"{what} {tag.name}" for what in ("measured", "true") for tag in tags}
    assert all(stored.units[f"true {tag.name}"] == stored.units[f"measured {tag.name}"] == tag.unit for tag in tags)
    assert stored.times_s.tolist() == [float(t) for t in range(1, 1051)]
    settled = slice(700, 890)
    noise = stored.columns["measured T1"][settled] - stored.columns["true T1"][settled]
    assert 0.1 < np.std(noise) < 2.0 and abs(np.mean(noise)) < 0.5


def test_equal_seeds_give_equal_journals(recovered: Done, recovered_json: Done) -> None:
    first, second = ([timeless(r) for r in read_events(done.cwd / "run")] for done in (recovered, recovered_json))
    assert first == second and len(first) > 10
    paths = [done.cwd / "run" / "trajectory.parquet" for done in (recovered, recovered_json)]
    assert paths[0].read_bytes() == paths[1].read_bytes()
