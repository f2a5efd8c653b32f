"""What is remembered of one trip limit: its sums, and for how long which of its instruments was doubted."""

import math
from dataclasses import dataclass


@dataclass(slots=True)
class Watched:
    """What is remembered of one limit."""

    raw: float = 0.0
    borne: float = 0.0
    corrected: float = 0.0
    blind_s: float = 0.0
    doubted_s: float = 0.0
    refuted_s: float = 0.0
    refuted: bool = False
    violated: bool = False
    disputed: bool = False
    disputed_s: float = 0.0
    begun: float = 0.0
    smooth: float = 0.0
    best: float = 0.0
    lifted_s: float = 0.0
    lifting: bool = False
    uncarried: float = 0.0
    uncarried_s: float = 0.0
    said: float = 0.0
    said_s: float = 0.0
    fell: bool = False
    fell_until_s: float = -math.inf

    def refute(self, contradicted: bool, dt_s: float, grace_s: float) -> None:
        """Add up for how long readings contradict what carries the limit.

        What they have contradicted for longer than ``grace_s`` [s] carries nothing until both agree for as long: one
        wild reading that agrees says nothing about it.
        """
        self.refuted_s = used(self.refuted_s, dt_s, grace_s, contradicted)
        self.refuted = self.refuted_s > (0.0 if self.refuted else grace_s)

    def bear(self, carried: float, counted_s: float, cusum: float) -> float:
        """The margin that counts where ``carried`` is that of what carries the limit.

        Its violations add up as those of the limit do, so that its noise does not trip. Until a trip it takes back what
        it has shown itself while the reading is not believed, and nothing that the reading has.
        """
        before, self.borne = self.borne, cumulated(self.borne, carried, counted_s, cusum)
        return carried if carried < 0.0 else (before - self.borne) / counted_s

    def hear(self, said: float, dt_s: float, counted_s: float, cusum: float) -> None:
        """Add up what the very reading says, and for how long, believed or not; NaN says nothing.

        What was not believed and has come back is forgotten.
        """
        if math.isnan(said):
            return
        self.said = cumulated(self.said, said, counted_s, cusum)
        if said >= 0.0:
            self.said = min(self.said, self.raw)
        self.said_s = self.said_s + dt_s if self.said > 0.0 else 0.0


def used(before_s: float, dt_s: float, grace_s: float, uses: bool) -> float:
    """How much of a grace time is used up after ``dt_s`` more; it comes back no faster than it was used [s].

    Otherwise one good reading now and then would put a trip off for ever.
    """
    return before_s + dt_s if uses else max(min(before_s, grace_s) - dt_s, 0.0)


def cumulated(before: float, margin: float, dt_s: float, most: float) -> float:
    """The cumulative sum after ``dt_s`` more at ``margin``; it stops a little above what trips, so that it can fall."""
    return min(max(0.0, before - margin * dt_s), most + (most or 1.0))
