"""The service of an attached plant as the page sees it: asked again and again, and how old its last answer is."""

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


@final
class Watched:
    """Asks from a thread of its own, which ends with the process; whoever looks at the page asks nobody."""

    def __init__(self, ask: Ask, gathered: Gathered, clock: Callable[[], float] = time.monotonic) -> None:
        """``ask`` is asked from now on, and ``gathered`` takes the readings; ``clock`` tells wall-clock seconds."""
        self._ask, self._gathered, self._clock = ask, gathered, clock
        self._told: tuple[Mapping[str, Any], float] | None = None
        self._trouble = "the service was not asked yet"

    def begin(self) -> None:
        """Ask from now on, in a thread."""
        threading.Thread(target=self._go_on, name="service", daemon=True).start()

    def look(self) -> None:
        """Ask once."""
        try:
            told = self._ask()
            sample = told.get("sample")
            if sample is not None:
                values = {tag: float("nan") if v is None else float(v) for tag, v in sample["values"].items()}
                self._gathered(Snapshot(float(sample["at_s"]), values))
        except ServiceSilent as silent:
            self._trouble = str(silent)
        except (AttributeError, KeyError, TypeError, ValueError) as error:  # of another version, or not a service
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
        sample, link = told.get("sample"), str((told.get("link") or {}).get("trouble") or "")
        age_s = None if sample is None else float(sample["age_s"]) + self._clock() - heard
        old = age_s is None or age_s > OLD_S
        why = trouble or (link and f"no connection to the plant: {link}") or "no sample comes from the plant"
        thinks = told.get("thinking") or {}
        nobody = "" if thinks.get("process") is not None else str(thinks.get("reason") or "it has not begun yet")
        return Fresh(None if age_s is None else round(age_s, 1), old, why if old else "", nobody)

    def _go_on(self) -> None:
        while True:
            self.look()
            time.sleep(_ASK_S)
