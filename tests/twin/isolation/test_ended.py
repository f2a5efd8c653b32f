"""Ended: a fault that was repaired is given up within seconds, one that cannot be seen is not."""

from __future__ import annotations

import functools

import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.domain.snapshot import Snapshot
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import departing, repaired, scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.twin.isolation.ended import STRETCHES
from homeostat.twin.twin import Twin
from tests.twin.followed import follow, reactor
from tests.twin.test_remembering import FOULED, HOLD, held

ONSET_S, REPAIRED_S = 1500.0, 1560.0
STUCK = FaultState("cool_stuck_closed", 0.6, ONSET_S)


@functools.cache
def mended(fault: str, severity: float, seed: int, mismatch: str, until_s: float) -> tuple[Snapshot, ...]:
    """A reactor with a fault from 1500 s to 1560 s, which nobody touches."""
    plant = reactor()
    told = scenario(plant, fault, seed, ONSET_S, severity, until_s)
    told = repaired(departing(plant, told, (), mismatch), REPAIRED_S)
    link = SimulatedLink(open_process(plant, told))
    return tuple(link.advance() for _ in range(int(until_s)))


def looked(fault: str, severity: float, after_s: float, seed: int = 3, mismatch: str = "none") -> Twin:
    """A twin that has seen the plant until ``after_s`` after the repair."""
    return follow(mended(fault, severity, seed, mismatch, 1640.0)[: int(REPAIRED_S + after_s)], seed)


@pytest.mark.parametrize("mismatch", ["none", "plant"])
@pytest.mark.parametrize(
    ("fault", "severity"),
    [("cool_stuck_closed", 0.6), ("outlet_block", 0.8), ("pump_degrade", 0.6), ("inlet_stuck_open", 0.8)],
)
def test_a_repaired_fault_is_over_within_seconds(fault: str, severity: float, mismatch: str) -> None:
    known = ((FaultState(fault, severity, ONSET_S),),)
    ended = looked(fault, severity, 20.0, mismatch=mismatch).ended(known)
    assert ended is not None and ended.fits
    assert REPAIRED_S - 3.0 <= ended.since_s <= REPAIRED_S + 12.0


@pytest.mark.parametrize("after_s", [-5.0, -20.0, 1.0])
def test_a_fault_that_is_there_is_not_over(after_s: float) -> None:
    assert looked("cool_stuck_closed", 0.6, after_s).ended(((STUCK,),)) is None


@pytest.mark.parametrize("size", [0.55, 0.7])
def test_a_fault_whose_size_was_not_known_exactly_is_not_over(size: float) -> None:
    assert looked("cool_stuck_closed", 0.6, -5.0).ended(((FaultState(STUCK.fault, size, ONSET_S),),)) is None


@functools.cache
def there(fault: str, severity: float, seed: int, until_s: float) -> tuple[Snapshot, ...]:
    """A reactor, other than its model, with a fault from 1500 s on that nobody repairs."""
    plant = reactor()
    told = departing(plant, scenario(plant, fault, seed, ONSET_S, severity, until_s), (), "plant")
    link = SimulatedLink(open_process(plant, told))
    return tuple(link.advance() for _ in range(int(until_s)))


@pytest.mark.parametrize(
    ("fault", "severity", "after_s"),
    [("cool_stuck_closed", 0.3, 80), ("outlet_block", 0.3, 160), ("pump_degrade", 0.4, 160), ("temp_bias", 5.0, 160),
     ("fouling", 0.45, 580)],
)  # fmt: skip
def test_a_fault_that_is_half_as_large_as_was_thought_is_not_over(fault: str, severity: float, after_s: int) -> None:
    """What its size would show is refuted, and so is that nothing is there: a ramp is first thought to be too large."""
    twin = follow(there(fault, severity, 3, ONSET_S + after_s), 3)
    assert twin.ended(((FaultState(fault, 2.0 * severity, ONSET_S),),)) is None


