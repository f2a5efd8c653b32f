"""The latest fallback by hindsight: how soon after a fault a strategy had to act; no agent may see it."""

from __future__ import annotations

import asyncio

from homeostat.campaign.best_route import inside
from homeostat.campaign.scenario import Scenario
from homeostat.campaign.unattended import build_plant
from homeostat.cases.case import Case
from homeostat.cases.wiring import fallbacks, new_sequencer
from homeostat.domain.recovery import FallbackStrategy
from homeostat.guard.gate import Gate
from homeostat.links.clock import DeclaredClock
from homeostat.recovery.release_check import TwinReleaseCheck
from homeostat.twin.twin import Twin


def latest_fallback(case: Case, scenario: Scenario, longest_s: int = 60) -> int | None:
    """Latest whole second after the first onset up to which some strategy keeps the plant inside every hard limit.

    None where acting at the onset does not; at most ``longest_s``.
    """
    assert scenario.onset_s is not None
    found: int | None = None
    for after_s in range(longest_s + 1):
        if not any(_keeps(case, scenario, s, scenario.onset_s + after_s) for s in fallbacks(case)):
            return found
        found = after_s
    return found


def _keeps(case: Case, scenario: Scenario, strategy: FallbackStrategy, at_s: float) -> bool:
    """Whether ``strategy`` keeps every hard limit and criterion to the end if it acts at ``at_s`` [s]."""
    sequencer = new_sequencer(case)
    plant = build_plant(case, scenario, DeclaredClock(0.0), sequencer)
    description = case.description
    twin = Twin(case.model, description, case.twin, scenario.seed)
    rehearsal = TwinReleaseCheck(twin, description.limits, description.tags_by_name)
    gate = Gate(plant, description.limits, fallbacks(case)[0], rehearsal, sequencer)
    gate.arm(strategy)

    async def watch() -> None:
        async for snapshot in plant.snapshots():
            if snapshot.at_s >= at_s and gate.latched is None:
                await gate.fall_back("hindsight")

    asyncio.run(watch())
    return inside(plant.truth(), description.limits)
