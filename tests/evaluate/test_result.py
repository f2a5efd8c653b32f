"""The result of a run as JSON: strict, complete, and read back as it was written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.diagnosis import FaultProbability, FaultState
from homeostat.domain.outcome import Outcome
from homeostat.domain.recovery import Command
from homeostat.journal.beside.files import RESULT
from homeostat.record.probes import ProbeMade
from homeostat.record.result import SCHEMA, Exposure, Result, ResultError, StepScores, read_result

BOTH = (FaultState("leak", 0.005, 0.0), FaultState("fouling", 0.7, 0.0))
RESULT_OF_TWO = Result(
    case="cstr",
    fault="leak+fouling",
    seed=3,
    outcome=Outcome.RECOVERED,
    actor="search",
    onset_s=2000.0,
    detected_s=2004.5,
    released_s=2006.0,
    attempts=2,
    hypotheses=(FaultProbability(BOTH, 0.75), FaultProbability(BOTH[:1], 0.2), FaultProbability((), 0.05)),
    actions=(Command("F1.sp", 0.025, 0.005), Command("V2.man", None, None)),
    min_margin=0.02,
    limit_exposure_s=(Exposure("LIM-T-HIGH", 3.0, 4.0),),
    production_loss=-0.01,
    state="reduced_load",
    complete_s=None,
    nominal_s=2100.0,
    totals={"spilled_L": 0.25},
    steps=StepScores(8, 7, 8, 6, on_right=12, on_wrong=2, on_missed=1),
    thinking_s=1.5,
    wall_s=8.25,
    trace="runs/one",
    probes=(
        ProbeMade(2005.0, 300.0, "", ("leak", "fouling"), 4.0, 0.3, 0.001, "leak", 0.99, True),
        ProbeMade(2500.0, 300.0, "reduced_load", ("leak", "none"), 2.0, 0.2, 0.01),
    ),
    cost=Cost((CostItem("production", -0.25), CostItem("release", 0.3), CostItem("ACC-T", 1.7)), 31.5),
    currency="EUR",
)


def test_severity_is_a_number_an_object_or_null() -> None:
    items = json.loads(RESULT_OF_TWO.to_json())["hypotheses"]
    assert [b["fault"] for b in items] == ["leak+fouling", "leak", "none"]
    assert [b["severity"] for b in items] == [{"leak": 0.005, "fouling": 0.7}, 0.005, None]


@pytest.mark.parametrize("detected_s", [2004.5, None])
def test_read_back_as_written(tmp_path: Path, detected_s: float | None) -> None:
    seconds = 3.0 if detected_s is not None else 0.0
    result = replace(RESULT_OF_TWO, detected_s=detected_s, limit_exposure_s=(Exposure("LIM-T-HIGH", seconds, 4.0),))
    (tmp_path / RESULT).write_text(result.to_json())
    again = read_result(tmp_path)
    assert again is not None and again.to_json() == result.to_json()
    assert again.probes == result.probes
    assert (again.cost, again.currency) == (result.cost, "EUR")
    assert (again.actions, again.outcome, again.limit_exposure_s, again.steps) == (
        result.actions, result.outcome, result.limit_exposure_s, result.steps,
    )  # fmt: skip
    exposure = json.loads(result.to_json())["limit_exposure_s"]["LIM-T-HIGH"]
    assert exposure == {"from_detection": seconds if detected_s is not None else None, "total": 4.0}


@pytest.mark.parametrize("name", ["production_loss", "min_margin", "wall_s"])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_is_no_json_is_never_written(name: str, value: float) -> None:
    with pytest.raises(ValueError, match="Out of range float"):
        replace(RESULT_OF_TWO, **{name: value}).to_json()


def test_what_it_cost_is_told_with_its_sum_and_every_item() -> None:
    assert json.loads(RESULT_OF_TWO.to_json())["cost"] == {
        "currency": "EUR",
        "total": pytest.approx(1.75),
        "worth": 31.5,
        "items": {"production": -0.25, "release": 0.3, "ACC-T": 1.7},
    }


@pytest.mark.parametrize("older", [True, False])
def test_a_result_that_knows_no_cost_is_read(tmp_path: Path, older: bool) -> None:
    """Older than prices, or of a run of which it is not known."""
    content = json.loads(replace(RESULT_OF_TWO, cost=None).to_json())
    assert content["cost"] is None
    if older:
        del content["cost"]
    (tmp_path / RESULT).write_text(json.dumps(content))
    again = read_result(tmp_path)
    assert again is not None and (again.cost, again.currency) == (None, "")


@pytest.mark.parametrize("cost", [[], 3.0, {}, {"currency": "EUR", "worth": "much", "items": {}}])
def test_a_cost_that_is_none_is_refused(tmp_path: Path, cost: object) -> None:
    content = json.loads(RESULT_OF_TWO.to_json()) | {"cost": cost}
    (tmp_path / RESULT).write_text(json.dumps(content))
    with pytest.raises(ResultError, match=r"result\.json"):
        read_result(tmp_path)


def test_a_run_without_result(tmp_path: Path) -> None:
    assert read_result(tmp_path) is None


def test_the_schema_has_a_number() -> None:
    content = json.loads(RESULT_OF_TWO.to_json())
    assert next(iter(content)) == "schema" and content["schema"] == SCHEMA


@pytest.mark.parametrize(("actor", "kind"), [("fallback", Outcome.FALLBACK), ("search", Outcome.LIMIT_VIOLATED)])
def test_a_result_of_an_older_version_is_read(tmp_path: Path, actor: str, kind: Outcome) -> None:
    content = json.loads(replace(RESULT_OF_TWO, actor=actor).to_json())
    del content["schema"]
    (tmp_path / RESULT).write_text(json.dumps({**content, "outcome": "handed_over"}))
    again = read_result(tmp_path)
    assert again is not None and again == replace(again, outcome=kind, actor=actor) and not again.good


def test_a_result_of_a_newer_version_is_refused(tmp_path: Path) -> None:
    (tmp_path / RESULT).write_text(RESULT_OF_TWO.to_json().replace(f'"schema": {SCHEMA}', '"schema": 99'))
    with pytest.raises(ResultError, match="schema 99"):
        read_result(tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", "{}", "null", "[" * 100_000, RESULT_OF_TWO.to_json().replace("recovered", "won"),
        RESULT_OF_TWO.to_json().replace('"between": null', '"between": []'),
        RESULT_OF_TWO.to_json().replace('"wall_s": 8.25', '"wall_s": NaN'),
        RESULT_OF_TWO.to_json().replace('"wall_s": 8.25', '"wall_s": 1e999'),
        RESULT_OF_TWO.to_json().replace('"worth": 31.5', f'"worth": 1{"0" * 400}'),
    ],
    ids=range(10),
)  # fmt: skip
def test_what_is_no_result_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / RESULT).write_text(text)
    with pytest.raises(ResultError, match=r"result\.json"):
        read_result(tmp_path)
