"""What arrives on a plant's wire, measured inside the simulated plant, against the attempts in the journal."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from benchmarks.guard.store import Sizes
from benchmarks.guard.timed import Timed
from homeostat.domain.events.recovery import ReleasedActions
from homeostat.domain.events.trips import FallbackActivated
from homeostat.domain.events.writes import Cause, WriteIntended
from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import scenario
from homeostat.journal import MemoryTrace
from homeostat.links.clock import DeclaredClock
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.wired.assembly import wire

PLANTS = {"cstr": (1450.0, 1800.0), "mixing_module": (None, None)}
"""Plant -> onset of a fault and end of the run [s]; the plant's own where None."""
SEED = 3


def faults(case: Plant, sizes: Sizes) -> list[str]:
    """The nominal run, and every fault that the plant's tables name."""
    return ["none", *[f.name for f in case.description.faults][: sizes.faults]]


def measure(plant: str, fault: str) -> dict[str, Any]:
    """One run of ``plant`` with ``fault``."""
    case, began = load_plant(plant), time.monotonic()
    onset_s, end_s = PLANTS[plant]
    asked = scenario(case, fault, SEED, onset_s=None if fault == "none" else onset_s, end_s=end_s)
    link, trace = SimulatedLink(open_process(case, asked)), MemoryTrace()
    assembly = wire(case, link, DeclaredClock(1.0), trace, seed=SEED)
    timed = Timed(assembly.guard)
    replace(assembly, guard=timed).run(link.source)
    intended = [(e.at_s, e.event) for e in trace.entries if isinstance(e.event, WriteIntended)]
    arrived = [(a.at_s, a.commands) for a in link.wire_log]
    return {
        "fault": fault, "ticks": len(timed.wall_s), "arrived": len(arrived), "intended": len(intended),
        "same": arrived == [(at_s, e.commands) for at_s, e in intended],
        "commands": sum(len(c) for _, c in arrived),
        "by": {cause.value: sum(e.cause is cause for _, e in intended) for cause in Cause},
        "released": sum(isinstance(e.event, ReleasedActions) for e in trace.entries),
        "fell_back": any(isinstance(e.event, FallbackActivated) for e in trace.entries),
        "decision": timed.summary(), "wall_s": round(time.monotonic() - began, 1),
    }  # fmt: skip
