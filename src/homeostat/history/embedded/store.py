"""The writing side of a store in a folder: the log at once, tables beside, and what is dropped."""

import os
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Final, Self, final

from homeostat.history.embedded.layout import LOG, SegmentFile, hour_label
from homeostat.history.embedded.reading import EmbeddedHistory
from homeostat.history.embedded.retention import with_room
from homeostat.history.embedded.segment import SegmentWriter
from homeostat.history.embedded.tidying import Tidying, make, next_number
from homeostat.history.embedded.worker import Worker
from homeostat.history.samples import NO_TIME, Batch, Minutes, Series, Span
from homeostat.history.settings import HistorySettings, read_settings
from homeostat.history.store import HistoryError, Occurrence

_MOST_SAMPLES: Final = 1_500_000
"""Samples after which a segment ends, whatever its age: what is sorted at once stays small."""
_TIDY_S: Final = 30.0
"""Time after which what could not be made into a table is tried again [s]."""
_MOST_TROUBLES: Final = 100
"""Troubles that are kept until somebody asks."""


@final
class EmbeddedStore:
    """Implements :class:`homeostat.history.store.HistoryStore` in a folder.

    What is appended goes to the log with one system call, so that it outlives this process, and to the disk within
    `HistorySettings.sync_s`. A second thread makes tables of what the log holds. Any thread may call anything.
    """

    def __init__(self, folder: Path | str, settings: HistorySettings | None = None) -> None:
        """Open the store in ``folder``, which is made where there is none; its own settings where none are given.

        Raises HistoryError where ``folder`` holds something else or another process writes it, OSError where it cannot
        be written.
        """
        self._folder = Path(folder)
        self._lock = make(self._folder)
        try:
            self._settings = settings or read_settings(self._folder)
            self._reader = EmbeddedHistory(self._folder)
            self._troubles = list[str]()
            self._writing, self._syncing = threading.Lock(), threading.Lock()
            self._current: SegmentWriter | None = None
            self._full = list[SegmentWriter]()
            self._began_us = self._own_us = self._source_us = NO_TIME
            self._unsynced, self._open = False, True
            self._tidying = Tidying(self._folder, self._settings, self._tell)
            self._number = next_number(self._folder)
            for gap in self._tidying.gaps():
                self._tell(gap)
                now_us = time.time_ns() // 1000
                self.record(Occurrence(now_us, now_us, "history", str(self._folder), 500, gap))
        except BaseException:
            os.close(self._lock)
            raise
        self._syncer = Worker("sync of the history", self._sync_if_needed, self._tell, self._settings.sync_s)
        self._tidier = Worker("tables of the history", self._tidy, self._tell, _TIDY_S)
        self._tidier.wake()

    def append(self, batch: Batch) -> None:
        """Keep ``batch``; see the protocol."""
        if batch.tags:
            self._keep(batch.own_us, lambda segment: segment.append(batch))
            self._own_us = max(self._own_us, batch.own_us)
            self._source_us = max(self._source_us, int(batch.time_us.max()))

    def record(self, occurrence: Occurrence) -> None:
        """Keep an alarm or an event; see the protocol."""
        self._keep(occurrence.own_us, lambda segment: segment.record(occurrence))

    def sync(self) -> None:
        """Return when everything is safe from a power cut."""
        with self._syncing:
            with self._writing:
                full, current, self._unsynced = list(self._full), self._current, False
            try:
                for segment in full:
                    segment.sync()
                    segment.close()
                    self._full.remove(segment)
                if current is not None:
                    current.sync()
            except OSError:
                self._unsynced = True
                raise

    def retain(self) -> None:
        """Drop what the settings do not keep."""
        self._tidying.retain(self._now_us())

    def take_troubles(self) -> tuple[str, ...]:
        """What went wrong since this was last asked."""
        taken, self._troubles = tuple(self._troubles), []
        return taken

    def close(self) -> None:
        """Sync, make tables of everything, and give the store back."""
        with self._writing:
            if not self._open:
                return
            self._open = False
        self._syncer.end()
        self._tidier.end()
        try:
            with self._writing:
                self._end_segment()
            self.sync()
            try:
                self._tidy()
            except OSError as error:  # no room: the log keeps it, and the next to open the store makes tables of it
                self._tell(f"tables of the history: {error}")
        finally:
            os.close(self._lock)

    def tags(self) -> tuple[str, ...]:
        """Names of all tags."""
        return self._reader.tags()

    def extent(self) -> Span | None:
        """From the earliest source time to just after the latest one."""
        return self._reader.extent()

    def read(self, tags: Sequence[str], span: Span) -> Mapping[str, Series]:
        """Tag -> its samples inside ``span``."""
        return self._reader.read(tags, span)

    def minutes(self, tags: Sequence[str], span: Span) -> Mapping[str, Minutes]:
        """Tag -> its minutes inside ``span``."""
        return self._reader.minutes(tags, span)

    def last(self, tags: Sequence[str]) -> Mapping[str, Series]:
        """Tag -> its sample with the latest source time."""
        return self._reader.last(tags)

    def occurrences(self, span: Span) -> tuple[Occurrence, ...]:
        """Alarms and events inside ``span``."""
        return self._reader.occurrences(span)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _keep(self, own_us: int, write: Callable[[SegmentWriter], None]) -> None:
        def kept() -> None:
            with self._writing:
                if not self._open:
                    raise HistoryError(f"the history in {str(self._folder)!r} is closed; append before closing it")
                write(self._segment(own_us))
                self._unsynced = True

        # Between two tries nothing is held: what was acknowledged before is brought to the disk meanwhile.
        with_room(self._folder, kept, self._tell, self._tidying.ended)

    def _segment(self, own_us: int) -> SegmentWriter:
        """The segment for what arrives at ``own_us`` [us]: another one after a time, an hour, or many samples."""
        if (current := self._current) is not None and not current.empty:
            over = abs(own_us - self._began_us) >= self._settings.segment_s * 1e6
            next_hour = own_us > self._began_us and hour_label(own_us) != hour_label(self._began_us)
            if over or next_hour or current.samples >= _MOST_SAMPLES:
                self._end_segment()
                self._tidier.wake()
        if self._current is None:
            file = SegmentFile(self._number, hour_label(own_us), self._folder / LOG)
            self._current, self._began_us = SegmentWriter(file.path), own_us
            self._number += 1
        return self._current

    def _end_segment(self) -> None:
        if self._current is not None:
            self._full.append(self._current)
            self._current, self._unsynced = None, True

    def _sync_if_needed(self) -> None:
        if self._unsynced:
            self.sync()

    def _tidy(self) -> None:
        with self._writing:
            number = self._number - (self._current is not None)
        self._tidying.tidy(number, hour_label(self._began_us), self._now_us())

    def _now_us(self) -> int:
        """The latest time that both clocks agree on [us]: one that jumps ahead must not make everything old."""
        return min(self._own_us, self._source_us)

    def _tell(self, trouble: str) -> None:
        if trouble not in self._troubles[-1:] and len(self._troubles) < _MOST_TROUBLES:
            self._troubles.append(trouble)
