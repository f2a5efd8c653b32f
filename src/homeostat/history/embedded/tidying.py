"""What is done beside: the log becomes tables, small tables become large ones, and what is not kept goes."""

import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import final

from homeostat.history.embedded.layout import (
    FORMAT,
    KINDS,
    LOG,
    MARK,
    PARTIAL,
    RAW,
    SegmentFile,
    listed,
    refuse_other,
    replaced,
    segments_of,
)
from homeostat.history.embedded.lock import LOCK, hold
from homeostat.history.embedded.names import add_names
from homeostat.history.embedded.retention import FULL, drop, too_much, too_old, with_room
from homeostat.history.embedded.sealing import compact, seal
from homeostat.history.embedded.segment import read_segment
from homeostat.history.samples import NO_TIME
from homeostat.history.settings import SETTINGS, HistorySettings
from homeostat.history.store import HistoryError
from homeostat.journal.beside.files import write_whole


def make(folder: Path) -> int:
    """Make a store of ``folder`` where it is none yet, and hold its lock; the descriptor of the lock.

    Raises HistoryError where it holds something else, or another process writes it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / MARK).exists():
        own = (SETTINGS, LOCK, LOG, *KINDS)  # a death may have come before the mark
        others = sorted(p.name for p in folder.iterdir() if p.name not in own and not p.name.startswith(f".{MARK}"))
        if others:
            text = f"{str(folder)!r} is no history, and holds {others[0]!r:.60}"
            raise HistoryError(f"{text}; choose a new or empty directory")
    lock = hold(folder)
    try:
        if not (folder / MARK).exists():
            for name in (LOG, *KINDS):
                (folder / name).mkdir(exist_ok=True)
            write_whole(folder / MARK, FORMAT.encode())
        refuse_other(folder)
    except BaseException:
        os.close(lock)
        raise
    return lock


def next_number(store: Path) -> int:
    """Number of the next segment, once what a death left half done is away."""
    for kind in KINDS:
        for partial in (store / kind).glob(f"*{PARTIAL}"):
            partial.unlink(missing_ok=True)
        drop(replaced(store, kind))
    tables = [table.last for kind in KINDS for table in listed(store, kind).tables]
    return max([*tables, *(segment.number for segment in segments_of(store))], default=0) + 1


@final
class Tidying:
    """Everything that may take seconds; one thread at a time."""

    def __init__(self, store: Path, settings: HistorySettings, told: Callable[[str], None]) -> None:
        """``told`` what went wrong, and what was dropped early."""
        self._store, self._settings, self._told = store, settings, told
        self._busy, self._said = threading.Lock(), set[str]()

    def gaps(self) -> Iterator[str]:
        """What is not whole in the log, as a death or the disk left it; one line each."""
        for segment in segments_of(self._store):
            content = read_segment(segment.path)
            for gap in content.gaps:
                what = "the last record was torn and is cut off" if gap.torn else "a record is damaged and is left out"
                yield f"{segment.path.name}: {what}: {gap.length} byte at {gap.at}"
            if content.lost:
                yield f"{segment.path.name}: {content.lost} samples have lost the names of their tags"

    def tidy(self, number: int, label: str, now_us: int) -> None:
        """Make tables of the segments before ``number``, join those of hours before ``label``, and drop what is old.

        What cannot be done for another reason than room is told once, and keeps nothing else from being done.
        ``now_us``: the latest time [us]; NO_TIME where nothing was appended. Raises OSError where there is no room.
        """
        try:
            with self._busy:
                for segment in segments_of(self._store):
                    if segment.number < number:
                        with_room(self._store, lambda s=segment: self._seal(s), self._told)  # type: ignore[misc]
                self._compact(label)
        finally:
            self.retain(now_us)

    def ended(self, within_s: float) -> bool:
        """Whether something was being done beside, and has ended within so many seconds."""
        if not self._busy.locked() or not self._busy.acquire(timeout=within_s):
            return False
        self._busy.release()
        return True

    def retain(self, now_us: int) -> None:
        """Drop what the settings do not keep; ``now_us`` as :meth:`tidy`."""
        with self._busy:
            if now_us != NO_TIME:
                drop(too_old(self._store, self._settings, now_us))
            drop(too_much(self._store, self._settings))

    def _compact(self, label: str) -> None:
        """Join tables; where there is no room for that, or some were dropped meanwhile, the next time will do."""
        try:
            compact(self._store, label)
        except FileNotFoundError:
            pass
        except HistoryError as damaged:
            self._tell_once(f"tables of the history are not joined: {damaged}")
        except OSError as error:
            if error.errno not in FULL:
                raise

    def _seal(self, segment: SegmentFile) -> None:
        """Make tables of ``segment``; what cannot become one stays in the log, where it is read."""
        if segment in listed(self._store, RAW).segments:  # else a death came between the table and this
            try:
                content = read_segment(segment.path)
                add_names(self._store, filter(None, content.names))
                seal(self._store, segment, content)
            except OSError:
                raise
            except Exception as error:  # whatever it is: those behind it are whole
                why = " ".join(f"{type(error).__name__}: {error}".split())[:300]
                self._tell_once(f"{str(segment.path)!r} stays in the log, no table can be made of it: {why}")
                return
        segment.path.unlink(missing_ok=True)

    def _tell_once(self, trouble: str) -> None:
        if trouble not in self._said:
            self._said.add(trouble)
            self._told(trouble)
