"""How much process time thinking takes."""

from __future__ import annotations

from dataclasses import dataclass

from homeostat.journal import Setting
from homeostat.links.clock import DeclaredClock, ThinkingClock


@dataclass(frozen=True, slots=True)
class Thinking:
    """How much process time thinking takes."""

    scale: float = 1.0
    """Process seconds per wall-clock second of thinking."""
    declared_s: float | None = None
    """Process time of every stretch of thinking [s]; None where it is measured."""

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
    """Every stretch of thinking takes ``process_s``, whatever it took: equal seeds give equal runs [s]."""
    return Thinking(declared_s=process_s)
