"""A further fault is found beside one that was known before, at once and also where that began long ago."""

from __future__ import annotations

import pytest

from homeostat.domain.diagnosis import FaultState, Hypothesis
from tests.twin.followed import follow, reactor, readings

STUCK = FaultState("inlet_stuck_open", 0.59, 1450.0)
LOW = FaultState("level_bias", 1.4, 1700.0)
TABLES = tuple(fault.name for fault in reactor().description.faults)


def components(found: tuple[Hypothesis, ...]) -> dict[frozenset[str], float]:
    """Components that are accused together -> how probable that is."""
    said: dict[frozenset[str], float] = {}
    for h in found:
        items = frozenset(reactor().description.fault_mode(f.fault).component for f in h.faults)
        said[items] = said.get(items, 0.0) + h.probability
    return said


@pytest.mark.slow
@pytest.mark.parametrize("after_s", [4, pytest.param(10, marks=pytest.mark.wide)])
def test_what_has_just_begun_is_seen_beside_a_fault_that_moves_far_more(after_s: int) -> None:
    """A level that jumps is no tenth of what an open valve does, although it is less than a tenth of it in all."""
    twin = follow(readings(3, int(LOW.onset_s) + after_s, (STUCK, LOW)), 3)
    found = twin.explain(TABLES, (STUCK,), since_s=STUCK.onset_s, before=(Hypothesis((STUCK,), 1.0),), news=True)
    shares = components(found)
    assert max(shares, key=shares.__getitem__) == {"V1", "LT1"} and shares.get(frozenset({"V1"}), 0.0) < 0.05


def test_what_began_before_the_readings_is_not_dropped_for_what_fits_alone() -> None:
    old, fouling = FaultState("level_bias", 1.4, 1450.0), FaultState("fouling", 0.8, 1800.0)
    twin = follow(readings(3, 2200, (old, fouling)), 3)
    found = twin.explain(TABLES, (old,), since_s=2190.0, before=(Hypothesis((old,), 1.0),), news=True)
    said = {frozenset(f.fault for f in h.faults) for h in found if h.probability >= 0.02}
    assert sum(h.probability for h in found if any(f.fault == "level_bias" for f in h.faults)) >= 0.8, said
