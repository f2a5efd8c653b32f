"""The service of an attached plant as the page sees it: asked again and again, and how old its last answer is."""

import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, final

from homeostat.console.readings import Gathered
from homeostat.domain.snapshot import Snapshot

Ask = Callable[[], Mapping[str, Any]]
"""Asks the service how the plant stands; ServiceSilent where it does not say."""
OLD_S: Final = 5.0
"""Age from which readings are old, wall-clock [s]."""
_ASK_S: Final = 0.5
"""Time between two questions, wall-clock [s]."""


class ServiceSilent(Exception):
    """The service does not answer; one line says why."""


@dataclass(frozen=True, slots=True)
class Fresh:
    """How fresh the page is."""

    age_s: float | None
    """How old the readings are, wall-clock [s]; None where none has come yet."""
    old: bool
    """Whether that is too old to act on."""
    trouble: str
    """Why; empty where they are not old."""
    thinking: str
    """Why nobody thinks about the plant; empty where somebody does."""


@dataclass(frozen=True, slots=True)
class _Told:
    """What an answer says of itself."""

    sample: Snapshot | None
    """The last sample; None where none has come yet."""
    age_s: float
    """How old it was [s]."""
    link: str
    """What is wrong with the connection to the plant; empty for nothing."""
    nobody: str
    """Why nobody thinks; empty where somebody does."""


@final
class Watched:
    """Asks from a thread of its own, which ends with the process; whoever looks at the page asks nobody."""

    def __init__(self, ask: Ask, gathered: Gathered, clock: Callable[[], float] = time.monotonic) -> None:
        """``ask`` is asked from now on, and ``gathered`` takes the readings; ``clock`` tells wall-clock seconds."""
        self._ask, self._gathered, self._clock = ask, gathered, clock
        self._told: tuple[_Told, float] | None = None
        self._trouble = "the service was not asked yet"

    def begin(self) -> None:
        """Ask from now on, in a thread."""
        threading.Thread(target=self._go_on, name="service", daemon=True).start()

    def look(self) -> None:
        """Ask once."""
        try:
            told = _read(self._ask())
            if told.sample is not None:
                self._gathered(told.sample)
        except ServiceSilent as silent:
            self._trouble = str(silent)
        except Exception as error:  # of another version, or not a service; whatever it says, it is asked again
            self._trouble = f"the service's answer cannot be read: {error!r}"
        else:
            self._told, self._trouble = (told, self._clock()), ""

    @property
    def fresh(self) -> Fresh:
        """How fresh everything is now."""
        held, trouble = self._told, self._trouble
        if held is None:
            return Fresh(None, True, trouble or "no answer came yet", "")
        told, heard = held
        age_s = None if told.sample is None else told.age_s + self._clock() - heard
        old = age_s is None or age_s > OLD_S
        why = trouble or (told.link and f"no connection to the plant: {told.link}") or "no sample comes from the plant"
        return Fresh(None if age_s is None else round(age_s, 1), old, why if old else "", told.nobody)

    def _go_on(self) -> None:
        while True:
            self.look()
            time.sleep(_ASK_S)


def _read(answer: Mapping[str, Any]) -> _Told:
    """What ``answer`` says; some exception where it is none of a service."""
    sample, thinks = answer.get("sample"), answer.get("thinking") or {}
    link = str((answer.get("link") or {}).get("trouble") or "")
    nobody = "" if thinks.get("process") is not None else str(thinks.get("reason") or "it has not begun yet")
    if sample is None:
        return _Told(None, math.nan, link, nobody)
    values = {tag: math.nan if v is None else float(v) for tag, v in sample["values"].items()}
    at_s, age_s = float(sample["at_s"]), float(sample["age_s"])
    if not math.isfinite(at_s) or not math.isfinite(age_s):
        raise ValueError(f"a sample of {at_s} s that is {age_s} s old")
    return _Told(Snapshot(at_s, values), age_s, link, nobody)
