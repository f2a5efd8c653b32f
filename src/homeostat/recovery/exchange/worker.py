"""Worker: recovery in a thread of its own, with an event loop of its own; whatever ends it is an alarm."""

import asyncio
import contextlib
import threading
from collections.abc import Callable, Coroutine
from typing import Any

from homeostat.recovery.exchange.beside import DaemonExecutor
from homeostat.recovery.exchange.exchange import Exchange

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
        self._executor = DaemonExecutor()

    def start(self) -> None:
        """Begin; returns at once."""
        self._thread.start()

    def join(self, wall_s: float) -> bool:
        """Wait up to ``wall_s`` for recovery to end [s]; whether it has. What never yields is left behind."""
        self._thread.join(wall_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        for number in range(1, MOST + 1):
            if self._supervised(number):
                return
        self._exchange.give_up(f"recovery failed {MOST} times and is not begun again")

    def _supervised(self, number: int) -> bool:
        """Supervise in an event loop of its own, since what fails may have spoiled it; whether that came to its end.

        Whatever is raised here is a bug, be it a wish to end the process: a person's Ctrl-C reaches the main thread.
        """
        ended = False
        with contextlib.suppress(BaseException), asyncio.Runner() as runner:  # what is left in it may fail as well
            runner.get_loop().set_default_executor(self._executor)
            try:
                runner.run(self._supervise())
                ended = True
            except BaseException as error:  # told before what is left in the event loop is cancelled
                text = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
                self._alarm(f"recovery failed ({number} of {MOST}): {text}")
        return ended
