"""What grew and does so no more: what it has come to, and that it is remembered as the same thing."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import Disturbance, Scenario
from homeostat.links.simulated import SimulatedLink
from homeostat.twin.isolation.course import REACHED, continues, lasting, stopped, turned_back
from tests.twin.followed import follow, reactor

MODES = {mode.name: mode for mode in reactor().description.fault_modes}
GROWN = FaultState("unknown_heat_R1_growing", 0.004, 1000.0)
DRIFTED = FaultState("T1_drifts_down", 0.01, 1000.0)


def test_what_grew_comes_to_its_rate_times_its_age() -> None:
    assert lasting((GROWN,), MODES, 1500.0) == FaultState("unknown_heat_R1", pytest.approx(2.0), 1000.0)
    assert lasting((DRIFTED,), MODES, 1300.0) == FaultState("T1_reads_low", pytest.approx(3.0), 1000.0)


def test_what_stopped_among_the_readings_is_replayed_until_then() -> None:
    before, among = [], []
    for faults, replayed in stopped((GROWN,), (GROWN,), MODES, 1500.0, 2000.0):
        (before if replayed == faults else among).append((faults[0], replayed))
    assert [len(before), len(among)] == [10, 4]
    for rest, (grows, ends) in among:
        assert grows == GROWN and 1500.0 <= ends.onset_s < 2000.0 and ends.severity == -GROWN.severity
        assert rest.severity == pytest.approx(0.004 * (ends.onset_s - 1000.0))
    assert all(rest.severity < 0.004 * 500.0 for rest, _ in before)


@given(st.sampled_from([m for m in MODES.values() if m.effect and m.effect.grows]), st.floats(-1.0, 1.0))
def test_what_stopped_continues_what_grew_and_is_no_larger(mode: FaultState, share: float) -> None:
    whole = MODES[mode.name].severity_range
    size = whole.clip(share * whole.high)
    fault = FaultState(mode.name, size, 500.0)
    found = stopped((fault,), (fault,), MODES, 800.0, 1400.0)
    assert len(found) == len(REACHED)
    for (rest,), _ in found:
        assert continues(rest, fault, MODES) and not continues(fault, rest, MODES)
        assert rest.onset_s == 500.0 and abs(rest.severity) <= abs(size) * 900.0


def test_another_direction_or_quantity_continues_nothing() -> None:
    assert not continues(FaultState("T1_reads_high", 3.0, 1000.0), DRIFTED, MODES)
    assert not continues(FaultState("unknown_heat_R1", -2.0, 1000.0), GROWN, MODES)
    assert not continues(FaultState("unknown_mass_R1", 2.0, 1000.0), GROWN, MODES)
    assert continues(GROWN, GROWN, MODES)


def test_half_a_turn_of_what_swings_looked_like_what_lasts_or_grows() -> None:
    swings = FaultState("T1_swings", 3.0, 1000.0, 300.0)
    for before in ("T1_reads_high", "T1_reads_low", "T1_drifts_down"):
        assert continues(swings, FaultState(before, 3.0, 1000.0), MODES)
        assert not continues(FaultState(before, 3.0, 1000.0), swings, MODES), "what swung does not just stay there"
    assert not continues(swings, FaultState("L1_reads_high", 3.0, 1000.0), MODES)


def test_what_goes_on_swinging_began_when_it_did() -> None:
    known, again = FaultState("T1_swings", 3.0, 1003.0, 297.0), FaultState("T1_swings", 3.1, 2195.0, 299.0)
    back = turned_back(again, (known,), 2200.0)
    assert back is not None and back.period_s == 299.0 and abs(back.onset_s - known.onset_s) <= 0.5 * 299.0
    assert (again.onset_s - back.onset_s) / 299.0 == pytest.approx(4.0)
    assert turned_back(again, (), 2200.0) is None and turned_back(again, (known,), 900.0) is None
    assert turned_back(replace(again, fault="L1_swings"), (known,), 2200.0) is None
    assert turned_back(again, (known,), 2190.0) is None, "it begins in what is looked at, and was not there before"
    lasting_one = FaultState("T1_reads_high", 3.0, 2195.0)
    assert turned_back(lasting_one, (replace(lasting_one, onset_s=9.0),), 2200.0) is None


def test_half_a_turn_back_it_has_the_other_sign() -> None:
    """One swing is not said with two signs: bounds of its size would lie on both sides of nothing."""
    known, again = FaultState("T1_swings", 3.0, 1003.0, 300.0), FaultState("T1_swings", -3.1, 2195.0, 300.0)
    back = turned_back(again, (known,), 2200.0)
    assert back is not None and back.severity == 3.1 and abs(back.onset_s - known.onset_s) <= 0.5 * 300.0
    assert (again.onset_s - back.onset_s) / 300.0 % 1.0 == pytest.approx(0.5)


def test_what_is_young_or_lasts_did_not_stop() -> None:
    old = FaultState("unknown_heat_R1", 2.0, 1000.0)
    assert stopped((GROWN,), (), MODES, 1500.0, 2000.0) == []
    assert stopped((old,), (old,), MODES, 1500.0, 2000.0) == []


@pytest.mark.parametrize("later_s", [300, 900])
def test_a_heat_that_has_stopped_growing_is_said_to_last(later_s: int) -> None:
    """A heat that grew for ten minutes, and was known to grow, is one that lasts some time after that."""
    made = Disturbance.parse("T_ambient + 40 from 1500 over 600")
    truth = Scenario("cstr", (), 401, 4000.0, mismatch="plant", disturbances=(made,))
    link = SimulatedLink(open_process(reactor(), truth))
    seen = tuple(link.advance() for _ in range(2100 + later_s))
    twin = follow(seen[:2000], 401)
    for snapshot in seen[2000:]:
        twin.observe(snapshot)
    known = (FaultState("unknown_heat_R1_growing", 0.0055, 1500.0),)
    said = twin.explain([], known, since_s=1700.0, before=(Hypothesis(known, 1.0),), news=True)
    lasts = sum(h.probability for h in said if any(f.fault.startswith("unknown_heat_R1") for f in h.faults))
    grows = sum(h.probability for h in said if any(f.fault.endswith("_growing") for f in h.faults))
    assert lasts > 0.8 and grows < 0.3
