"""Hearing: what was put into the mailbox since the last tick, taken to whoever it is for."""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from itertools import islice
from typing import Any

from homeostat.domain.alarm import Priority
from homeostat.domain.observation import Arm, Correction, Trouble
from homeostat.domain.snapshot import Snapshot
from homeostat.guard.fallback.latch import Latch
from homeostat.guard.fallback.wanted import TimeToAct
from homeostat.guard.mailbox import Mailbox
from homeostat.guard.parts import Parts
from homeostat.guard.texts import said

MOST_HEARD = 50
"""Most messages of one kind that are heard in a tick, requests and orders apart, and most fallbacks in a ranking."""


class Hearing:
    """Hears all requests and orders, and so much of everything else; ranks the fallbacks itself."""

    def __init__(
        self,
        mailbox: Mailbox,
        parts: Parts,
        latch: Latch,
        time: TimeToAct,
        takers: Mapping[type, Callable[[Any], None]],
    ) -> None:
        """``takers``: kind of message -> who takes it, but of :class:`Arm`, which ranks what ``latch`` has act."""
        self._mailbox, self._parts, self._latch, self._time = mailbox, parts, latch, time
        self._takers = takers

    def hear(self, readings: Snapshot | None, now_s: float) -> None:
        """Take everything that waits at ``now_s`` [s], the oldest first; a message that cannot be taken is an alarm."""
        heard: Counter[type] = Counter()
        for message in self._mailbox.take():
            heard[type(message)] += 1
            try:
                if heard[type(message)] > MOST_HEARD and isinstance(message, Arm | Correction | Trouble):
                    raise ValueError(f"more than {MOST_HEARD} messages of this kind came at once")
                if isinstance(message, Arm):
                    self._arm(message, readings, now_s)
                else:
                    self._taker(message)(message)
            except BaseException as error:  # a message may be anything
                text = f"a message could not be taken: {said(error)}"
                self._parts.alarms.say("mailbox", text, Priority.LOW, now_s)

    def _taker(self, message: object) -> Callable[[Any], None]:
        for kind, take in self._takers.items():
            if isinstance(message, kind):
                return take
        raise ValueError(f"nobody knows what {type(message).__name__!r} asks for")

    def _arm(self, message: Arm, readings: Snapshot | None, now_s: float) -> None:
        """Rank the fallbacks, and take note of a time by which recovery must have acted.

        It only comes nearer, unless a wait is over and it is said ``anew``.
        """
        if self._latch.reason is not None:
            return  # one is acting already, in the order in which they were ranked
        by_s = message.act_by_s
        if by_s is not None and not math.isfinite(by_s):
            raise ValueError(f"fallbacks cannot be armed to act by {by_s!r} s")
        names = tuple(islice(message.strategies, MOST_HEARD + 1))
        if len(names) > MOST_HEARD:
            raise ValueError(f"more than {MOST_HEARD} fallbacks cannot be ranked")
        for line in self._latch.fallbacks.arm(names, readings, self._parts.service.tags):
            self._parts.alarms.say("arming", line, Priority.MEDIUM, now_s)
        if message.tried is not True:
            self._latch.fallbacks.armed = ""
        self._time.arm(by_s, now_s, anew=message.anew is True)
