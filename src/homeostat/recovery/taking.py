"""Taking: what was chosen from the list is done: released, released for a while, tried, or waited."""

from homeostat.agents.roles import Approved, Situation
from homeostat.domain.plant.limits import Owner
from homeostat.domain.verdict import Released
from homeostat.guard.requests.permissives import refusal
from homeostat.recovery.choices import Choice, Testing, Waiting
from homeostat.recovery.judging import TEST
from homeostat.recovery.probing import Probes
from homeostat.recovery.releasing import Overtaken, Refused, Releasing, Taken, Withdrawn
from homeostat.recovery.scene import Scene
from homeostat.recovery.waits import Waits


class Taking:
    """Does what was chosen; nothing is written but through :class:`Releasing`."""

    def __init__(self, scene: Scene, releasing: Releasing, probes: Probes, waits: Waits, again_s: float) -> None:
        """``probes`` begin tests; ``waits`` remember when the plant is to be looked at again.

        ``again_s``: after what was released beside the fallback [s].
        """
        self._again_s = again_s
        self._scene, self._releasing, self._probes, self._waits = scene, releasing, probes, waits

    async def take(self, chosen: Choice, situation: Situation) -> Taken:
        """What came of it; raises as :meth:`Releasing.release` does, Refused also where a test was not begun."""
        match chosen:
            case Waiting():
                await self._scene.look()
                if self._scene.now.state != situation.state:
                    raise Overtaken(f"the plant went on to {self._scene.now.state!r} before it was waited")
                return Taken(self._waits.wait(chosen), None, waiting=True)
            case Testing():
                try:
                    begun = await self._probes.take(chosen.admitted, situation, chosen.proposer)
                except (Withdrawn, TimeoutError) as failed:  # what else was found may be done all the same
                    raise Refused((refusal(TEST, str(failed), Owner.PLANNING),)) from failed
                if not isinstance(begun.outcome, Released):
                    raise Refused((refusal(TEST, "nobody writes in this mode, and a test is no advice"),))
                return begun
            case Approved():
                taken = await self._releasing.release(chosen, situation.diagnosis)
                # What was released only because the fallback does no better is nowhere to stay.
                seconds = chosen.for_s or (self._again_s if chosen.beside is not None else 0.0)
                if seconds and isinstance(taken.outcome, Released):
                    self._waits.hold(taken.outcome.at_s + seconds)
                return taken
