"""A further fault beside an instrument or a controller that is wrong by its own evidence, on both plants."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultProbability, FaultState, Hypothesis, by_fault_set
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process, watch
from homeostat.evaluate.scenario import Fault, departing, repaired, scenario_of
from homeostat.guard.watch.quality import QualityWatch
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import new_sequencer
from homeostat.twin.carried import Carrier
from homeostat.twin.history import Window
from homeostat.twin.isolation.blind_beginning import begun
from homeostat.twin.isolation.established import Established
from homeostat.twin.twin import Twin

REACTOR, MODULE = "cstr", "mixing_module"
CALIBRATED_S, LEARN_S = 1400.0, 600.0
plant = functools.cache(load_plant)


@functools.lru_cache(maxsize=4)
def judged(
    name: str, end_s: int, faults: tuple[Fault, ...], *disturbances: str, repair_s: float | None = None
) -> tuple[Snapshot, ...]:
    """What monitoring is shown of a true plant that is not the twin's, and that nobody touches."""
    chosen, found = plant(name), list[Snapshot]()
    told = repaired(scenario_of(chosen, list(faults), 3, end_s + 1.0), repair_s)
    told = departing(chosen, told, disturbances, "plant")
    quality = QualityWatch(chosen.description.qualities, chosen.description.tags_by_name, lambda event, at_s: None)

    def see(raw: Snapshot) -> bool:
        if (snapshot := quality.assess(raw.at_s, raw)) is not None:
            found.append(snapshot)
        return raw.at_s >= end_s

    watch(open_process(chosen, told), new_sequencer(chosen).sample, see)
    return tuple(found)


def followed(name: str, at_s: float, snapshots: tuple[Snapshot, ...]) -> Twin:
    chosen = plant(name)
    twin = Twin(chosen.model, chosen.description, chosen.twin, 3)
    for snapshot in snapshots:
        if snapshot.at_s > at_s:
            break
        twin.observe(snapshot)
        if name == REACTOR and snapshot.at_s == CALIBRATED_S:
            twin.calibrate(LEARN_S)
    return twin


def tables(chosen: Plant) -> list[str]:
    return [fault.name for fault in chosen.description.faults]


def likeliest(found: tuple[Hypothesis, ...]) -> FaultProbability:
    return by_fault_set(found)[0]


def names(found: tuple[Hypothesis, ...]) -> frozenset[str]:
    return frozenset(f.fault for f in likeliest(found).faults)


PRESSURE = "B202.pressure frozen from 60"
PAIRS = [
    pytest.param(REACTOR, "T3 frozen from 1650", Fault("cool_stuck_closed", 0.7, 2000.0), 2010, "T3_frozen"),
    pytest.param(REACTOR, "T2 noise * 5 from 1900", Fault("cool_stuck_closed", 0.7, 2000.0), 2030, "T2_noisy"),
    pytest.param(REACTOR, "Ki_temperature * 4 from 1700", Fault("leak", 0.005, 2000.0), 2060, "TIC1_wrong_law"),
    pytest.param(REACTOR, "L1 frozen from 1650", Fault("inlet_stuck_open", 0.7, 1900.0), 1915, "L1_frozen"),
    pytest.param(MODULE, PRESSURE, Fault("clogging_main", 0.98, 100.0), 120, "B202.pressure_frozen"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "disturbance", "fault", "look_s", "accused"), PAIRS)
def test_a_fault_that_begins_beside_what_readings_show_by_themselves_is_named_with_it(
    name: str, disturbance: str, fault: Fault, look_s: int, accused: str
) -> None:
    twin = followed(name, look_s, judged(name, look_s, (fault,), disturbance))
    found = twin.explain(tables(plant(name)), (), since_s=fault.onset_s, news=True)
    assert names(found) == {accused, fault.name} and likeliest(found).probability > 0.8
    again = twin.explain(tables(plant(name)), found[0].faults, since_s=fault.onset_s, before=found)
    assert names(again) == names(found) and again[0].name == found[0].name


@pytest.mark.slow
def test_one_that_was_known_before_it_comes_first_and_keeps_its_onset() -> None:
    fault = Fault("cool_stuck_closed", 0.7, 2000.0)
    twin = followed(REACTOR, 2010, judged(REACTOR, 2010, (fault,), "T3 frozen from 1650"))
    known = FaultState("T3_frozen", 1.0, 1650.0)
    found = twin.explain(
        tables(plant(REACTOR)), (known,), since_s=1650.0, before=(Hypothesis((known,), 0.9),), news=True
    )
    assert found[0].name == "T3_frozen+cool_stuck_closed"
    assert found[0].faults[0] == known and found[0].faults[1].severity == pytest.approx(0.7, abs=0.05)


