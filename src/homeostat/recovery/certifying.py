"""Certifying: everything in the list of a recovery has a certificate, by the same draws, where there is time for it."""

import asyncio

from homeostat.agents.certificates import interval
from homeostat.agents.roles import Simulation
from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import Diagnosis
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.bounds import RiskBounds
from homeostat.recovery.scene import Scene

SHARE = 0.1
"""Of the time that is left to release something, as much as this is spent on what people are to read [1]."""


class Certifying:
    """Bounds how likely each alternative is to violate a hard limit.

    Nothing is decided by it: what is released has a certificate of its own, from the release check, on more draws.
    """

    def __init__(self, scene: Scene, simulation: Simulation, risk: RiskBounds) -> None:
        """``risk`` says by how many draws, and how sure."""
        self._scene, self._simulation, self._risk = scene, simulation, risk

    async def add_to(self, alternatives: Alternatives, diagnosis: Diagnosis, end: float) -> None:
        """Give each of the ``alternatives`` a certificate that has none; none where it is not in before ``end`` [s].

        ``end`` is when thinking is cut off, by the event loop's clock.
        """
        draws = min(self._risk.listed, self._risk.most)
        courses = alternatives.uncertified(self._scene.now.rest)
        if not draws or not courses:
            return
        now = asyncio.get_running_loop().time()
        try:
            async with asyncio.timeout_at(self._scene.cut(now + SHARE * (end - now))):
                found = await self._simulation.violations(diagnosis, courses, draws)
        except TimeoutError:
            return
        beside = [course.beside is not None for course in courses]
        alternatives.certify([self._certificate(draws, *each) for each in zip(found, beside, strict=True)])

    def _certificate(self, draws: int, violations: int | None, beside: bool) -> Certificate | None:
        if violations is None:
            return None
        level = self._risk.level
        return Certificate(draws, violations, interval(draws, violations, level, self._risk.required)[1], level, beside)
