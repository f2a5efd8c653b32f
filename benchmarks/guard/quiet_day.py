"""A day without a fault and with everything on: guard, recovery, monitoring, twin, and a signed journal on a disk."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.guard.store import Sizes
from benchmarks.guard.timed import Memory, Timed
from homeostat.domain.events.people import AlarmRaised
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.events.writes import WriteIntended
from homeostat.journal import Journal
from homeostat.journal.events import Event
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedLink
from homeostat.links.truth.process import PlantConfiguration, TrueProcess
from homeostat.plants.plant import load_plant
from homeostat.plants.wired.assembly import wire
from homeostat.process.seeds import Stream, noise_seed

SEED = 1


class Counted:
    """Counts events by kind."""

    def __init__(self) -> None:
        self.kinds: dict[str, int] = {}
        self.alarms: list[str] = []

    def __call__(self, event: Event, at_s: float) -> None:
        self.kinds[event.kind] = self.kinds.get(event.kind, 0) + 1
        if isinstance(event, AlarmRaised) and len(self.alarms) < 20:
            self.alarms.append(f"{at_s:.0f} s: {event.alarm}: {event.cause}")


def measure(plant: str, sizes: Sizes) -> dict[str, Any]:
    """The day of ``plant``."""
    case = load_plant(plant)
    configuration = PlantConfiguration(
        case.true_parameters(SEED), case.start, (), sizes.days_s, noise_seed(SEED, Stream.TRUTH_NOISE)
    )
    link = SimulatedLink(TrueProcess(case.model, case.description, configuration, record=False))
    counted, memory, began = Counted(), Memory(), time.monotonic()
    with tempfile.TemporaryDirectory() as folder, Journal(Path(folder) / "run") as journal:
        journal.subscribe(counted)
        assembly = wire(case, link, DeclaredClock(1.0), journal, SEED)
        timed = Timed(assembly.guard)
        replace(assembly, guard=timed).run(link.source, memory)
        size_mb = sum(p.stat().st_size for p in Path(folder).rglob("*") if p.is_file()) / 1e6
    return {
        "plant": plant, "length_s": sizes.days_s, "wall_s": time.monotonic() - began,
        "ticks": len(timed.wall_s), "dropped": assembly.exchange.dropped, "decision": timed.summary(),
        "memory": memory.samples, "growth": memory.growth(), "journal_mb": size_mb,
        "fallbacks": counted.kinds.get(FallbackActivated.kind, 0), "writes": counted.kinds.get(WriteIntended.kind, 0),
        "kinds": counted.kinds, "alarms": counted.alarms,
    }  # fmt: skip
