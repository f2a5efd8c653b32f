"""Faults without an equation act on a true plant as the disturbances that they are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.recovery import Command
from homeostat.evaluate.reference.unsupervised import open_process, true_plant
from homeostat.evaluate.scenario import departing, repaired, scenario
from homeostat.links.truth.members import Members
from homeostat.links.truth.process import TrueProcess
from homeostat.plants.plant import Plant
from tests.plants.named_causes import CAUSES, copied

ONSET_S = 450.0
END_S = 650


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Plant:
    return copied(tmp_path_factory.mktemp("plants"), *CAUSES).load()


def shown(process: TrueProcess, seconds: int = END_S) -> NDArray[np.float64]:
    """Readings of so many seconds, shape (seconds, tags)."""
    rows = [process.advance() for _ in range(seconds)]
    return np.array([[row[tag] for tag in sorted(row)] for row in rows])


def of(
    plant: Plant, fault: str, severity: float | None = None, *disturbances: str, mismatch: str = "none"
) -> TrueProcess:
    onset = None if fault == "none" else ONSET_S
    return open_process(plant, departing(plant, scenario(plant, fault, 7, onset, severity), disturbances, mismatch))


@pytest.mark.parametrize(
    ("fault", "severity", "disturbance"),
    [
        ("coolant_pipe_scaled", -0.125, "F3_max - 0.125 from 450"),
        ("lagging_lost", 150.0, "UA_ambient + 150 from 450"),
        ("thermowell_loose", 5.0, "T1 reads - 5 from 450"),
        ("thermometer_stuck", 1.0, "T1 frozen from 450"),
    ],
)
def test_a_fault_without_an_equation_is_the_disturbance_that_it_is(
    plant: Plant, fault: str, severity: float, disturbance: str
) -> None:
    found, healthy = shown(of(plant, fault, severity)), shown(of(plant, "none"))
    as_disturbed = shown(of(plant, "none", None, disturbance))
    assert np.array_equal(found[:449], healthy[:449], equal_nan=True)
    assert not np.allclose(found[455:], healthy[455:], equal_nan=True)
    assert np.allclose(found[460:], as_disturbed[460:], rtol=2e-3, atol=0.05, equal_nan=True)


def test_it_acts_on_a_plant_that_is_not_its_model_and_beside_disturbances(plant: Plant) -> None:
    disturbed = "F3_max * 0.9 from 500", "T_coolant + 3 from 500"
    found = shown(of(plant, "coolant_pipe_scaled", -0.1, *disturbed, mismatch="plant"))
    tags = sorted(of(plant, "none").advance())
    alone = shown(of(plant, "none", None, *disturbed, mismatch="plant"))
    flow = tags.index("F3")
    assert np.array_equal(found[:449], alone[:449], equal_nan=True)
    assert found[470:490, flow].mean() == pytest.approx(0.8 * alone[470:490, flow].mean(), rel=0.1)
    assert (found[510:, flow] < alone[510:, flow] + 0.05).all()


def test_heat_that_a_balance_gains_warms_what_the_vessel_holds(plant: Plant) -> None:
    """Check: 2 kW for 19 s in 4.18 kJ/(L K) times what the vessel holds, less what little the loop does meanwhile.

    It is there for 20 s; what comes in at the end of a tick is seen at the end of the next.
    """
    processes = [
        open_process(plant, scenario(plant, *given)) for given in (("heater_on", 7, ONSET_S, 2.0), ("none", 7))
    ]
    for process in processes:
        shown(process, int(ONSET_S) + 20)
    warm, usual = (process.truth().signals for process in processes)
    volume, cp = usual["L1"][0, -20:].mean(), plant.true_parameters(7)[plant.model.parameters.index("cp")]
    assert warm["T1"][0, -1] - usual["T1"][0, -1] == pytest.approx(2000.0 * 19.0 / (cp * volume), rel=0.1)


def test_a_position_is_off_its_command_where_it_is_commanded(plant: Plant) -> None:
    """In automatic the controller has the position that it needs, and nothing commands another one."""
    process = of(plant, "valve_offset", -0.2)
    shown(process, 440)
    process.command((Command("V2.man", 0.6, None),))
    tags, found = sorted(of(plant, "none").advance()), shown(process, 40)
    position = found[:, tags.index("V2.pos")]
    assert position[5:9].mean() == pytest.approx(0.6, abs=0.02)
    assert position[15:].mean() == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize("fault", [*CAUSES])
@pytest.mark.parametrize("repaired_s", [None, 500.0])
def test_members_are_the_plant_and_are_repaired_when_it_is(plant: Plant, fault: str, repaired_s: float | None) -> None:
    """But for what a balance gains in the last second, which a record shows one second later."""
    chosen = repaired(scenario(plant, fault, 7, ONSET_S), repaired_s)
    truth = true_plant(plant, chosen)
    process, members = (
        TrueProcess(plant.model, plant.description, truth),
        Members(plant.model, plant.description, truth),
    )
    shown(process)
    schedules = np.tile(plant.start, (2, END_S, 1))
    record = members.simulate(np.tile(members.start(), (2, 1)), schedules, 0.0, END_S, 1).record
    own = plant.model.truth(record, schedules)
    for tag in ("T1", "L1"):
        assert np.allclose(own[tag][0], process.truth().signals[tag][0], rtol=3e-4)
        assert np.array_equal(own[tag][0], own[tag][1])


@pytest.mark.parametrize("fault", ["coolant_pipe_scaled", "thermowell_loose", "thermometer_stuck"])
def test_a_repaired_one_acts_no_more(plant: Plant, fault: str) -> None:
    chosen = scenario(plant, fault, 7, ONSET_S)
    tags = sorted(of(plant, "none").advance())
    tag = "F3" if fault == "coolant_pipe_scaled" else "T1"
    found = shown(open_process(plant, repaired(chosen, 500.0)))[:, tags.index(tag)]
    kept = shown(open_process(plant, chosen))[:, tags.index(tag)]
    assert np.array_equal(found[:500], kept[:500]) and not np.array_equal(found[500:], kept[500:])
    assert fault != "thermometer_stuck" or (np.ptp(kept[460:]) == 0.0 and np.ptp(found[501:]) > 0.0)


@pytest.mark.parametrize(
    "wrong", [FaultState("lagging_lost", math.nan, 1.0), FaultState("lagging_lost", 1.0, math.nan)]
)
def test_a_size_that_is_no_number_is_refused(plant: Plant, wrong: FaultState) -> None:
    truth = replace(true_plant(plant, scenario(plant, "none", 7)), faults=(wrong,))
    with pytest.raises(ValueError, match="finite"):
        TrueProcess(plant.model, plant.description, truth)


def test_what_is_injected_takes_the_place_of_what_acted_before(plant: Plant) -> None:
    process, healthy = of(plant, "none"), shown(of(plant, "none"))
    before = shown(process, 449)
    process.inject((FaultState("coolant_pipe_scaled", -0.125, 449.0),))
    scaled = shown(process, 40)
    process.inject(())
    after = shown(process, 161)
    assert np.array_equal(before, healthy[:449], equal_nan=True)
    assert not np.allclose(scaled[5:], healthy[454:489], equal_nan=True)
    assert np.allclose(after[-1], healthy[-1], rtol=2e-2, atol=0.3, equal_nan=True), "it comes back"
