"""Waits: when a plant is looked at again that is left alone, or has got something, for a while only."""

import math
from dataclasses import dataclass

from homeostat.domain.diagnosis import Diagnosis
from homeostat.domain.events.recovery import Waited
from homeostat.domain.verdict import NoActionNeeded
from homeostat.recovery.choices import Waiting
from homeostat.recovery.scene import Scene

ROUNDED = 1e-9
"""What sums of shares are off by."""


@dataclass(frozen=True, slots=True)
class Ended:
    """What was under way when the plant was looked at."""

    waited: bool = False
    """Whether a wait or a hold was."""
    held: bool = False
    """Whether it was a hold."""
    whole: bool = False
    """Whether a wait or a test lasted as long as was said: the plant was as safe in it as with a fallback."""


class Waits:
    """Knows the one wait or hold that is under way, and how often it was waited until nothing is wrong any more.

    A wait that news have cut short counts for as much of it as there was.
    """

    def __init__(self, scene: Scene, most: int) -> None:
        """``most``: waits before something else is to be done."""
        self._scene, self._most = scene, most
        self._until_s: float | None = None
        self._held = False
        self._seconds, self._count = math.inf, 0.0

    @property
    def left(self) -> int:
        """How often it may still be waited."""
        return max(math.ceil(self._most - self._count - ROUNDED), 0)

    def due(self, now_s: float) -> bool:
        """Whether a wait or a hold is over and the plant was not looked at."""
        return self._until_s is not None and now_s >= self._until_s

    def drop(self) -> None:
        """A fallback acts: nobody waits any more."""
        self._until_s = None

    def end(self, diagnosis: Diagnosis) -> Ended:
        """The plant is looked at: what was under way."""
        if self._until_s is None:
            ended = Ended()
        else:
            left_s = max(self._until_s - self._scene.seen_s, 0.0)
            ended = Ended(waited=True, held=self._held, whole=not self._held and left_s == 0.0)
            self._count -= 0.0 if self._held else left_s / self._seconds
            self._until_s = None
        if not diagnosis.faulty:
            self._count = 0.0
        return ended

    def wait(self, found: Waiting) -> NoActionNeeded:
        """Leave the plant alone for a while; the armed fallback and the time to act by stay."""
        scene = self._scene
        self._count, self._held = self._count + 1.0, False
        self._seconds, self._until_s = found.seconds, scene.seen_s + found.seconds
        scene.record(Waited(found.proposer, found.seconds, found.follows, found.nuisance))
        return NoActionNeeded(scene.seen_s, found.approval.min_margin)

    def hold(self, until_s: float) -> None:
        """Something was released for a while, and the plant is looked at again at ``until_s`` [s]."""
        self._held, self._until_s = True, until_s
