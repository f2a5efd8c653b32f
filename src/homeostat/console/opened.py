"""A run that is shown: its journal, read again as it grows, its readings, and its plant."""

import fcntl
import threading
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from homeostat.console.card.card import Card
from homeostat.console.readings import Gathered, Readings, ReadingsError
from homeostat.console.situation import Situation, situation
from homeostat.console.watched import Fresh, Watched
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.flowsheet import Flowsheet
from homeostat.journal import BrokenChain, RunStarted
from homeostat.journal.beside.files import JOURNAL, MANIFEST
from homeostat.journal.memory import Entry
from homeostat.journal.tail import Tail
from homeostat.plants.page.layers import AS_FOUND, Corrections
from homeostat.record.decode import DecodeError, decode
from homeostat.record.directory import TRAJECTORY
from homeostat.record.figure.panel import Panel
from homeostat.record.story.line import Line
from homeostat.record.story.story import Story
from homeostat.recovery.exchange.pacing import Pace, Pacing

_TRUTH = frozenset({"onset", "run"})
"""Labels of lines that say what was truly wrong, which no operator knows."""
_UNTOLD = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError)
"""What words for a record of somebody else's making may run into."""


@dataclass(frozen=True, slots=True)
class KnownPlant:
    """What is known of a run's plant; nothing of its code is needed."""

    title: str
    """In the engineer's words."""
    description: PlantDescription
    """What its graph says, or what the run tells of it."""
    flowsheet: Flowsheet | None = None
    """What it does; None where the plant is not to be had."""
    corrections: Corrections = AS_FOUND
    """How the drawing of that is corrected."""
    baselines: dict[str, Baseline] = field(default_factory=dict)
    """Feature -> reference values."""
    panels: tuple[Panel, ...] = ()
    """What its figures show."""
    horizon_s: float | None = None
    """How far the twin looks ahead [s]."""
    notice: str = ""
    """What a reader must know of it; empty where it is the run's own."""
    folder: str | None = None
    """Its folder, for who runs its model; None where it is not to be had."""


class OpenedRun:
    """A run directory as it is now; any thread may ask."""

    def __init__(
        self,
        run_dir: Path,
        plant: KnownPlant,
        gathered: Gathered | None = None,
        watched: Watched | None = None,
        pacing: Pacing | None = None,
    ) -> None:
        """Read the run in ``run_dir``, whose plant is ``plant``.

        ``gathered`` has readings that are not kept yet; ``watched`` is the service that keeps the plant attached;
        ``pacing`` is what a simulated run waits for that goes on in this process.
        """
        self.run_dir, self.plant, self._gathered, self._watched = run_dir, plant, gathered, watched
        self.pacing = pacing
        """What it waits for; None where it has no pace that could be changed here."""
        self._stored: Readings | None = None
        self._kept = 0
        self._tail, self._reading = Tail(run_dir), threading.Lock()
        self._entries: list[Entry] = []
        self._lines: list[Line] = []
        self._story: Story | None = None
        self._untold = ""
        self._stood = (0, Situation())
        self.made: tuple[int, Card | None] = (-1, None)
        """Of how many events a card was made last, and what it is."""
        self.trouble = ""
        """Why the record cannot be read further; empty where it can."""
        self.altered = ""
        """Which line of the journal does not follow the one before; empty where all do."""
        self._begin()
        self.refresh()

    @property
    def entries(self) -> Sequence[Entry]:
        """Everything that happened, in order."""
        return self._entries

    @property
    def lines(self) -> Sequence[Line]:
        """The story, without what was truly wrong."""
        return self._lines

    @property
    def readings(self) -> Readings | None:
        """What was measured; None as long as nobody has it."""
        if self._stored is None and self._gathered is not None:
            return self._gathered.readings()
        return self._stored

    @property
    def attached(self) -> bool:
        """Whether it is a plant that is attached: its service may be begun again, and goes on in the same journal."""
        return self._watched is not None

    @property
    def fresh(self) -> Fresh | None:
        """How fresh the service's answers are; None where it is a run."""
        return None if self._watched is None else self._watched.fresh

    @property
    def pace(self) -> Pace | None:
        """How fast it goes on; None where that cannot be changed here."""
        return None if self.pacing is None else self.pacing.now

    @property
    def closed(self) -> bool:
        """Whether the run was closed: nothing comes any more."""
        return not self.attached and (self.run_dir / MANIFEST).is_file()

    @property
    def last_s(self) -> float:
        """The latest process time that something is known of [s].

        That is the last line that follows the one before where the journal was altered: what readings later than it
        were taken under is not known.
        """
        told = self._entries[-1].at_s if self._entries else 0.0
        readings = None if self.altered else self.readings
        return max(told, readings.last_s if readings else 0.0)

    def refresh(self) -> bool:
        """Read on in the journal where it has grown; whether it had."""
        with self._reading:
            if self._tail.replaced():
                self._begin()
                self._stored, self._kept = None, 0  # another run, with readings and times of its own
                if self._gathered is not None:
                    self._gathered.forget()
            before = len(self._entries)
            self._read()
            self._measure()
            return len(self._entries) != before

    def _measure(self) -> None:
        """Read what was measured as soon as it is kept."""
        try:
            kept = (self.run_dir / TRAJECTORY).stat().st_mtime_ns
        except OSError:
            return
        if kept == self._kept:
            return
        self._kept = kept
        try:
            self._stored = Readings.of(self.run_dir)
        except ReadingsError as error:
            self._untold = self.trouble = self._untold or str(error)

    def count(self, at_s: float) -> int:
        """Number of the events that had happened at process time ``at_s`` [s]."""
        return bisect_right(self._entries, at_s, key=lambda entry: entry.at_s)

    def until(self, at_s: float) -> tuple[Entry, ...]:
        """Everything that had happened at process time ``at_s`` [s]."""
        return tuple(self._entries[: self.count(at_s)])

    def stands(self, at_s: float) -> Situation:
        """Where the run stood at process time ``at_s`` [s]; what is later than what was asked before is only added."""
        count = self.count(at_s)
        known, stood = self._stood
        if known == count:
            return stood
        found = situation(self._entries[known:count], stood) if known < count else situation(self._entries[:count])
        self._stood = count, found
        return found

    def goes_on(self) -> bool:
        """Whether a process writes the run now: it holds the lock of the journal."""
        try:
            with (self.run_dir / JOURNAL).open("rb") as file:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False

    def _begin(self) -> None:
        """Nothing was read yet."""
        self._entries, self._lines, self._untold = [], [], ""
        self._story = Story(self.plant.description)  # a directory may be called after what is wrong
        self._stood, self.made = (0, Situation()), (-1, None)

    def _read(self) -> None:
        trouble = self.altered = ""
        try:
            for record in self._tail.more():
                try:
                    event = decode(record)
                except DecodeError as error:  # what follows it is read all the same
                    self._untold, event = self._untold or str(error), None
                if event is None:
                    continue
                before_s = self._entries[-1].at_s if self._entries else 0.0
                self._entries.append(Entry(max(record.at_s, before_s), event))
                if self._story is not None and not isinstance(event, RunStarted):
                    try:
                        told = self._story.tell(event, record.happened_s)
                        self._lines += [line for line in told if line.label not in _TRUTH]
                    except _UNTOLD as error:
                        self._story = None
                        self._untold = f"event {record.seq} cannot be told in the plant's words: {error!r}"
        except BrokenChain as error:
            trouble = self.altered = str(error)
        except OSError as error:
            trouble = str(error)
        self.trouble = trouble or self._untold
