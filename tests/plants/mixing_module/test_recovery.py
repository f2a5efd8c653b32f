"""Batches from start to end: a fault gets what cures it, and wrong routes are refused for what they would do."""

from __future__ import annotations

import functools
from dataclasses import replace

import pytest

from benchmarks.mixing_wrong_routes import forced
from homeostat.domain.events.deviations import Deviated
from homeostat.domain.events.guard import StateEntered
from homeostat.domain.events.recovery import Diagnosed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Revise
from homeostat.evaluate.reference.best_route import best_route
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.run import Run
from homeostat.evaluate.runner import run
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import fallbacks, new_sequencer


@functools.cache
def module() -> Plant:
    return load_plant("mixing_module")


def batch(fault: str, seed: int, onset_s: float, severity: float | None = None) -> tuple[Run, MemoryTrace]:
    trace = MemoryTrace()
    chosen = scenario(module(), fault, seed, onset_s if fault != "none" else None, severity, 450.0)
    result = run(module(), chosen, trace, DeclaredClock(1.0))
    assert result.totals["overflowed_L"] == result.totals["dry_run_s"] == result.totals["dead_head_s"] == 0.0
    assert all(e.total_s == 0.0 for e in result.exposures)
    return result, trace


def states(trace: MemoryTrace) -> list[str]:
    return [e.state for e in trace.of(StateEntered)]


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.wide) for seed in (2, 3))])
def test_a_batch_without_fault_takes_its_eight_transitions_and_nobody_acts(seed: int) -> None:
    result, trace = batch("none", seed, 0.0)
    assert states(trace) == [
        "filling_B201", "filling_B202", "filling_B203", "emptying_B201", "emptying_B202", "emptying_B203",
        "emptying_B204", "complete",
    ]  # fmt: skip
    assert not trace.of(ReleasedActions) and not trace.of(Deviated) and result.complete_s == result.nominal_s
    assert result.totals["delivered_L"] == pytest.approx(8.3, abs=0.5)


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "onset_s", "severity"), [
    ("leakage_main", 125.0, 0.3),
    pytest.param("pump_degradation", 50.0, 0.5, marks=pytest.mark.wide),
    pytest.param("pump_failure", 125.0, None, marks=pytest.mark.wide),
    pytest.param("clogging_main", 125.0, 1.0, marks=pytest.mark.wide),
])  # fmt: skip
def test_what_the_bypass_cures_goes_through_the_bypass(fault: str, onset_s: float, severity: float | None) -> None:
    result, trace = batch(fault, 1, onset_s, severity)
    assert result.state == "complete" and any(s.startswith("bypass") for s in states(trace))
    assert result.totals["spilled_L"] <= 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "severity"), [("pump_degradation", 0.2), pytest.param("clogging_main", 0.6, marks=pytest.mark.wide)]
)
def test_what_waiting_cures_stays_on_the_main_line(fault: str, severity: float) -> None:
    result, trace = batch(fault, 2, 50.0, severity)
    assert result.state == "complete" and not any(s.startswith("bypass") for s in states(trace))


@pytest.mark.wide
def test_what_neither_cures_is_held() -> None:
    result, trace = batch("clogging_common", 2, 20.0, 1.0)
    assert "held" in states(trace) and result.complete_s is None
    assert best_route(module(), result.scenario) is None, "no route could have completed it"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "severity"), [pytest.param("sensor_stuck_B203", 1.0, marks=pytest.mark.wide), ("sensor_bias_B202", -0.03)]
)
def test_a_level_that_lies_is_not_waited_for(fault: str, severity: float) -> None:
    result, _ = batch(fault, 1, 10.0 if "bias" in fault else 50.0, severity)
    assert result.state == "complete"
    assert result.totals["delivered_L"] == pytest.approx(8.3, abs=0.5), "every tank was filled and emptied"


@pytest.mark.wide
def test_a_level_that_lies_at_the_end_of_the_batch_does_not_keep_it_open() -> None:
    result, _ = batch("sensor_stuck_B204", 9, 150.0, 1.0)
    assert result.state == "complete"


@pytest.mark.wide
def test_a_flow_meter_that_is_stuck_at_nothing_stops_no_batch() -> None:
    result, _ = batch("sensor_stuck_flow", 13, 60.0, 1.0)
    assert result.state == "complete"


@pytest.mark.wide
@pytest.mark.parametrize(("fault", "seed", "onset_s", "severity"), [
    ("sensor_drift_B203", 7, 111.0, -0.0021),
    pytest.param("sensor_stuck_B201", 5, 133.0, 0.9, marks=pytest.mark.wide),
])  # fmt: skip
def test_a_level_that_begins_to_lie_overfills_nothing_and_ends_no_batch(
    fault: str, seed: int, onset_s: float, severity: float
) -> None:
    result, _ = batch(fault, seed, onset_s, severity)
    assert result.state == "complete" and result.totals["delivered_L"] == pytest.approx(8.3, abs=0.5)


@pytest.mark.slow
@pytest.mark.parametrize(("severity", "completed"), [(0.2, True), pytest.param(0.9, False, marks=pytest.mark.wide)])
def test_what_goes_on_filling_a_tank_is_led_out(severity: float, completed: bool) -> None:
    """Not before it must be: where the batch is over by then, it is complete."""
    result, trace = batch("stuck_open_VI201", 3, 145.0, severity)
    assert (result.complete_s is not None) == completed and states(trace)[-1] == "pumping_out"
    assert [e.strategy for e in trace.of(FallbackActivated)] == ["pump_out"]


