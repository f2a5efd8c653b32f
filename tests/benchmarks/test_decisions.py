"""The study of decisions: a ledger that goes on where it stopped, and sections that say how many runs are in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from benchmarks.decisions import ledger as ledgers
from benchmarks.decisions import risk
from benchmarks.decisions.__main__ import Study
from benchmarks.decisions.ledger import Ledger
from benchmarks.decisions.measure import Decision
from benchmarks.decisions.page import way_back
from benchmarks.decisions.page_risk import ASKED, risks, speeds, worst_runs
from benchmarks.decisions.repair import Repair
from benchmarks.decisions.risk import Released, measure_nominal
from benchmarks.decisions.speed import Thought
from benchmarks.decisions.worst import BEFORE, causes
from benchmarks.unknown.causes import KNOWN, Cause
from homeostat.domain.advice import Attempt
from homeostat.domain.diagnosis import Hypothesis
from homeostat.domain.events.recovery import Attempted, ReleasedActions
from homeostat.evaluate.scenario import scenario_of
from homeostat.plants.plant import Plant, load_plant
from homeostat.twin.forecast import Ensemble
from homeostat.twin.twin import Twin


def test_a_ledger_measures_what_is_lacking_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ledgers, "FOLDER", tmp_path)
    measured: list[tuple[str, int]] = []

    def measure(plant: Plant, cause: Cause, seed: int, mismatch: str) -> Released:
        measured.append((cause.fault, seed))
        return Released(cause.fault, seed, "recovered", 10.0, 0.0)

    ledger = Ledger("risk", load_plant("cstr"), "none", Released, measure)
    wanted = [(Cause("leak", KNOWN, fault="leak"), seed) for seed in (1, 2)]
    ledger.fill(wanted[:1])
    ledger.fill(wanted)
    assert measured == [("leak", 1), ("leak", 2)]
    assert [row.seed for row in ledger.kept()] == [1, 2]


def test_the_nominal_validator_has_one_rollout_and_no_certificate(monkeypatch: pytest.MonkeyPatch) -> None:
    """What it is compared with draws hundreds before a release; one that did as well would measure nothing."""
    drawn, judged, released = [0], set[int](), list[ReleasedActions]()
    sampled, of = Twin.sampled, ReleasedActions.of

    def counting(self: Twin, hypotheses: Sequence[Hypothesis], count: int, name: str) -> Ensemble:
        drawn[0] += count
        return sampled(self, hypotheses, count, name)

    def noting(*told: Any) -> ReleasedActions:
        released.append(of(*told))
        return released[-1]

    def attempted(proposer: str, attempt: Attempt, was: Callable[..., Attempted] = Attempted.of) -> Attempted:
        judged.add(attempt.members)
        return was(proposer, attempt)

    monkeypatch.setattr(Twin, "sampled", counting)
    monkeypatch.setattr(ReleasedActions, "of", noting)
    monkeypatch.setattr(Attempted, "of", attempted)
    short, plant = scenario_of, load_plant("cstr")
    monkeypatch.setattr(risk, "scenario_of", lambda plant, faults, seed: short(plant, faults, seed, 960.0))
    cause = Cause("stuck", KNOWN, fault="cool_stuck_closed", severity=0.7, onset_s=900.0)
    assert measure_nominal(plant, cause, 1, "twice").released_s is not None
    assert drawn == [0] and judged <= {0, 1} and released[0].certificate is None


def test_only_released_runs_count_as_risk() -> None:
    runs = [Released("leak", 1, "recovered", 10.0, 0.0), Released("leak", 2, "limit_violated", 10.0, 3.0),
            Released("leak", 3, "fallback", None, 0.0)]  # fmt: skip
    text = risks({("Reactor", "twice", "ensemble"): runs})
    assert f"| Reactor | 2x | ensemble | 3 | 2 of {ASKED} | 1 | 1.3 to 98.7 % |" in text


def test_times_of_a_proposer_that_was_never_asked_are_not_invented() -> None:
    text = speeds({"Reactor": [Thought("leak", 1, 0.5, {"search": 0.2}), Thought("leak", 2, 0.7, {})]}, 1.234)
    assert "1.23 s" in text and "| Reactor | each proposal, search | 1 | 0.200 |" in text
    assert "| Reactor | decision | 2 | 0.600 |" in text


def test_the_worst_runs_stand_beside_what_they_lost_before() -> None:
    first = BEFORE[0]
    now = Decision(
        first.fault, first.severity, first.onset_s, first.seed, "recovered", 950.0, 1, 30.0, 28.0, None, 0.0, {}
    )
    text = worst_runs([now])
    assert f"1 of {len(BEFORE)} runs are in" in text and "| 73.7 | 35.1 | 30.0 | 28.0 | recovered |" in text
    assert [(cause.faults[0].fault, seed) for cause, seed in causes()] == [(b.fault, b.seed) for b in BEFORE]


def test_a_study_of_both_plants_can_be_begun() -> None:
    Study("plant", [401], ["leak", "pump_failure"]).fill(())


def test_only_runs_that_were_away_have_a_way_back() -> None:
    away = Repair("leak", 0.5, 900.0, 1, "recovered", False, False, 20.0, 300.0, {"T1": 0.4, "L1": 0.1}, 0.0)
    late = replace(away, seed=2, back_s=2000.0)
    lost = replace(away, seed=3, back_s=None, off={}, outside_s=2.0)
    stopped = replace(lost, seed=4, stopped=True)
    stayed = replace(lost, seed=5, stayed=True, outside_s=0.0)
    text = way_back([away, late, lost, stopped, stayed], 9)
    assert "5 of 9 runs are in" in text
    assert "| leak | 5 | 1 | 1 | 1 of 3 | 20.0 s | 300.0 s | 0.40 | 0.10 | 1 of 1 | 1 |" in text
