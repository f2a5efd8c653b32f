"""Reading a plant in another process while this one loads what attaches it."""

from __future__ import annotations

import pickle
import subprocess
import sys
from types import TracebackType
from typing import TYPE_CHECKING, Self, final

if TYPE_CHECKING:
    from homeostat.cli.attaching.stated import Stated


@final
class Beside:
    """Begins to read at once, in a process that ends with that; a context manager, which leaves no process behind."""

    def __init__(self, plant: str) -> None:
        """``plant``: its name, or the path of its folder."""
        self._plant = plant
        # -P: what lies in the folder that the service was started in is no code of anybody's
        command = [sys.executable, "-P", "-m", "homeostat.cli.attaching", plant]
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, process_group=0  # a Ctrl-C is for whoever waits
        )  # fmt: skip

    def stated(self) -> Stated:
        """What the plant states, once that is read.

        Where the other process did not come to it, it is read here, and what is wrong with it is raised here.
        """
        from homeostat.cli.attaching.stated import stated

        read, _ = self._process.communicate()
        if self._process.returncode != 0:
            return stated(self._plant)
        found: Stated = pickle.loads(read)
        return found

    def __enter__(self) -> Self:
        """The reading itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """End it where nobody waits for it any more."""
        with self._process:
            self._process.kill()
