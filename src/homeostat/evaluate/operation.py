"""Operation: what Homeostat may do to the plant during a run, how fast time passes, and who orders anything."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from numbers import Real

from homeostat.domain.mode import Mode, PersonCommand
from homeostat.domain.observation import Observation
from homeostat.evaluate.recorded.resumption import Past
from homeostat.guard.settings import GuardSettings
from homeostat.journal import Setting
from homeostat.links.clock import DeclaredClock, ThinkingClock
from homeostat.recovery.exchange.pacing import Pacing


@dataclass(frozen=True, slots=True)
class Thinking:
    """How much process time thinking takes."""

    scale: float = 1.0
    """Process seconds per wall-clock second of thinking."""
    declared_s: float | None = None
    """Process time of every stretch of thinking [s]; None where it is measured."""

    def __post_init__(self) -> None:
        """ValueError where the clock would refuse it: better now than in the run."""
        self.clock()

    def clock(self) -> ThinkingClock | DeclaredClock:
        """A clock that has not run yet."""
        return ThinkingClock(self.scale) if self.declared_s is None else DeclaredClock(self.declared_s)

    @property
    def setting(self) -> Setting:
        """As the journal has it."""
        if self.declared_s is None:
            return Setting("thinking_scale", self.scale)
        return Setting("thinking_declared_s", self.declared_s)


def declared(process_s: float) -> Thinking:
    """Every stretch of thinking takes ``process_s``, whatever it took: equal seeds give equal runs [s].

    TypeError where that is no number, ValueError where it is not finite or negative.
    """
    if not _is_number(process_s):
        raise TypeError(f"process_s {process_s!r} must be a number of seconds, as 1.0")
    return Thinking(declared_s=process_s)


def _is_number(given: object) -> bool:
    return isinstance(given, Real) and not isinstance(given, bool)


UNHURRIED_S = 5.0
"""Longest wait for the journal where no plant waits meanwhile, wall-clock [s]."""


@dataclass(frozen=True, slots=True)
class Operation:
    """How a plant is operated; by default by itself, in virtual time."""

    mode: Mode = Mode.CLOSED_LOOP
    """Mode in which the guard begins; in observe and advise it cannot be given another one, as nobody can write."""
    pace: float | None = None
    """Process seconds per wall-clock second of a run in real time, where people decide; None for virtual time."""
    pacing: Pacing | None = None
    """What virtual time waits for between ticks; None for nothing, as fast as it goes."""
    orders: Callable[[], Iterable[PersonCommand]] = tuple
    """Asked at every tick for what people have ordered since the last one."""
    persons: int = 1
    """People who must agree to a reset."""
    past: Past | None = None
    """What the run goes on from; None for one that begins."""
    onlooker: Callable[[Observation], None] = lambda seen: None
    """Shown every tick of the guard; where it fails, that is an alarm and the run goes on."""

    def __post_init__(self) -> None:
        if self.pace is not None and not (math.isfinite(self.pace) and self.pace > 0.0):
            raise ValueError(f"pace {self.pace!r} must be finite and > 0 process seconds per second")
        if self.persons < 1:
            raise ValueError(f"persons {self.persons!r} must be at least 1")

    @property
    def guard(self) -> GuardSettings:
        """Times that the guard waits: in virtual time a slow disk must not decide what is released."""
        settings = GuardSettings(persons=self.persons)
        return settings if self.pace is not None else replace(settings, sync_s=UNHURRIED_S)

    @property
    def settings(self) -> tuple[Setting, ...]:
        """As the journal has them; none for a run that is operated by itself."""
        if self.mode is Mode.CLOSED_LOOP and self.pace is None and self.persons == 1:
            return ()
        paced = () if self.pace is None else (Setting("pace", self.pace),)
        return Setting("mode", self.mode.value), *paced, Setting("persons", self.persons)
