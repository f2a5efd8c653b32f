"""Isolation: the fault that was put into the plant comes back by name, size and time."""

from __future__ import annotations

import functools

import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis, with_a_twin
from tests.twin.followed import follow, reactor, readings

ONSET_S = 1450.0
EVERY = tuple(fault.name for fault in reactor().description.faults)
CONFUSED = {"outlet_block": "pump_degrade", "pump_degrade": "outlet_block"}
"""Both take the same part of the pump's flow away: readings cannot tell them apart."""
LEAST = {"fouling": 0.7}
"""What creeps may as well be a loss of heat that grows, or a thermometer that drifts: those are rarer."""
LATER_S = {"fouling": 400.0}
"""Seconds from the onset to the explanation; fouling creeps."""


def size_of(name: str) -> float:
    return reactor().description.fault(name).severity_nominal


@functools.cache
def explained(name: str, seed: int, lag_s: float, severity: float | None = None) -> tuple[Hypothesis, ...]:
    faults = (FaultState(name, size_of(name) if severity is None else severity, ONSET_S),) if name != "none" else ()
    return follow(readings(seed, int(ONSET_S + lag_s), faults), seed).explain(EVERY, ())


def probability(found: tuple[Hypothesis, ...], *names: str) -> float:
    """Among what a twin can carry: a share for something else is in every answer."""
    return sum(h.probability for h in with_a_twin(found) if h.name in names)


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.wide)])
@pytest.mark.parametrize("name", EVERY)
def test_each_fault_is_found_with_its_size_and_onset(name: str, seed: int) -> None:
    lag_s = LATER_S.get(name, 15.0)
    found = explained(name, seed, lag_s)
    alike = (name, CONFUSED.get(name, name))
    assert probability(found, *alike) >= LEAST.get(name, 0.9)
    fault = reactor().description.fault(name)
    best = max((h for h in found if h.name in alike), key=lambda h: h.probability).faults[0]
    assert abs(best.severity - size_of(name)) <= 0.1 * fault.severity_range.span
    assert abs(best.onset_s - ONSET_S) <= (120.0 if name == "fouling" else 4.0)


OTHER_SIZES = [
    ("cool_stuck_closed", 0.97),
    ("inlet_stuck_open", 0.75),
    ("pump_degrade", 0.25),
    ("temp_bias", 2.5),
    ("level_bias", 0.4),
    ("leak", 0.012),
]


@pytest.mark.parametrize(
    ("name", "severity"),
    [*OTHER_SIZES[::3], *(pytest.param(*each, marks=pytest.mark.wide) for k, each in enumerate(OTHER_SIZES) if k % 3)],
)
def test_other_sizes_are_found_as_well(name: str, severity: float) -> None:
    found = explained(name, 5, 15.0, severity)
    alike = (name, CONFUSED.get(name, name))
    assert probability(found, *alike) >= 0.9
    best = max((h for h in found if h.name in alike), key=lambda h: h.probability).faults[0]
    assert abs(best.severity - severity) <= 0.1 * reactor().description.fault(name).severity_range.span


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_healthy_window_needs_no_fault(seed: int) -> None:
    found = explained("none", seed, 250.0)
    assert found[0].name == "none" and found[0].probability >= 0.8


@pytest.mark.parametrize(("name", "lag_s"), [("cool_stuck_closed", 130.0), ("temp_bias", 300.0)])
def test_a_fault_is_found_minutes_later(name: str, lag_s: float) -> None:
    assert probability(explained(name, 3, lag_s), name) >= 0.9


@pytest.mark.parametrize(("name", "lag_s"), [("leak", 45.0), ("level_bias", 130.0)])
def test_a_level_fault_is_found_minutes_later(name: str, lag_s: float) -> None:
    assert probability(explained(name, 3, lag_s), name) >= 0.5


@functools.cache
def pair() -> tuple[Hypothesis, ...]:
    faults = (FaultState("cool_stuck_closed", 0.7, ONSET_S), FaultState("pump_degrade", 0.5, ONSET_S + 30.0))
    return follow(readings(6, int(ONSET_S + 50.0), faults), 6).explain(EVERY, ())


def test_two_faults_at_once_are_found() -> None:
    assert sum(h.probability for h in pair() if {f.fault for f in h.faults} in PAIRS) >= 0.9
    best = max((h for h in pair() if {f.fault for f in h.faults} in PAIRS), key=lambda h: h.probability)
    by_name = {f.fault: f for f in best.faults}
    assert by_name["cool_stuck_closed"].severity == pytest.approx(0.7, abs=0.1)
    other = next(f for f in best.faults if f.fault != "cool_stuck_closed")
    assert other.severity == pytest.approx(0.5, abs=0.1)


PAIRS = ({"cool_stuck_closed", "pump_degrade"}, {"cool_stuck_closed", "outlet_block"})


@pytest.mark.parametrize("name", ["fouling", "temp_bias", "outlet_block", "two"])
def test_hypotheses_are_a_distribution(name: str) -> None:
    hypotheses = pair() if name == "two" else explained(name, 3, LATER_S.get(name, 15.0))
    weights = [h.probability for h in hypotheses]
    assert all(0.0 < w <= 1.0 for w in weights) and 0.9 <= sum(weights) <= 1.0 + 1e-9
    assert weights == sorted(weights, reverse=True)
    for hypothesis in hypotheses:
        for state in hypothesis.faults:
            assert reactor().description.fault_mode(state.fault).severity_range.contains(state.severity)
            assert state.onset_s <= ONSET_S + 600.0


def test_no_fault_is_said_with_more_than_the_plant_states() -> None:
    found = explained("level_bias", 3, 15.0)
    said = sum(h.probability for h in found if h.name == "level_bias")
    assert 0.9 <= said <= 1.0 - reactor().twin.misled + 1e-9
    assert sum(h.probability for h in found) == pytest.approx(1.0)


def test_the_uncertainty_of_the_size_is_kept() -> None:
    """Fouling creeps: the hypotheses of one fault span its size at about two standard deviations."""
    sizes = [h.faults[0].severity for h in explained("fouling", 3, 400.0) if h.name == "fouling"]
    assert len(sizes) >= 2 and max(sizes) - min(sizes) >= 0.05
    assert min(sizes) - 0.05 <= size_of("fouling") <= max(sizes) + 0.05


def test_the_same_readings_give_the_same_explanation() -> None:
    fault = (FaultState("temp_bias", 5.0, ONSET_S),)
    twice = [follow(readings(3, 1465, fault), seed).explain(("temp_bias", "fouling"), ()) for seed in (1, 2)]
    assert twice[0] == twice[1], "explanations draw nothing"


def test_only_candidates_are_single_explanations() -> None:
    fault = (FaultState("temp_bias", 5.0, ONSET_S),)
    found = follow(readings(3, 1465, fault), 3).explain(("temp_bias", "fouling"), ())
    assert {h.name for h in with_a_twin(found) if len(h.faults) == 1} <= {"temp_bias", "fouling"}
