"""Certifying: everything in the list of a recovery has a certificate, by the same draws, where there is time for it."""

import asyncio

from homeostat.agents.certificates import interval
from homeostat.agents.roles import Simulation
from homeostat.domain.alarm import Priority
from homeostat.domain.certificate import Certificate
from homeostat.domain.diagnosis import Diagnosis
from homeostat.recovery.alternatives import Alternatives
from homeostat.recovery.bounds import RiskBounds
from homeostat.recovery.scene import Scene

SHARE = 0.1
"""Of the time that is left to release something, as much as this is spent on what people are to read [1]."""
FAILED = "certificates"
"""Alarm of a list that has none because counting breaks down."""


class Certifying:
    """Bounds how likely each alternative is to violate a hard limit.

    Nothing is decided by it: what is released has a certificate of its own, from the release check, on more draws.
    """

    def __init__(self, scene: Scene, simulation: Simulation, risk: RiskBounds) -> None:
        """``risk`` says by how many draws, and how sure."""
        self._scene, self._simulation, self._risk = scene, simulation, risk

    async def add_to(self, alternatives: Alternatives, diagnosis: Diagnosis, end: float) -> None:
        """Give each of the ``alternatives`` a certificate that has none, as far as that is in before ``end`` [s].

        ``end`` is when thinking is cut off, by the event loop's clock. What is only to be read ends nothing: where
        counting breaks down, the list has no certificates, and people are told.
        """
        draws, now = min(self._risk.listed, self._risk.most), asyncio.get_running_loop().time()
        courses = alternatives.uncertified(self._scene.now.rest)
        if not draws or not courses or end <= now:
            return
        found: list[Certificate | None] = []
        try:
            async with asyncio.timeout_at(self._scene.cut(now + SHARE * (end - now))):
                async for violations in self._simulation.violations(diagnosis, courses, draws):
                    beside = courses[len(found)].beside is not None
                    found.append(None if violations is None else self._certificate(draws, violations, beside))
        except TimeoutError:
            pass
        except Exception as broken:
            self._scene.alarm(FAILED, f"risks of what could be done are not known: {broken!r}", Priority.LOW)
        else:
            self._scene.well(FAILED)
        alternatives.certify([*found, *[None] * (len(courses) - len(found))])

    def _certificate(self, draws: int, violations: int, beside: bool) -> Certificate:
        level = self._risk.level
        bound = interval(draws, violations, level, self._risk.required)[1]
        return Certificate(draws, violations, bound, level, beside)
