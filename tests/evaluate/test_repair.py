"""A repaired plant: the end of the fault is said, and the plant is back in normal operation, with nothing violated."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from homeostat.domain.events.recovery import FaultsEnded
from homeostat.evaluate import runner
from homeostat.evaluate.run import Run
from homeostat.evaluate.scenario import departing, repaired, scenario
from homeostat.evaluate.score.scoring import outside_after
from homeostat.journal.memory import MemoryTrace
from homeostat.links.clock import DeclaredClock
from tests.twin.followed import reactor

ONSET_S, REPAIRED_S = 1300.0, 1700.0


@functools.cache
def run(fault: str, severity: float, repaired_s: float | None = REPAIRED_S) -> Run:
    plant = reactor()
    told = departing(plant, scenario(plant, fault, 5, ONSET_S, severity, 2400.0), (), "plant")
    return runner.run(plant, repaired(told, repaired_s), MemoryTrace(), DeclaredClock(1.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "severity"), [("cool_stuck_closed", 0.6), pytest.param("cool_stuck_open", 0.9, marks=pytest.mark.wide)]
)
def test_a_repaired_valve_takes_the_plant_back_to_normal(fault: str, severity: float) -> None:
    back = run(fault, severity)
    said = [entry.at_s for entry in back.record.entries if isinstance(entry.event, FaultsEnded)]
    assert said and REPAIRED_S < said[0] <= REPAIRED_S + 60.0
    state, at_s = back.record.states[-1]
    assert state == "normal" and REPAIRED_S < at_s <= REPAIRED_S + 300.0  # by hand first, where that spares a swing
    assert not outside_after(back.truth, back.force, REPAIRED_S)
    after, signals = back.truth.times_s >= at_s, back.truth.signals
    for tag, most in (("T1", 1.0), ("L1", 0.2)):
        assert np.abs(signals[tag][0] - signals[f"{tag}.sp"][0])[after].max() <= most


@pytest.mark.slow
def test_a_fault_that_stays_is_never_over() -> None:
    stuck = run("cool_stuck_closed", 0.6, None)
    assert not [e for e in stuck.record.entries if isinstance(e.event, FaultsEnded)]
    assert stuck.record.states[-1][0] != "normal"
