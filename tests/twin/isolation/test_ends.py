"""Ends: the transient by which a fault ends says so, where the stretch after it could be anything."""

from __future__ import annotations

import numpy as np
import pytest

from homeostat.domain.diagnosis import FaultState
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import departing, repaired, scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.twin.isolation.beginnings import before_onsets
from homeostat.twin.replay import replay, replay_ends
from homeostat.twin.twin import Twin
from tests.twin.followed import follow, reactor, readings

ONSET_S, REPAIRED_S = 1500.0, 1900.0


def mended(fault: str, severity: float, seed: int, until_s: float, *others: str) -> Twin:
    """A twin of a reactor, other than its model, whose fault is repaired at 1,900 s."""
    plant = reactor()
    told = departing(plant, scenario(plant, fault, seed, ONSET_S, severity, until_s), others, "plant")
    link = SimulatedLink(open_process(plant, repaired(told, REPAIRED_S) if until_s > REPAIRED_S else told))
    return follow(tuple(link.advance() for _ in range(int(until_s))), seed)


@pytest.mark.parametrize("seed", [3, 4, 5])
@pytest.mark.parametrize(
    ("fault", "severity", "after_s"),
    [("level_bias", 1.5, 6), ("level_bias", 1.5, 30), ("temp_bias", 6.0, 6), ("fouling", 0.9, 80)],
)
def test_what_ends_is_over_as_soon_as_its_transient_is_seen(
    fault: str, severity: float, after_s: int, seed: int
) -> None:
    """A transmitter that reads 1.5 L low and is put right is none that reads 1.5 L high from then on."""
    twin = mended(fault, severity, seed, REPAIRED_S + after_s)
    ended = twin.ended(((FaultState(fault, severity, ONSET_S),),))
    assert ended is not None and ended.fits
    assert REPAIRED_S - 4.0 <= ended.since_s <= REPAIRED_S + after_s


@pytest.mark.parametrize("seed", [3, 4, 5])
@pytest.mark.parametrize(
    ("fault", "severity", "other"),
    [
        ("level_bias", 1.5, "L1 reads + 0.7 from 1850"),  # half of it is gone
        ("fouling", 0.5, "T_coolant + 6 from 1850"),
        ("temp_bias", 6.0, "T1 reads - 2 from 1850"),
        ("outlet_block", 0.5, "feed_flow * 1.0 from 1850"),
    ],
)
def test_what_changes_while_a_fault_is_there_is_no_end_of_it(
    fault: str, severity: float, other: str, seed: int
) -> None:
    others = () if "feed_flow" in other else (other,)
    twin = mended(fault, severity, seed, 1890.0, *others)
    assert twin.ended(((FaultState(fault, severity, ONSET_S),),)) is None


def test_a_replay_that_ends_is_the_fault_before_and_the_state_that_it_left_after() -> None:
    """By hand: until the end it is the replay with the fault; from there on nothing moves what it left."""
    fault = (FaultState("level_bias", 1.5, ONSET_S),)
    twin = follow(readings(3, 1600, fault), 3)
    model, window = twin._model, twin._history.window(200)
    mean, ends = twin._posterior.mean, np.array([120, 150, 199])
    there, gone = (twin._carrier.carry([faults], window) for faults in (fault, ()))
    run = replay_ends(model, window, mean, there, gone, ("L1",), ends)
    whole = replay(model, window, mean[None], there, ("L1",)).predicted[0]
    for row, end in zip(run.predicted, ends, strict=True):
        assert np.array_equal(row[:end], whole[:end])
    jump = run.predicted[0][120:123] - whole[120:123]
    assert np.all(jump > 1.0), "the transmitter shows what there is again"


def test_readings_begin_before_what_began_about_where_they_do() -> None:
    """20 readings say where it begins, 5 more an onset may be off: one of 1,510 s wants readings from 1,484 s on."""
    assert before_onsets(1500.0, [1510.0], 20, 1.0) == 1484.0
    assert before_onsets(1500.0, [1525.5], 20, 1.0) == 1500.0 == before_onsets(1500.0, [1400.0, np.inf], 20, 1.0)
    assert before_onsets(1500.0, [1490.0, 1510.0], 20, 1.0) == 1464.0, "further back, another one may have begun"


def test_what_is_young_is_left_to_stretches() -> None:
    """A level that read low for five minutes and does no more may do so again: half a turn looks like an end."""
    young = FaultState("level_bias", 1.5, REPAIRED_S - 300.0)
    plant = reactor()
    told = departing(plant, scenario(plant, "level_bias", 3, young.onset_s, 1.5, REPAIRED_S + 6.0), (), "plant")
    link = SimulatedLink(open_process(plant, repaired(told, REPAIRED_S)))
    twin = follow(tuple(link.advance() for _ in range(int(REPAIRED_S) + 6)), 3)
    assert twin.ended(((young,),)) is None
