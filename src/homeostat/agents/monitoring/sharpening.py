"""Sharpening: after a release, parameters are learned from how the plant takes it."""

from homeostat.domain.diagnosis import Hypothesis, with_a_twin
from homeostat.domain.plant.timing import Timing
from homeostat.process.batch import ProcessError
from homeostat.twin.twin import Twin

MOVED_S = 60.0
"""After a release, the time by the reference in which the plant moves too fast to learn from [s]."""
STRAYED_S = 60.0
"""Readings of so long a time do, by the reference, of a plant that does not go as predicted [s]."""


class Sharpening:
    """Lets the twin learn where one fault, of whatever size, explains all since the release."""

    def __init__(self, twin: Twin, timing: Timing, review_s: float) -> None:
        """Readings of at most ``review_s`` are learned from; of half of it where the plant goes as predicted [s]."""
        self._twin, self._review_s = twin, review_s
        self._moved_s, self._strayed_s = timing.times_s((MOVED_S, STRAYED_S))
        self.released_s: float | None = None
        """When something was released last [s]; None where nothing was."""

    def learn(self, hypotheses: tuple[Hypothesis, ...], at_s: float, deviates: bool) -> None:
        """Learn from the readings until ``at_s`` [s] what ``hypotheses`` leave open.

        A plant that ``deviates`` from what was predicted has shown that its parameters are others where it is now: it
        is learned from sooner.
        """
        carried = with_a_twin(hypotheses)
        one = len(carried) == 1 or (len({h.name for h in carried}) == 1 and carried[0].between is not None)
        if self.released_s is None or not one:
            return
        seconds = min(at_s - self.released_s, self._review_s) - self._moved_s
        if seconds >= (self._strayed_s if deviates else self._review_s / 2):
            self._twin.recalibrate(seconds, carried)


def calibrated(twin: Twin, seconds: float) -> bool:
    """Have ``twin`` learn from the last ``seconds`` [s]; False where some of them are no state of the model."""
    try:
        twin.calibrate(seconds)
    except ProcessError:
        return False
    return True
