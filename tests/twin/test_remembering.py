"""Remembering: a fault that was found is not forgotten because it cannot be seen, and given up where it is refuted."""

from __future__ import annotations

import functools

import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis, with_a_twin
from homeostat.domain.recovery import Command
from homeostat.domain.snapshot import Snapshot
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.process.seeds import Stream, noise_seed
from tests.twin.followed import follow, reactor, readings

FOULED = FaultState("fouling", 0.7, 1500.0)
HELD_S, END_S = 2300.0, 3200.0
HOLD = (Command("F1.sp", 0.0, None), Command("XV1.cmd", 0.0, None), Command("L1.sp", 6.4, 0.1),
        Command("T1.sp", 305.0, None))  # fmt: skip


@functools.cache
def held(seed: int) -> tuple[Snapshot, ...]:
    """A reactor that fouls, and whose feed is then shut off: without load nobody sees how well it is cooled."""
    plant = reactor()
    noise = noise_seed(seed, Stream.TRUTH_NOISE)
    configuration = PlantConfiguration(plant.true_parameters(seed), plant.start, (FOULED,), END_S, noise)
    link = SimulatedLink(TrueProcess(plant.model, plant.description, configuration))
    wire, seen = link.take(), []
    while not link.ended:
        seen.append(link.advance())
        if link.now_s == HELD_S:
            wire.send(HOLD)
    return tuple(seen)


def with_fouling(found: tuple[Hypothesis, ...]) -> float:
    """Among what a twin can carry: a share for something else is in every answer."""
    return sum(h.probability for h in with_a_twin(found) if "fouling" in {f.fault for f in h.faults})


@pytest.mark.parametrize("seed", [1, 2, 3, 13])
def test_a_fault_is_not_forgotten_where_it_cannot_be_seen(seed: int) -> None:
    twin = follow(held(seed), seed)
    assert with_fouling(twin.explain(["fouling", "level_bias"], (FOULED,))) >= 0.9


@pytest.mark.parametrize("seed", [2, 13])
def test_a_fault_is_not_forgotten_when_a_second_one_is_taken_back(seed: int) -> None:
    twin, second = follow(held(seed), seed), FaultState("level_bias", 2.9, 2500.0)
    assert with_fouling(twin.explain(["level_bias", "fouling"], (FOULED, second))) >= 0.8


def test_a_fault_that_the_readings_refute_is_given_up() -> None:
    """At full load a reactor that is cooled as ever is not fouled, whatever was believed."""
    healthy = follow(readings(3, 2400), 3)
    assert with_fouling(healthy.explain(["fouling", "temp_bias"], (FOULED,), since_s=FOULED.onset_s)) <= 0.05


@pytest.mark.slow
@pytest.mark.parametrize(("true", "believed"), [("temp_bias", "fouling"), ("inlet_stuck_open", "level_bias")])
def test_what_was_believed_by_mistake_is_corrected(true: str, believed: str) -> None:
    size = {f.name: f.severity_nominal for f in reactor().description.faults}
    twin = follow(readings(4, 1750, (FaultState(true, size[true], 1450.0),)), 4)
    found = twin.explain([true, believed], (FaultState(believed, size[believed], 1440.0),))
    assert sum(h.probability for h in found if h.name == true) >= 0.8


@pytest.mark.parametrize("seed", [1, 2, 3, 13])
def test_a_vessel_that_was_drained_is_no_level_that_lies(seed: int) -> None:
    """Of nine litres that the pump took, the model misses a few per cent; no instrument has to be wrong for that."""
    drained = tuple(snapshot for snapshot in held(seed) if snapshot.at_s <= HELD_S + 560.0)
    found = follow(drained, seed).explain(["fouling", "level_bias"], (FOULED,))
    assert sum(h.probability for h in found if "level_bias" in {f.fault for f in h.faults}) <= 0.1
