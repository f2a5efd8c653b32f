"""The loop that drives link, guard and recovery, tick by tick: in virtual time, or in scaled real time."""

import time
from collections.abc import Callable
from typing import Protocol

from homeostat.domain.observation import Observation
from homeostat.domain.ports import Source
from homeostat.domain.snapshot import Snapshot
from homeostat.recovery.exchange.exchange import Exchange
from homeostat.recovery.exchange.pacing import Pacing
from homeostat.recovery.exchange.reading import Reader

Hook = Callable[[Observation], None]
"""Called with every observation before recovery sees it."""


class Decides(Protocol):
    """What the loop needs of the guard."""

    def tick(self, now_s: float, sample: Snapshot | None) -> Observation:
        """Decide once, with a sample or its absence; never raises."""
        ...


class Loop:
    """Reads, decides and publishes, once per tick; recovery is cancelled by what overtakes it."""

    def __init__(self, guard: Decides, source: Source, exchange: Exchange, hook: Hook = lambda seen: None) -> None:
        """``hook`` is shown every tick, and may put messages into the guard's mailbox."""
        self._guard, self._exchange, self._hook = guard, exchange, hook
        self._reader = Reader(source, exchange.report, exchange.settle)
        self._before: Observation | None = None

    def run_virtual(self, tick_s: float = 1.0, pacing: Pacing | None = None) -> None:
        """Tick until the source ends, as fast as recovery's charged thinking lets the plant go on.

        ``pacing`` has it wait between ticks, which changes nothing that happens. A source that has lost its clock is
        taken to go on by ``tick_s`` at a tick [s]. Raises ProcessError where a simulated plant leaves the physical
        world.
        """
        try:
            while not self._reader.ended:
                self._tick(tick_s)
                self._exchange.hold()
                if pacing is not None:
                    pacing.wait(tick_s, self._exchange.at_rest)
        finally:
            if pacing is not None:
                pacing.end()
            self._exchange.close()

    def run_paced(self, scale: float, tick_s: float = 1.0) -> None:
        """Tick until the source ends, ``scale`` process seconds per wall-clock second, ``tick_s`` apart [s].

        Recovery thinks meanwhile; a tick that comes late is made up for. Raises as :meth:`run_virtual`.
        """
        due = time.monotonic()
        try:
            while not self._reader.ended:
                self._tick(tick_s)
                due += tick_s / scale
                time.sleep(max(due - time.monotonic(), 0.0))
        finally:
            self._exchange.close()

    def _tick(self, tick_s: float) -> None:
        """One tick: a sample or its absence, one decision, and whoever thinks is told or overtaken."""
        now_s, sample = self._reader.read(tick_s)
        seen = self._guard.tick(now_s, sample)
        before, self._before = self._before, seen
        try:
            self._hook(seen)
        except Exception as error:  # whoever looks on may fail; the plant is watched all the same
            self._exchange.report("onlooker", f"what is shown every tick failed: {error or type(error).__name__}")
        self._exchange.publish(seen, None if before is None else overtaken_by(before, seen))


def overtaken_by(before: Observation, now: Observation) -> str | None:
    """What in ``now`` overtakes thinking that began under ``before``; None where it may go on."""
    if now.latched is not None and before.latched is None:
        return f"the fallback was activated: {now.latched}"
    if now.latched is None and before.latched is not None:
        return "the latch was reset"
    if now.mode is not before.mode:
        return f"the mode is {now.mode.value} now"
    return None
