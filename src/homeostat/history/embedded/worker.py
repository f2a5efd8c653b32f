"""Work that is done beside: at times, and when it is asked for."""

import threading
from collections.abc import Callable
from typing import final


@final
class Worker:
    """A thread that does the same work again and again; what goes wrong is told and does not end it."""

    def __init__(self, name: str, work: Callable[[], None], told: Callable[[str], None], every_s: float) -> None:
        """Do ``work`` every ``every_s`` [s], and sooner when woken; ``told`` what went wrong."""
        self._work, self._told, self._every_s = work, told, every_s
        self._wanted, self._ended = threading.Event(), False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def wake(self) -> None:
        """Do the work soon; returns at once."""
        self._wanted.set()

    def end(self) -> None:
        """Return when the work that is under way is done; there is no more."""
        self._ended = True
        self._wanted.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended:
            self._wanted.wait(self._every_s)
            self._wanted.clear()
            if not self._ended:
                try:
                    self._work()
                except Exception as error:  # whatever it is: the next time may go well, and samples still come in
                    self._told(f"{self._thread.name}: {error or type(error).__name__}")
