"""Every reading of the batch plant freezes: recovery has no news, and the guard trips when its grace time is over."""

from __future__ import annotations

import pytest

from homeostat.domain.events.recovery import Noticed, ReleasedActions
from homeostat.domain.events.trips import Tripped
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import scenario
from homeostat.guard.settings import GuardSettings
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import Arrangement, wire
from tests.equipment.links.misbehaving.link import Misbehaving
from tests.equipment.links.misbehaving.readings import ALL, Freeze

FROZEN_AFTER_S = 10.0
GRACE_S = 4.0


@pytest.mark.parametrize("from_s", [60.0, 150.0])
def test_recovery_does_not_act_on_an_old_picture_and_the_guard_trips_by_blindness(from_s: float) -> None:
    plant, trace = load_plant("mixing_module"), MemoryTrace()
    process = open_process(plant, scenario(plant, "none", 3, end_s=from_s + 30.0))
    link = Misbehaving(SimulatedLink(process), (Freeze(ALL, from_s),))
    wire(plant, link, DeclaredClock(1.0), trace, 3, Arrangement(guard=GuardSettings(sync_s=10.0))).run(link.source)
    events = [(e.at_s, e.event) for e in trace.entries if e.at_s >= from_s]
    assert not [e for _, e in events if isinstance(e, Noticed | ReleasedActions)]
    tripped = [at_s for at_s, e in events if isinstance(e, Tripped)]
    assert from_s + FROZEN_AFTER_S <= tripped[0] <= from_s + FROZEN_AFTER_S + GRACE_S
    acted = [(at_s, e.cause) for at_s, e in events if isinstance(e, WriteIntended) and e.cause is not Cause.SEQUENCE]
    assert acted[0] == (tripped[0], Cause.FALLBACK)


@pytest.mark.slow
@pytest.mark.parametrize("tag", [pytest.param("B203.level", marks=pytest.mark.wide), "B204.level", "B204.pressure"])
def test_no_transmitter_of_a_tank_that_freezes_has_a_limit_violated(tag: str) -> None:
    """What every step needs is decided by the other one of the tank; where it is not, nothing goes on filling."""
    plant, trace = load_plant("mixing_module"), MemoryTrace()
    process = open_process(plant, scenario(plant, "none", 3, end_s=180.0))
    link = Misbehaving(SimulatedLink(process), (Freeze(frozenset({tag}), 100.0),))
    wire(plant, link, DeclaredClock(1.0), trace, 3, Arrangement(guard=GuardSettings(sync_s=10.0))).run(link.source)
    assert not [e for e in trace.entries if isinstance(e.event, Tripped)]
