"""Worker: recovery in a thread of its own, with an event loop of its own; a bug in it is an alarm."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from typing import Any

from homeostat.recovery.beside import DaemonExecutor
from homeostat.recovery.exchange import Exchange

MOST = 3
"""Bugs after which recovery is lost."""


class Worker:
    """Runs recovery beside the guard's loop."""

    def __init__(
        self, exchange: Exchange, supervise: Callable[[], Coroutine[Any, Any, None]], alarm: Callable[[str], None]
    ) -> None:
        """``supervise`` reads from ``exchange`` until there is nothing more; ``alarm`` is told of every bug in it."""
        self._exchange, self._supervise, self._alarm = exchange, supervise, alarm
        self._thread = threading.Thread(target=self._run, name="recovery", daemon=True)
        self.left: BaseException | None = None
        """What ended recovery for good, where it is no error but somebody's wish to end the run; None otherwise."""

    def start(self) -> None:
        """Begin; returns at once."""
        self._thread.start()

    def join(self, wall_s: float) -> bool:
        """Wait up to ``wall_s`` for recovery to end [s]; whether it has. What never yields is left behind."""
        self._thread.join(wall_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            with asyncio.Runner() as runner:
                runner.get_loop().set_default_executor(DaemonExecutor())
                runner.run(self._restarting())
        except BaseException as error:  # nobody sees what a thread raises: whoever drives the loop raises it again
            self.left = error
            self._exchange.give_up(f"recovery was ended by {type(error).__name__}")

    async def _restarting(self) -> None:
        for number in range(1, MOST + 1):
            try:
                await self._supervise()
                return
            except Exception as error:  # recovery may be wrong in any way; the plant is watched all the same
                text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
                self._alarm(f"recovery failed ({number} of {MOST}): {text}")
        self._exchange.give_up(f"recovery failed {MOST} times and is not begun again")
