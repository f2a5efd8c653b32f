"""Postponing: where nothing is approved, the fallback acts when it must and not before; meanwhile more is known."""

import asyncio

from homeostat.agents.roles import Situation
from homeostat.domain.events.recovery import Attempted
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.judging import Judging
from homeostat.recovery.scene import Scene

OFFERED_S = (300.0, 180.0, 90.0, 45.0, 20.0, 10.0, 5.0)
"""Waits that are tried, the longest first [s]."""
PROPOSER = "search"
"""Who proposes these waits."""


class Postponing:
    """Adds the longest wait after which falling back is as safe as it is now."""

    def __init__(self, scene: Scene, judging: Judging) -> None:
        """``judging`` says whether it may be waited, and what that costs."""
        self._scene, self._judging = scene, judging

    async def add_to(self, alternatives: Alternatives, situation: Situation, end: float) -> None:
        """Try them; until ``end``, by the event loop's clock [s]."""
        try:
            async with asyncio.timeout_at(end):
                for number, seconds in enumerate(OFFERED_S, 1):
                    judged = await self._judging.postponement(PROPOSER, number, situation, seconds)
                    if judged.found is not None:
                        self._scene.record(Attempted.of(PROPOSER, judged.attempt))
                        alternatives.add(judged.found)
                        return
        except TimeoutError:
            return
