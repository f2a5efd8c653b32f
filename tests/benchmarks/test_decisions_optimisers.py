"""The study of optimisers: what each finds where the answer is known, and what the page says of a decision."""

from __future__ import annotations

import builtins
from typing import Any

import numpy as np
import pytest

from benchmarks.decisions import bayes
from benchmarks.decisions.decided import Decision, Problem, Values
from benchmarks.decisions.optimisers import FAULTS, INSTALL, Tuned, evolved, taken, tuned
from benchmarks.decisions.page_models import side_by_side
from homeostat.domain.recovery import RecoveryPath
from homeostat.plants.plant import load_plant
from tests.agents.stuck_valve import NOW_S, now, stuck
from tests.twin.followed import follow, reactor


class Bowl:
    """A bowl in the unit cube that counts how often it is asked."""

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self, points: Values) -> Values:
        self.asked += len(points)
        return np.asarray(((points - 0.7) ** 2).sum(axis=1))


@pytest.mark.parametrize("dimensions", [1, 3])
def test_the_bayesian_optimiser_finds_the_bottom_of_a_bowl_within_its_budget(dimensions: int) -> None:
    bowl = Bowl()
    assert bayes.minimise(bowl, np.full(dimensions, 0.2), 30, seed=1) < 0.01
    assert bowl.asked == 30


@pytest.mark.parametrize("dimensions", [1, 3])
def test_so_does_cma_es(dimensions: int) -> None:
    pytest.importorskip("cmaes")
    bowl = Bowl()
    assert evolved(bowl, np.full(dimensions, 0.2), 90, seed=1) < 0.01
    assert bowl.asked == 90


def test_a_missing_library_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name == "cmaes":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(SystemExit, match="pip install cmaes"):
        evolved(Bowl(), np.zeros(2), 10, seed=1)
    assert "\n" not in INSTALL


def stuck_valve() -> Decision:
    d = reactor().description
    path = RecoveryPath(d.machine, (next(t for t in d.machine.transitions if t.name == "t_reduce"),))
    return Decision(reactor(), follow(stuck()[:NOW_S]).frozen(), now(), path)


def test_the_problem_is_the_search_s_own_and_its_answer_is_no_worse_than_the_design() -> None:
    problem = Problem(stuck_valve())
    least, rollouts = problem.searched()
    design = float(problem(problem.design[None])[0])
    assert least < 1.0 < rollouts and least < design
    assert problem.evaluations == 1 and problem.members > 1


def test_every_optimiser_takes_a_decision() -> None:
    pytest.importorskip("cmaes")
    one = tuned("cool_stuck_closed", 1, stuck_valve())
    assert set(one.reached) == set(one.took_s) == {"search", "CMA-ES", "Bayesian"}
    assert one.dimensions == 3 and one.rollouts > 10 * one.members and max(one.reached.values()) < 1.0


def test_three_faults_of_each_plant_are_taken() -> None:
    for name, faults in FAULTS.items():
        found = taken(load_plant(name), 401)
        assert [(cause.fault, seed) for cause, seed in found] == [(fault, 401) for fault in faults]
        assert len(faults) == 3 and all(cause.severity > 0.0 for cause, _ in found)


def test_a_decision_stands_in_one_line() -> None:
    one = Tuned("fouling", 401, "reduced_load", 4, 6, 900, {"search": 0.31, "CMA-ES": 0.3, "Bayesian": 12.0},
                {"search": 1.0, "CMA-ES": 2.0, "Bayesian": 3.0})  # fmt: skip
    text = side_by_side({"Reactor": [one]})
    assert "| Reactor | fouling | 4 | 900 | 150 | 0.3100 | 0.3000 | 12.0000 | 1.00 | 2.00 | 3.00 |" in text
