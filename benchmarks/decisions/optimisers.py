"""Optimisers on the same decisions: the search's own, CMA-ES and a Bayesian one, for equal numbers of rollouts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final, TypeVar

import numpy as np

from benchmarks.decisions import bayes
from benchmarks.decisions.decided import Decision, Problem, Values, first_decision
from benchmarks.unknown.causes import KNOWN, Cause
from homeostat.evaluate.scenario import Fault, departing, scenario_of
from homeostat.plants.plant import Plant

FAULTS: Final = {
    "cstr": ("pump_degrade", "cool_stuck_closed", "outlet_block"),
    "mixing_module": ("clogging_main", "pump_degradation", "leakage_main"),
}
"""Plant -> faults whose first decision is taken; each of nominal size, so that something has to be done about it."""
ONSETS_S: Final = {"cstr": 1450.0, "mixing_module": 60.0}
"""Plant -> when they begin [s]."""
FOLLOWED_S: Final = 300.0
"""How long after that a decision is waited for [s]."""
T = TypeVar("T")
OWN, EVOLUTION, BAYES = "search", "CMA-ES", "Bayesian"
INSTALL: Final = "CMA-ES needs cmaes, which is in no requirements of this project: pip install cmaes"
START: Final = 0.3
"""Standard deviation that CMA-ES begins with, in ranges [1]."""


@dataclass(frozen=True, slots=True)
class Tuned:
    """One decision, chosen by each optimiser."""

    fault: str
    seed: int
    target: str
    """State that the numbers are for; empty where the run has no such decision."""
    dimensions: int
    members: int
    """Rollouts of one evaluation."""
    rollouts: int
    """Rollouts that the search took, and each other one was given, in whole evaluations."""
    reached: dict[str, float]
    """Optimiser -> objective [share of the design production; ten more for each scale of missing margin]."""
    took_s: dict[str, float]
    """Optimiser -> processor time, rollouts included [s]."""


def measure_tuned(plant: Plant, cause: Cause, seed: int, mismatch: str) -> Tuned:
    """Let each optimiser take the first decision of a run with a fault of the tables."""
    (state,) = cause.faults
    end_s = state.onset_s + FOLLOWED_S
    told = scenario_of(plant, [Fault(state.fault, state.severity, state.onset_s)], seed, end_s)
    decided = first_decision(plant, departing(plant, told, (), mismatch))
    if decided is None:
        return Tuned(state.fault, seed, "", 0, 0, 0, {}, {})
    return tuned(state.fault, seed, decided)


def tuned(fault: str, seed: int, decided: Decision) -> Tuned:
    """What each optimiser makes of a decision in a run with ``fault``."""
    problem = Problem(decided)
    (least, rollouts), own_s = _timed(problem.searched)
    budget = max(rollouts // problem.members, 1)
    reached, took_s = {OWN: least}, {OWN: own_s}
    for name, minimise in ((EVOLUTION, evolved), (BAYES, bayes.minimise)):
        reached[name], took_s[name] = _timed(partial(minimise, problem, problem.design, budget, seed))
    return Tuned(fault, seed, decided.path.target, len(problem.design), problem.members, rollouts, reached, took_s)


def evolved(objective: Callable[[Values], Values], start: Values, budget: int, seed: int) -> float:
    """The least value that CMA-ES finds in the unit cube with ``budget`` evaluations, of which the first is ``start``.

    It begins around that, and anew anywhere where it ends.
    """
    try:
        from cmaes import CMA  # type: ignore[import-not-found,unused-ignore]  # in no requirements
    except ImportError as error:
        raise SystemExit(INSTALL) from error
    rng, least, left = np.random.default_rng(seed), float(objective(start[None])[0]), budget - 1
    wide = max(len(start), 2)  # it wants two dimensions; where there is one, the other is of no effect
    mean = np.append(start, np.full(wide - len(start), 0.5))
    while left > 0:
        own = CMA(mean, START, bounds=np.tile([0.0, 1.0], (wide, 1)), seed=int(rng.integers(2**31)))
        mean = rng.random(wide)
        while left > 0 and not own.should_stop():
            asked = [own.ask() for _ in range(own.population_size)]
            values = objective(np.array(asked)[:left, : len(start)])
            least, left = min(least, float(values.min())), left - len(values)
            if len(values) == len(asked):
                own.tell(list(zip(asked, values.tolist(), strict=True)))
    return least


def _timed(work: Callable[[], T]) -> tuple[T, float]:
    began = time.process_time()
    return work(), time.process_time() - began


def taken(plant: Plant, seed: int) -> list[tuple[Cause, int]]:
    """The faults of ``plant`` whose first decision is taken, with a ``seed``."""
    nominal, at_s = {f.name: f.severity_nominal for f in plant.description.faults}, ONSETS_S[plant.name]
    return [
        (Cause(name, KNOWN, known=True, fault=name, severity=nominal[name], onset_s=at_s), seed)
        for name in FAULTS[plant.name]
    ]
