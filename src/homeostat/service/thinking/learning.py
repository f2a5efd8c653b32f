"""What an attached plant's recoveries leave in its playbook: an entry when released, and one with what came of it."""

from __future__ import annotations

import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, final

import numpy as np

from homeostat.agents.playbook.book import Book
from homeostat.domain.alarm import Priority
from homeostat.domain.events.recovery import Noticed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated, Tripped
from homeostat.domain.observation import Observation, Settled, Trouble
from homeostat.domain.playbook import Aftermath, Ending, Entry
from homeostat.domain.quotation import printable
from homeostat.domain.snapshot import Snapshot
from homeostat.journal import BrokenChain, Event, read_events
from homeostat.journal.memory import Entry as Line
from homeostat.plants.plant import Plant
from homeostat.plants.wired.recoveries import (
    WATCHED_S,
    Recoveries,
    Recovery,
    ending_of,
    entry_of,
    formula_tags,
    kept_margin,
)
from homeostat.record.decode import DecodeError, decode
from homeostat.record.playbook import PlaybookError, add_to_playbook
from homeostat.service.thinking.consulting import PLAYBOOK

RECENT: Final = 64
"""Samples among which the one is found by which something was noticed."""
GAP_S: Final = 60.0
"""Longest time without a sample in which nothing can have happened unseen, as in a guard that begins again [s]."""
AGAIN_S: Final = 60.0
"""Wait before a file that took no entry is tried again, wall-clock [s]."""
MOST: Final = 100
"""Most entries that wait for such a file; the oldest are dropped."""
ENDINGS: Final = frozenset((FallbackActivated.kind, Tripped.kind, ReleasedActions.kind))
"""Kinds of events that end the time for which a release is watched."""


@dataclass(slots=True)
class Watch:
    """A release whose ten minutes are not over."""

    entry: Entry
    """Its entry, as it was when its commands were released."""
    at_s: float
    """When that was [s]."""
    last_s: float
    """Until when the plant was seen since [s]."""
    ended: tuple[float, Ending] | None = None
    """When something was seen to end it [s], and what; None while nothing was."""
    rows: list[tuple[float, ...]] = field(default_factory=list)
    """Readings of what the worst criterion is judged by, one row a sample."""


