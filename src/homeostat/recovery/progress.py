"""Progress monitor: when the twin says that each later step is taken, and whether the plant deviates from that."""

import math
from collections.abc import Sequence

from homeostat.domain.observation import Observation
from homeostat.domain.recovery import Step
from homeostat.domain.verdict import Deviation, Rollout, StepBand


class ProgressMonitor:
    """Compares the steps that the sequencer takes with the times that were predicted for them."""

    def __init__(self, slack_s: float, repeat_s: float) -> None:
        """``slack_s``: how far outside the predicted times a step must be [s]; infinite where nothing is predicted.

        ``repeat_s``: two calls are at least this far apart [s].
        """
        self._slack_s, self._repeat_s = slack_s, repeat_s
        self._steps: tuple[Step, ...] = ()
        self._bands: tuple[StepBand, ...] = ()
        self._from_s = self._quiet_until_s = -math.inf
        self._forbidden_s: float | None = None
        self._early: Deviation | None = None

    def lacks(self, steps: Sequence[Step]) -> bool:
        """Whether nothing is predicted of ``steps``, which wait, and something should be."""
        return math.isfinite(self._slack_s) and bool(steps) and self._steps[len(self._steps) - len(steps) :] != steps

    def expect(self, steps: tuple[Step, ...], rollout: Rollout, from_s: float) -> None:
        """From process time ``from_s`` on the plant should do what ``rollout`` says of ``steps`` [s]."""
        self._steps, self._bands, self._from_s = steps, rollout.bands, from_s
        self._early, self._forbidden_s = None, None

    def follow(self, seen: Observation) -> None:
        """Take note of the states that the sequencer entered, at the latest after everything before was seen."""
        if seen.now_s <= self._from_s:
            return
        taken = len(self._steps) - len(seen.rest.then)
        for state, at_s in seen.entered:
            for step, band in zip(self._steps[:taken], self._bands, strict=False):
                if step.target == state and at_s < band.earliest_s - self._slack_s:
                    text = f"{state!r} is entered at {at_s:.0f} s, {band.earliest_s - at_s:.0f} s before the earliest"
                    self._early = Deviation(step.transition.name, band.earliest_s, band.latest_s, f"{text} prediction")

    def deviates(self, seen: Observation) -> Deviation | None:
        """The deviation in ``seen`` to be looked at; None where there is none, or it was reported not long ago."""
        waiting, at_s = seen.rest.then, seen.now_s
        if not waiting or self.lacks(waiting) or not self._bands:
            return self._called(self._early, at_s)
        if seen.refused is None:
            self._forbidden_s = None
        elif self._forbidden_s is None:
            self._forbidden_s = at_s
        return self._called(self._forbidden(seen, waiting[0]) or self._late(seen, waiting) or self._early, at_s)

    def _called(self, found: Deviation | None, at_s: float) -> Deviation | None:
        """``found``, unless there was a call not long ago."""
        if found is None or at_s < self._quiet_until_s:
            return None
        self._quiet_until_s, self._early = at_s + self._repeat_s, None
        return found

    def _band(self, waiting: Sequence[Step]) -> StepBand:
        return self._bands[len(self._steps) - len(waiting)]

    def _forbidden(self, seen: Observation, step: Step) -> Deviation | None:
        """Why the next step has been forbidden for longer than the slack."""
        if self._forbidden_s is None or seen.now_s - self._forbidden_s < self._slack_s:
            return None
        band = self._band(seen.rest.then)
        text = f"{step.target!r} is due and forbidden since {self._forbidden_s:.0f} s: {seen.refused}"
        return Deviation(step.transition.name, band.earliest_s, band.latest_s, text)

    def _late(self, seen: Observation, waiting: Sequence[Step]) -> Deviation | None:
        """By how much the next step is later than any member of the prediction took it."""
        band, step = self._band(waiting), waiting[0]
        if seen.now_s <= band.latest_s + self._slack_s:
            return None
        what = f"{step.transition.guard.text!r} does not hold" if seen.refused is None else seen.refused
        text = f"{what} at {seen.now_s:.0f} s, predicted by {band.latest_s:.0f} s"
        return Deviation(step.transition.name, band.earliest_s, band.latest_s, text)
