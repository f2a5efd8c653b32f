"""The inbox of a run: an order is one small file, delivered whole and taken once."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, final

from homeostat.domain.mode import PersonCommand
from homeostat.journal.beside.files import MANIFEST, write_whole
from homeostat.service.answers import is_written
from homeostat.service.order import ENDING, IDENTIFIER, OrderError, read, run_identity, written

INBOX: Final = "inbox"
"""Folder of the run directory that orders are put into."""
TAKEN: Final = "taken"
"""Folder of the inbox that they are moved to."""
MOST: Final = 20
"""Most orders that are taken at a time."""
MOST_SEEN: Final = 1000
"""Most entries of the folder that are looked at, at a time."""


@final
class Inbox:
    """The end at which a run takes what people order; nothing that lies there can end the run."""

    def __init__(self, run_dir: Path, clock: Callable[[], float] = time.time) -> None:
        """Make the inbox of the run in ``run_dir``; OSError where that cannot be done.

        ``clock`` tells the seconds since 1970, by which orders grow old.
        """
        self._clock = clock
        self._run_dir, self._folder = run_dir, run_dir / INBOX
        self._taken = self._folder / TAKEN
        self._taken.mkdir(parents=True, exist_ok=True)
        self._run = ""
        self._troubles: list[str] = []
        self._left: set[str] = set()

    def poll(self) -> tuple[PersonCommand, ...]:
        """Orders that came since the last call, by name, each once; never raises."""
        try:
            names = self._waiting()
            self._run = self._run or (run_identity(self._run_dir) if names else "")
        except (OSError, OrderError) as error:
            self._complain(f"the inbox cannot be read: {error}", INBOX)
            return ()
        return tuple(order for name in names if (order := self._take(name)) is not None)

    def take_troubles(self) -> tuple[str, ...]:
        """What could not be taken since this was last asked, one line each."""
        troubles, self._troubles = tuple(self._troubles), []
        return troubles

    def _waiting(self) -> list[str]:
        """Names of whole files that may be orders; links, folders and foreign files are none."""
        found = []
        with os.scandir(self._folder) as entries:
            for _, entry in zip(range(MOST_SEEN), entries, strict=False):
                stem, ending = os.path.splitext(entry.name)
                ours = ending == ENDING and IDENTIFIER.fullmatch(stem) and entry.name not in self._left
                if ours and entry.is_file(follow_symlinks=False):
                    found.append(entry.name)
        return sorted(found)[:MOST]

    def _take(self, name: str) -> PersonCommand | None:
        """Move order ``name`` away, then read it: who dies in between has not carried it out, and never will."""
        taken = self._taken / name
        try:
            (self._folder / name).replace(taken)
            return read(taken, self._run, self._clock())
        except (OSError, OrderError) as error:
            self._complain(f"order {name!r} is not taken: {error}", name)
            return None

    def _complain(self, text: str, name: str) -> None:
        """Keep ``text`` as a trouble; what cannot be moved is complained of once."""
        if name not in self._left and len(self._troubles) < MOST:
            self._troubles.append(" ".join(text.split())[:500])
        if len(self._left) < MOST_SEEN and (name == INBOX or (self._folder / name).exists()):
            self._left.add(name)


def refuse_unattended(run_dir: Path) -> None:
    """OrderError where nobody takes orders of the run in ``run_dir``: not begun, over, left, or not to be talked to."""
    run_identity(run_dir)
    if (run_dir / MANIFEST).exists():
        raise OrderError(f"run {str(run_dir)!r} is over; there is nobody left to order anything")
    if not is_written(run_dir):
        raise OrderError(
            f"run {str(run_dir)!r} does not go on: it was killed or broke off; 'homeostat resume' goes on with it"
        )
    if not (run_dir / INBOX).is_dir():
        raise OrderError(f"run {str(run_dir)!r} takes no orders; start it with --mode approve, or with --pace")


def post(run_dir: Path, command: PersonCommand, clock: Callable[[], float] = time.time) -> None:
    """Put an order into the inbox of the run in ``run_dir``, issued now by ``clock``, in seconds since 1970.

    Raises:
        OrderError: nobody takes orders of the run, or the order is not one.
        OSError: the file cannot be written.
    """
    content = written(command, run_identity(run_dir), clock())
    refuse_unattended(run_dir)
    write_whole(run_dir / INBOX / f"{command.id}{ENDING}", content)


def take_back(run_dir: Path, order: str) -> bool:
    """Remove the order with this identifier that nobody has taken; whether it was still there."""
    try:
        (run_dir / INBOX / f"{order}{ENDING}").unlink()
    except OSError:
        return False
    return True
