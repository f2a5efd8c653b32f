"""A guard that a test decides about: it takes what it is asked, and answers on the next tick."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from homeostat.domain.mode import Mode
from homeostat.domain.observation import Message, Observation
from homeostat.domain.recovery import ActionSet
from homeostat.domain.request import Answer, Request
from homeostat.domain.snapshot import Snapshot

IDLE = ActionSet((), "running")


def observation(
    now_s: float, *answers: Answer, latched: str | None = None, mode: Mode = Mode.CLOSED_LOOP
) -> Observation:
    """A tick of a plant that stands in ``running``."""
    snapshot = Snapshot(now_s, {"T": 300.0})
    return Observation(now_s, snapshot, "running", IDLE, None, None, (), latched, mode, answers, snapshot)


class Scripted:
    """Takes messages between ticks and remembers when each was taken; ``answer`` says what a request gets."""

    def __init__(self, answer: Callable[[Request, float], Sequence[Answer]] = lambda request, at_s: ()) -> None:
        self._answer = answer
        self._waiting: list[Message] = []
        self.taken: list[tuple[float, Message]] = []
        self.ticks: list[float] = []
        self.latch_at_s = float("inf")
        self.mode_at: dict[float, Mode] = {}
        self._mode = Mode.CLOSED_LOOP

    def put(self, message: Message) -> None:
        self._waiting.append(message)

    def tick(self, now_s: float, sample: Snapshot | None) -> Observation:
        waiting, self._waiting = self._waiting, []
        self.ticks.append(now_s)
        self.taken += [(now_s, m) for m in waiting]
        answers = [a for m in waiting if isinstance(m, Request) for a in self._answer(m, now_s)]
        self._mode = self.mode_at.get(now_s, self._mode)
        return observation(now_s, *answers, latched="hot" if now_s >= self.latch_at_s else None, mode=self._mode)


class Seconds:
    """A source that samples once per second up to its end."""

    never_blocks = True

    def __init__(self, end_s: float, error: Exception | None = None, error_at_s: float = 0.0) -> None:
        self.now_s, self._end_s, self._error, self._error_at_s = 0.0, end_s, error, error_at_s

    @property
    def ended(self) -> bool:
        return self.now_s >= self._end_s

    def advance(self) -> Snapshot | None:
        self.now_s += 1.0
        if self._error is not None and self.now_s == self._error_at_s:
            raise self._error
        return Snapshot(self.now_s, {"T": 300.0})
