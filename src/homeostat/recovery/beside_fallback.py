"""Beside the fallback: where nothing is approved, a refused proposal that is as safe as falling back is released."""

import asyncio
import math
from collections.abc import Sequence

from homeostat.agents.roles import Situation
from homeostat.domain.advice import Attempt
from homeostat.domain.events.recovery import Attempted
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.judging import Judging
from homeostat.recovery.scene import Scene

MOST = 6
"""Most proposals that are tried in one recovery, the cheapest first."""


class BesideFallback:
    """Adds the cheapest refused proposal that violates only what the best fallback violates as well, and no worse."""

    def __init__(self, scene: Scene, judging: Judging) -> None:
        """``judging`` compares a proposal with the fallback."""
        self._scene, self._judging = scene, judging

    async def add_to(
        self, alternatives: Alternatives, situation: Situation, tried: Sequence[tuple[str, Attempt]], end: float
    ) -> None:
        """Judge what was ``tried``, each with who proposed it; until ``end``, by the event loop's clock [s]."""
        ranked = sorted(tried, key=lambda one: math.inf if one[1].cost is None else one[1].cost.total)
        seen: set[str] = set(alternatives.refused)
        try:
            async with asyncio.timeout_at(self._scene.cut(end)):
                for by, attempt in ranked:
                    if attempt.actions is None or attempt.actions.digest in seen or len(seen) >= MOST:
                        continue
                    seen.add(attempt.actions.digest)
                    judged = await self._judging.no_worse(by, situation, attempt)
                    if judged.found is not None:
                        self._scene.record(Attempted.of(by, judged.attempt))
                        alternatives.add(judged.found)
                        return
        except TimeoutError:
            return