def test_what_was_wrong_of_one_of_two_does_not_end_the_other() -> None:
    """That the pump is not clogged refutes both together; the valve is stuck as before."""
    twin = follow(there("cool_stuck_closed", 0.3, 3, ONSET_S + 80), 3)
    both = FaultState("cool_stuck_closed", 0.3, ONSET_S), FaultState("outlet_block", 0.6, ONSET_S)
    assert twin.ended((both,)) is None


def test_what_cannot_be_seen_is_not_over() -> None:
    """Fouling without feed: whether the jacket is fouled makes no difference."""
    assert follow(held(2), 2).ended(((FOULED,),)) is None


def test_what_has_stopped_growing_is_not_over() -> None:
    """A jacket that has lost a third within 400 s cools so since then; what would have gone on is refuted, not that."""
    plant = reactor()
    design = next(p.value for p in plant.description.parameters if p.symbol == "UA")
    told = departing(plant, scenario(plant, "none", 3, end_s=3200.0), ("UA * 0.67 from 1500 over 400",), "none")
    link = SimulatedLink(open_process(plant, told))
    wire, seen = link.take(), []
    while not link.ended:
        seen.append(link.advance())
        if link.now_s == 2000.0:
            wire.send(HOLD)
    growing = FaultState("unknown_heat_R1_UA_growing", -0.33 * design / 400.0, 1500.0)
    assert follow(tuple(seen), 3).ended(((growing,),)) is None


def test_one_of_two_faults_that_stays_keeps_both() -> None:
    other = FaultState("level_bias", 1.0, ONSET_S)
    twin = looked("cool_stuck_closed", 0.6, -10.0)
    assert twin.ended(((STUCK, other), (STUCK,))) is None


def test_what_was_read_before_is_not_looked_at() -> None:
    twin = looked("cool_stuck_closed", 0.6, 20.0)
    assert twin.ended(((STUCK,),), from_s=REPAIRED_S + 15.0) is None, "no stretch is as short"
    assert twin.explain(["cool_stuck_closed"], (), from_s=REPAIRED_S + 2.0)[0].name == "none"


@functools.cache
def compensated(until_s: float) -> tuple[Snapshot, ...]:
    """A reactor whose level reads 2.84 L low from 1500 s on, which its setpoint makes up for from 1506 s on."""
    plant = reactor()
    told = scenario(plant, "level_bias", 3, ONSET_S, 2.84, until_s)
    link = SimulatedLink(open_process(plant, departing(plant, told, ("L1.sp - 2.42 from 1506",), "plant")))
    return tuple(link.advance() for _ in range(int(until_s)))


@pytest.mark.parametrize("off_s", [-4.0, 0.0, 4.0])
@pytest.mark.parametrize("after_s", [41, 79, 83, 157, 162, 165, 319, 325])
def test_a_stretch_that_begins_where_the_fault_did_says_nothing(after_s: int, off_s: float) -> None:
    """Once the setpoint has made up for it, a level that reads low looks like a tank that is filled less."""
    seen = compensated(1850.0)[: int(ONSET_S) + after_s]
    assert follow(seen, 3).ended(((FaultState("level_bias", 2.82, ONSET_S + off_s),),)) is None


@pytest.mark.parametrize("mismatch", ["none", "plant"])
@pytest.mark.parametrize("after_s", [6.0, 10.0, 16.0, 30.0, 45.0, 60.0])
def test_what_is_looked_at_afterwards_has_no_part_in_which_a_bias_was_there(after_s: float, mismatch: str) -> None:
    """Readings of a transmitter before and after its bias ended look as if it had another error; some must be left."""
    for seed in (3, 4):
        ended = looked("temp_bias", 6.0, after_s, seed, mismatch).ended(((FaultState("temp_bias", 6.0, ONSET_S),),))
        if ended is not None:
            assert REPAIRED_S - 4.0 <= ended.since_s <= REPAIRED_S + max(after_s - STRETCHES[0] + 1.0, 8.0)