@final
class Learning:
    """Follows what recovery says and what the guard sees; waits for no disk: a thread of its own writes."""

    def __init__(
        self, plant: Plant, book: Book, path: Path, journal: Path, send: Callable[[Trouble | Settled], object]
    ):
        """``book`` learns what is over; ``path``: the playbook's file; ``journal``: directory of the attached plant.

        ``send`` takes an alarm to the guard, and its end.
        """
        self._plant, self._book, self._journal = plant, book, journal
        self._watched_s = plant.description.timing.time_s(WATCHED_S)
        self._gap_s = max(GAP_S, 3.0 * plant.description.timing.tick_s)
        self._found, self._noticed = Recoveries(), Snapshot(0.0, {})
        self._recent: deque[Snapshot] = deque(maxlen=RECENT)
        self._watches: list[Watch] = []
        self._source = ""
        self._lock = threading.Lock()
        self._over: queue.SimpleQueue[Entry | Watch] = queue.SimpleQueue()
        self.writing = Writing(path, send)
        """Whoever adds to the file."""
        threading.Thread(target=self._learn_on, name="playbook", daemon=True).start()

    def begin(self, since: str, entries: tuple[Entry, ...]) -> None:
        """Releases of the journal that began at ``since`` are told by it; those in ``entries`` are watched on.

        ``entries``: what the playbook holds.
        """
        self._source = f"attached since {since}, "
        own = (e for e in entries if e.source.startswith(self._source) and e.configuration == self._plant.configuration)
        with self._lock:
            for entry in own:
                if entry.answer is not None and entry.aftermath is None:
                    at_s = float(entry.source.removeprefix(self._source).removesuffix(" s"))
                    self._watches.append(Watch(entry, at_s, at_s))

    def hear(self, event: Event, at_s: float) -> None:
        """Take one event of recovery, which happened at ``at_s`` [s]."""
        with self._spared(), self._lock:
            if isinstance(event, Noticed):
                seen = (s for s in self._recent if s.at_s >= at_s)
                self._noticed = next(seen, self._recent[-1] if self._recent else Snapshot(at_s, {}))
            if isinstance(event, ReleasedActions):
                for watch in self._watches:
                    if watch.at_s < at_s:
                        watch.ended = watch.ended or (at_s, Ending.REPLACED)
                self._end()
            if (one := self._found.after(event, at_s)) is not None:
                self._watch(one)

    def see(self, seen: Observation) -> None:
        """Take one tick of the guard."""
        sample = seen.sample or seen.snapshot
        with self._spared(), self._lock:
            self._found.mode = seen.mode.value
            if sample is not None:
                self._recent.append(sample)
            for watch in self._watches:
                if seen.now_s > watch.at_s:
                    self._follow(watch, seen, sample)
            self._end()

    @contextmanager
    def _spared(self) -> Iterator[None]:
        """A recovery is worth more than its entry: what fails here costs the entry alone, and is an alarm."""
        try:
            yield
        except Exception as error:
            self.writing.tell(f"an entry of the playbook was lost: {error!r}")

    def _follow(self, watch: Watch, seen: Observation, sample: Snapshot | None) -> None:
        end_s = watch.at_s + self._watched_s
        if min(seen.now_s, end_s) - watch.last_s > self._gap_s:
            watch.ended = watch.last_s, Ending.CUT_SHORT
        elif seen.latched is not None:
            watch.ended = min(seen.now_s, end_s), Ending.FELL_BACK
        elif seen.now_s >= end_s:
            watch.ended = end_s, Ending.HELD
        elif sample is not None:
            tags = sorted(formula_tags(self._plant.description, watch.entry))
            watch.last_s = seen.now_s
            watch.rows.append(tuple(sample.values.get(tag, math.nan) for tag in tags))

    def _end(self) -> None:
        """Hand over what is over."""
        for watch in [w for w in self._watches if w.ended is not None]:
            self._watches.remove(watch)
            self._over.put(watch)

    def _watch(self, one: Recovery) -> None:
        entry = entry_of(self._plant, one, self._noticed, f"{self._source}{one.at_s!r} s")
        self._watches.append(Watch(entry, one.at_s, one.at_s))
        self._over.put(entry)

    def _learn_on(self) -> None:
        while True:
            try:
                given = self._over.get(timeout=AGAIN_S)
            except queue.Empty:
                self.writing.again()
                continue
            with self._spared():
                entry = self._finished(given) if isinstance(given, Watch) else given
                if entry.aftermath is not None:
                    self._book.add(entry)
                self.writing.add(entry)

    def _finished(self, watch: Watch) -> Entry:
        """The entry of ``watch``, with what came of it: the journal knows more than was seen here."""
        assert watch.ended is not None
        seen_s, ending = watch.ended
        cut_s = seen_s if ending is Ending.CUT_SHORT else math.inf
        told_s, told = ending_of(list(self._journalled(watch.at_s)), watch.at_s, cut_s, self._watched_s)
        if ending is Ending.CUT_SHORT or told_s <= seen_s:  # what happened unseen is journalled
            seen_s, ending = told_s, told
        plant, tags = self._plant.description, sorted(formula_tags(self._plant.description, watch.entry))
        table = np.asarray(watch.rows, dtype=np.float64).reshape(len(watch.rows), len(tags))
        signals = {tag: table[None, :, column] for column, tag in enumerate(tags)}
        kept = kept_margin(plant, watch.entry, signals, plant.timing.tick_s)
        return replace(watch.entry, aftermath=Aftermath(ending, seen_s - watch.at_s, kept))

    def _journalled(self, at_s: float) -> Iterator[Line]:
        """What the journal has of the time of watching that began at ``at_s`` [s]."""
        try:
            for record in read_events(self._journal, ENDINGS):
                if record.kind in ENDINGS and at_s < record.happened_s < at_s + self._watched_s:
                    event = decode(record)
                    if event is not None:
                        yield Line(record.happened_s, event)
        except (OSError, BrokenChain, DecodeError):
            return  # what was seen counts; that the journal cannot be read is told by others


@final
class Writing:
    """Adds entries to the file of a playbook; what it does not take waits, and is an alarm."""

    def __init__(self, path: Path, send: Callable[[Trouble | Settled], object]) -> None:
        """``path``: the file; ``send`` takes an alarm to the guard, and its end."""
        self._path, self._send = path, send
        self._waiting: deque[Entry] = deque(maxlen=MOST)
        self._tried = -math.inf
        self.trouble: Trouble | None = None
        """Why the file takes nothing; None where it does."""

    def add(self, entry: Entry) -> None:
        """Add ``entry``, after what waits."""
        self._waiting.append(entry)
        self._write()

    def again(self) -> None:
        """Try to add what waits, where it was not tried just now."""
        if self._waiting and time.monotonic() - self._tried >= AGAIN_S:
            self._write()

    def tell(self, cause: str) -> None:
        """Have the guard raise an alarm for ``cause``, once."""
        if self.trouble is None or self.trouble.cause != cause:
            self.trouble = Trouble(PLAYBOOK, cause, Priority.LOW)
            self._send(self.trouble)

    def _write(self) -> None:
        self._tried = time.monotonic()
        try:
            add_to_playbook(self._path, tuple(self._waiting))
        except (OSError, PlaybookError) as error:
            words = (
                f"{str(self._path)!r} cannot be used: {error.strerror}" if isinstance(error, OSError) else str(error)
            )
            self.tell(f"the playbook was not added to: {printable(words)}; it is tried again")
            return
        self._waiting.clear()
        if self.trouble is not None:
            self.trouble = None
            self._send(Settled(PLAYBOOK))
