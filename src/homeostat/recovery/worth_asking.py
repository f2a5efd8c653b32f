"""Worth asking: whether one more answer of a proposer may win more than the plant loses until it is there."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Worth:
    """What one more answer may win, and what it costs to wait for it."""

    gain: float
    """What the best approved costs more than anything that may be proposed, in the plant's currency."""
    lost_per_s: float
    """What leaving the plant alone costs more than the best approved, per second, in the plant's currency [1/s]."""

    def pays(self, answer_s: float) -> bool:
        """Whether an answer that takes ``answer_s`` [s] may win anything, and no less than is lost meanwhile."""
        return self.gain > 0.0 and self.lost(answer_s) <= self.gain

    def lost(self, answer_s: float) -> float:
        """What is lost in ``answer_s`` [s], in the plant's currency."""
        return self.lost_per_s * answer_s

    @property
    def longest_s(self) -> float:
        """Longest answer that pays; infinite where waiting costs nothing [s]."""
        return self.gain / self.lost_per_s if self.lost_per_s > 0.0 else math.inf


class AnswerTimes:
    """Knows how long the answers of each proposer have taken in a run, in process time."""

    def __init__(self) -> None:
        """Nobody has answered yet."""
        self._taken: dict[str, tuple[int, float]] = {}

    def took(self, proposer: str, seconds: float) -> None:
        """An answer of ``proposer`` has taken so many ``seconds``."""
        count, total_s = self._taken.get(proposer, (0, 0.0))
        self._taken[proposer] = count + 1, total_s + max(seconds, 0.0)

    def expected_s(self, proposer: str) -> float:
        """How long the next one takes: the mean of its own; 0 before the first, which is asked for anyway [s]."""
        count, total_s = self._taken.get(proposer, (0, 0.0))
        return total_s / count if count else 0.0
