"""Postponing: the fallback, and what costs more than leaving alone does, is done when it must be and not before.

Meanwhile more is known: what swings comes back, and what was there for a while only has gone.
"""

import asyncio
import math
from collections.abc import Awaitable, Callable

from homeostat.agents.roles import Approved, Situation
from homeostat.domain.events.recovery import Attempted
from homeostat.domain.plant.timing import Timing
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.judging import Follow, Judged, Judging
from homeostat.recovery.scene import Scene

OFFERED_S = (300.0, 180.0, 90.0, 45.0, 20.0, 10.0, 5.0)
"""Waits that are tried, the longest first, by the reference [s]."""
LAST_S = (2.0, 1.0)
"""Waits that are tried as well before the fallback, by the reference: seconds may tell [s]."""
LAST_LOOK_S = 5.0
"""Time that is kept for a look at the plant before the guard falls back by itself, where what is wrong may pass,
by the reference [s]."""
PROPOSER = "search"
"""Who proposes these waits."""


class Postponing:
    """Adds the longest wait after which what is to be done is as safe as it is now."""

    def __init__(self, scene: Scene, judging: Judging, timing: Timing) -> None:
        """``judging`` says whether it may be waited, and what that costs; ``timing``: that of the plant."""
        self._scene, self._judging, self._timing = scene, judging, timing

    async def add_to(self, alternatives: Alternatives, situation: Situation, passes: bool, end: float) -> None:
        """Try waits before the fallback; until ``end``, by the event loop's clock [s].

        ``passes``: what is wrong need not last, and is waited for as long as the guard leaves time for another look.
        """
        answer_s = self._timing.time_s(LAST_LOOK_S) if passes else math.inf
        offered = (*OFFERED_S, *LAST_S)
        await self._try(
            lambda n, s: self._judging.postponement(PROPOSER, n, situation, s, answer_s), offered, alternatives, end
        )

    async def add_before(self, dear: Approved, alternatives: Alternatives, situation: Situation, end: float) -> None:
        """Try waits before what is approved and ``dear``; until ``end``, by the event loop's clock [s]."""
        follow = Follow.of(dear.actions, dear.path)
        await self._try(
            lambda n, s: self._judging.wait(PROPOSER, n, situation, s, follow), OFFERED_S, alternatives, end
        )

    async def _try(
        self,
        wait: Callable[[int, float], Awaitable[Judged]],
        offered_s: tuple[float, ...],
        alternatives: Alternatives,
        end: float,
    ) -> None:
        try:
            async with asyncio.timeout_at(self._scene.cut(end)):
                for number, seconds in enumerate(dict.fromkeys(self._timing.times_s(offered_s)), 1):
                    judged = await wait(number, seconds)
                    if judged.found is not None:
                        self._scene.record(Attempted.of(PROPOSER, judged.attempt))
                        alternatives.add(judged.found)
                        return
        except TimeoutError:
            return