@pytest.mark.parametrize(
    ("name", "disturbance", "look_s", "accused"),
    [
        (REACTOR, "T3 frozen from 1650", 2060, "T3_frozen"),
        (REACTOR, "T1 noise * 5 from 1900", 2060, "T1_noisy"),
        (REACTOR, "Ki_temperature * 4 from 1900", 2060, "TIC1_wrong_law"),
        (MODULE, PRESSURE, 130, "B202.pressure_frozen"),
    ],
)
def test_where_it_explains_everything_it_is_named_alone(name: str, disturbance: str, look_s: int, accused: str) -> None:
    twin = followed(name, look_s, judged(name, look_s, (), disturbance))
    found = twin.explain(tables(plant(name)), (), since_s=look_s - 60.0, news=True)
    said = {h.name for h in found if not h.something_else}
    assert found[0].name == accused and likeliest(found).probability > 0.85 and said == {accused, "none"}


def test_a_vessel_whose_reading_was_stuck_before_the_readings_begin_is_as_full_as_the_others_say() -> None:
    """It was taken to be as full as it was when it got stuck, and everything that flowed from it looked wrong."""
    twin = followed(MODULE, 240, judged(MODULE, 240, (), PRESSURE))
    stuck = FaultState("B202.pressure_frozen", 1.0, 60.0)
    found = twin.explain(tables(plant(MODULE)), (stuck,), since_s=75.0, before=(Hypothesis((stuck,), 0.9),), news=True)
    assert found[0].faults == (stuck,) and likeliest(found).probability > 0.85


@pytest.mark.slow
def test_that_the_coolant_warms_is_no_fault_of_another_item_where_its_thermometer_is_stuck() -> None:
    """A replay goes by that reading, and an error of the reactor's own thermometer explained as much."""
    coolant = "T_coolant + 8 from 1800 over 300"
    twin = followed(REACTOR, 2060, judged(REACTOR, 2060, (), "T3 frozen from 1650", coolant))
    assert names(twin.explain(tables(plant(REACTOR)), (), since_s=1660.0, news=True)) == {"T3_frozen"}


def test_what_was_said_for_want_of_it_is_not_kept_beside_it() -> None:
    twin = followed(REACTOR, 2060, judged(REACTOR, 2060, (), "T1 noise * 5 from 1900"))
    before = (
        Hypothesis((FaultState("T1_reads_high", 2.8, 1900.0),), 0.5),
        Hypothesis((FaultState("unknown_V2_tau_V2", 2.0, 1601.0),), 0.3),
    )
    found = twin.explain(tables(plant(REACTOR)), before[0].faults, since_s=1920.0, before=before)
    assert {h.name for h in found if not h.something_else} == {"T1_noisy", "none"}


@pytest.mark.parametrize("mended", [True, False])
def test_a_fault_beside_a_stuck_instrument_ends_once_it_is_mended(mended: bool) -> None:
    leak, repair_s = Fault("leak", 0.005, 1900.0), 2200.0 if mended else None
    twin = followed(REACTOR, 2400, judged(REACTOR, 2400, (leak,), "T3 frozen from 1650", repair_s=repair_s))
    over = twin.ended([(FaultState("leak", 0.005, 1900.0),)], beside=(FaultState("T3_frozen", 1.0, 1650.0),))
    assert (over is not None) is mended
    assert over is None or over.since_s >= 2190.0


def test_where_the_others_say_nothing_a_stuck_reading_stays_where_it_is() -> None:
    """The level of the reactor shows in no other reading."""
    chosen = plant(REACTOR)
    twin = followed(REACTOR, 2000, judged(REACTOR, 2000, (), "L1 frozen from 1650"))
    window, carrier = twin._last(300.0), Carrier(chosen.model, chosen.description)
    noise = {v: error for v, (error, _) in chosen.twin.errors.items() if v != "L1"}
    stuck = "L1", chosen.description.tag("L1").range
    seen = begun(chosen.model, window, twin._posterior.mean, carrier.carry([()], window), stuck, noise)
    np.testing.assert_array_equal(seen.readings["L1"], window.readings["L1"])


def test_readings_are_held_from_when_their_instrument_was_stuck_and_no_others() -> None:
    chosen = plant(REACTOR)
    twin = followed(REACTOR, 1700, judged(REACTOR, 1700, (), "T1 frozen from 1650"))
    window: Window = replace(twin._last(300.0), held={}, frozen_s={})
    stuck = FaultState("T1_frozen", 1.0, 1650.0)
    wrong = Established((stuck,), {}, chosen.description, chosen.model, Carrier(chosen.model, chosen.description))
    seen = wrong.seen(window, twin._posterior, twin._isolation._accuracy, ())
    assert set(seen.held) == {"T1"} and int(np.argmax(seen.held["T1"])) == window.row(1650.0) and seen.held["T1"][-1]
    assert wrong.others((stuck, FaultState("temp_bias", 1.0, 1700.0), FaultState("leak", 1.0, 1.0))) == (
        FaultState("leak", 1.0, 1.0),
    )