def test_a_batch_that_is_over_is_not_left_to_a_valve_that_does_not_close() -> None:
    result, trace = batch("stuck_open_VI203", 2, 240.0, 0.6)
    assert result.complete_s is not None, "the batch itself was complete"
    assert [e.strategy for e in trace.of(FallbackActivated)] == ["pump_out"]


def test_a_pump_that_has_emptied_every_tank_stops_before_it_is_hurt() -> None:
    plant, sequencer = module(), new_sequencer(module())
    (pump_out,) = (s for s in fallbacks(plant) if s.name == "pump_out")
    process = open_process(plant, scenario(plant, "none", 1, end_s=400.0))

    def pump_out_at_100_s(snapshot: Snapshot) -> None:
        if snapshot.at_s == 100.0:
            sequencer.load(pump_out.actions, 100.0)
            process.command(pump_out.actions.commands)

    truth = watch(process, sequencer.sample, pump_out_at_100_s).truth().signals
    assert sequencer.state == "emptied" and truth["dry_s"][0, -1] == truth["dead_head_s"][0, -1] == 0.0
    assert all(truth[f"B20{n}.level"][0, -1] < 0.15 for n in (1, 2, 3)), "gravity leaves what stands below B204"


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "onset_s", "where", "end"), [
    ("pump_failure", 125.0, ("emptying_B201", "t4"), "complete"),
    pytest.param("stuck_closed_VI202", 45.0, ("filling_B202", "t2"), "held", marks=pytest.mark.wide),
])  # fmt: skip
def test_what_no_symptom_shows_is_found_when_the_batch_departs_from_its_prediction(
    fault: str, onset_s: float, where: tuple[str, str], end: str
) -> None:
    plant = module()
    deaf = replace(plant, description=replace(plant.description, symptom_rules=()))
    trace = MemoryTrace()
    result = run(deaf, scenario(plant, fault, 1, onset_s, 1.0, 400.0), trace, DeclaredClock(1.0))
    deviated, diagnosed = trace.of(Deviated)[0], trace.of(Diagnosed)[0]
    assert (deviated.state, deviated.transition) == where
    assert diagnosed.symptoms == () and diagnosed.hypotheses[0].name == fault
    assert trace.of(ReleasedActions) and not trace.of(FallbackActivated) and result.state == end


@pytest.mark.parametrize(("fault", "severity", "reason"), [
    ("pump_failure", 1.0, "TARGET-complete"), ("clogging_main", 1.0, "ACC-PUMPS"), ("leakage_main", 0.5, "ACC-SPILL"),
])  # fmt: skip
@pytest.mark.parametrize("at_s", [pytest.param(60.0, marks=pytest.mark.wide), 120.0])
def test_the_wrong_route_is_refused_for_a_physical_reason(
    fault: str, severity: float, reason: str, at_s: float
) -> None:
    verdict = forced(scenario(module(), fault, 4, at_s - 5.0, severity, at_s))
    assert isinstance(verdict, Revise) and reason in {f.criterion for f in verdict.violated}
    assert all(f.margin > -float("inf") for f in verdict.violated), "margins, not refusals"


@pytest.mark.slow
def test_a_batch_without_one_of_its_parts_is_held_not_completed() -> None:
    """An inlet that never opens: what the recipe wants of that tank would be missing from the product."""
    result, trace = batch("stuck_closed_VI201", 3, 5.0, 1.0)
    assert states(trace)[-1] == "held" and result.complete_s is None and result.totals["delivered_L"] == 0.0
    assert best_route(module(), result.scenario) is None


@pytest.mark.parametrize(
    ("readings", "resumed"),
    [
        ({}, {"filling_B201"}),
        ({"B201": 0.2}, {"filling_B201", "filling_B202"}),
        ({"B201": 0.2, "B202": 0.2}, {"filling_B201", "filling_B202", "filling_B203"}),
        ({"B202": 0.2, "B203": 0.2}, {"filling_B201", "emptying_B201", "bypass_emptying_B201"}),
        ({"B203": 0.2, "B204": 0.3}, {"filling_B201", "emptying_B202", "bypass_emptying_B202"}),
        ({"B203": 0.1, "B204": 0.5}, {"filling_B201", "emptying_B203", "bypass_emptying_B203"}),
        ({"B204": 0.66}, {"filling_B201", "emptying_B203", "bypass_emptying_B203", "emptying_B204"}),
    ],
)
@pytest.mark.parametrize("blind", ["level", "pressure"])
def test_a_held_batch_goes_on_where_what_the_recipe_wants_before_is_there(
    readings: dict[str, float], resumed: set[str], blind: str
) -> None:
    """Either transmitter is enough: one that reads nothing does not keep the batch."""
    levels = dict.fromkeys(("B201", "B202", "B203"), 0.02) | {"B204": 0.122} | readings
    values = {f"{tank}.level": level for tank, level in levels.items()}
    values |= {f"{tank}.pressure": 9.81 * level for tank, level in levels.items()}
    values |= dict.fromkeys((tag for tag in values if tag.endswith(blind)), 0.0)
    machine = module().description.machine
    decided = [
        t for t in machine.transitions if t.source == "held" and t.on_decision and t.event == machine.recovery_event
    ]
    assert {t.target for t in decided if t.guard.holds(values)} == resumed
