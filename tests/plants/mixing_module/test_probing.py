"""The two leaks and the two cloggings of the Mixing Module are told apart: by the readings, or by a test of the way."""

from __future__ import annotations

import functools

import pytest

from homeostat.agents.probing.moves import moves
from homeostat.domain.diagnosis import FaultProbability, by_fault_set, with_a_twin
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import Diagnosed, Probed, ProbeEnded
from homeostat.domain.recovery import RecoveryPath
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import departing, scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant

NAMED = 0.9
"""Probability from which a name is one [1]."""


@functools.cache
def module() -> Plant:
    return load_plant("mixing_module")


@functools.cache
def batch(fault: str, severity: float, seed: int, mismatch: str = "none") -> tuple[Run, MemoryTrace]:
    """A batch with a fault from 60 s on, long before the first pump runs; each thought takes half a second."""
    trace = MemoryTrace()
    chosen = departing(module(), scenario(module(), fault, seed, 60.0, severity, 450.0), (), mismatch)
    return run(module(), chosen, trace, DeclaredClock(0.5)), trace


def looks(trace: MemoryTrace) -> list[FaultProbability]:
    """What was likeliest at each look, of what a twin can carry."""
    return [likeliest(event) for event in trace.of(Diagnosed)]


def likeliest(event: Diagnosed) -> FaultProbability:
    return by_fault_set(with_a_twin(event.hypotheses))[0]


def states(trace: MemoryTrace) -> list[str]:
    return [event.state for event in trace.of(StateEntered)]


def test_no_test_leads_where_the_batch_may_end() -> None:
    """From where it is held the way on is refused as long as it is not known that the batch can be completed."""
    description = module().description
    machine, values = description.machine, dict.fromkeys(description.tags_by_name, 0.0)
    ways = [RecoveryPath(machine, p) for p in machine.paths("emptying_B201", values, machine.recovery_event, ())]
    assert {"held", "complete"} <= {way.target for way in ways}
    tried = [move.path for move in moves(ways, description.tags_by_name, values)]
    assert tried and {way.target for way in tried if way is not None} == {"complete"}


def told_apart(fault: str, severity: float, seed: int, mismatch: str = "none") -> Run:
    """A run in which one test of the way said which fault it is, or a wait after it, where the first look did not.

    What was as likely before, that nothing is wrong included, is asked again although its symptom has gone: seconds
    leave it some per cent, and it is held until they are gone.
    """
    result, trace = batch(fault, severity, seed, mismatch)
    (probe, *waits), (*_, end) = trace.of(Probed), trace.of(ProbeEnded)
    assert not any(wait.state for wait in waits)
    assert probe.state.startswith("bypass_emptying_")
    assert probe.value > probe.cost > 0.0 and probe.nats > 1.0
    assert end.likeliest == fault and end.probability >= 0.75
    at_s = next(entry.at_s for entry in trace.entries if entry.event is end)
    after = [likeliest(e.event) for e in trace.entries if isinstance(e.event, Diagnosed) and e.at_s >= at_s]
    assert all(fault in best.name for best in after) and after[-1].probability >= NAMED
    assert all(exposure.total_s == 0.0 for exposure in result.exposures)
    return result


@pytest.mark.slow
@pytest.mark.parametrize(("severity", "seed"), [(0.3, 1), pytest.param(0.2, 1, marks=pytest.mark.wide)])
def test_a_leak_of_the_main_line_is_told_by_the_bypass_on_which_there_is_none(severity: float, seed: int) -> None:
    result = told_apart("leakage_main", severity, seed)
    assert looks(batch("leakage_main", severity, seed)[1])[0].probability < NAMED
    assert result.complete_s is not None and result.nominal_s is not None
    assert result.complete_s - result.nominal_s < 45.0, "the bypass is where the batch is to go on"


@pytest.mark.wide
@pytest.mark.parametrize(("severity", "seed"), [(0.3, 1)])
def test_a_leak_of_the_common_line_is_told_by_the_bypass_on_which_it_stays(severity: float, seed: int) -> None:
    result = told_apart("leakage_common", severity, seed)
    assert looks(batch("leakage_common", severity, seed)[1])[0].probability < NAMED
    assert result.state == "held"


@pytest.mark.slow
def test_a_leak_that_would_spill_too_much_meanwhile_is_not_tested() -> None:
    result, trace = batch("leakage_common", 1.0, 1)
    assert not trace.of(Probed) and result.state == "held"


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["leakage_main", pytest.param("leakage_common", marks=pytest.mark.wide)])
@pytest.mark.parametrize(("severity", "seed"), [(0.3, 1), pytest.param(0.5, 3, marks=pytest.mark.wide)])
def test_over_seeds_and_sizes_both_leaks_are_named_in_the_end(fault: str, severity: float, seed: int) -> None:
    _, trace = batch(fault, severity, seed)
    assert looks(trace)[-1].name == fault and looks(trace)[-1].probability >= NAMED


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.wide)])
def test_on_a_plant_that_is_not_its_model_the_bypass_tells_as_well(seed: int) -> None:
    result, trace = batch("leakage_main", 0.3, seed, "plant")
    assert any(best.name.startswith("leakage_main") and best.probability >= NAMED for best in looks(trace))
    assert result.state == "complete" and any(state.startswith("bypass") for state in states(trace))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "severity", "seed"),
    [
        ("clogging_main", 0.7, 1),
        pytest.param("clogging_main", 0.9, 3, marks=pytest.mark.wide),
        pytest.param("clogging_common", 0.7, 1, marks=pytest.mark.wide),
    ],
)
def test_cloggings_differ_in_the_pressure_behind_the_pump_and_need_no_test(
    fault: str, severity: float, seed: int
) -> None:
    """What VI204, behind the common line, does to every reading where it sticks as far open, is the same."""
    _, trace = batch(fault, severity, seed)
    alike = {fault, "stuck_open_VI204"} if fault == "clogging_common" else {fault}
    assert not trace.of(Probed)
    assert looks(trace)[0].name == fault and all(best.name in alike for best in looks(trace))
