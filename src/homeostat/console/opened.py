"""A run that is shown: its journal, read again as it grows, its readings, and its plant."""

import fcntl
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from homeostat.console.readings import Gathered, Readings, ReadingsError
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.flowsheet import Flowsheet
from homeostat.journal import BrokenChain, RunStarted, read_events
from homeostat.journal.beside.files import JOURNAL, MANIFEST
from homeostat.journal.memory import Entry
from homeostat.record.decode import DecodeError, decode
from homeostat.record.figure.panel import Panel
from homeostat.record.story.line import Line
from homeostat.record.story.story import Story

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
    baselines: dict[str, Baseline] = field(default_factory=dict)
    """Feature -> reference values."""
    panels: tuple[Panel, ...] = ()
    """What its figures show."""
    horizon_s: float | None = None
    """How far the twin looks ahead [s]."""
    notice: str = ""
    """What a reader must know of it; empty where it is the run's own."""


class OpenedRun:
    """A run directory as it is now."""

    def __init__(self, run_dir: Path, plant: KnownPlant, gathered: Gathered | None = None) -> None:
        """Read the run in ``run_dir``, whose plant is ``plant``; ``gathered`` has readings that are not kept yet."""
        self.run_dir, self.plant, self._gathered = run_dir, plant, gathered
        self._stored: Readings | None = None
        self._size = -1
        self._entries: tuple[Entry, ...] = ()
        self.lines: tuple[Line, ...] = ()
        """The story, without what was truly wrong."""
        self.trouble = ""
        """Why the record cannot be read further; empty where it can."""
        self.refresh()

    @property
    def entries(self) -> Sequence[Entry]:
        """Everything that happened, in order."""
        return self._entries

    @property
    def readings(self) -> Readings | None:
        """What was measured; None as long as nobody has it."""
        if self._stored is None and self._gathered is not None:
            return self._gathered.readings()
        return self._stored

    @property
    def closed(self) -> bool:
        """Whether the run was closed: nothing comes any more."""
        return (self.run_dir / MANIFEST).is_file()

    @property
    def last_s(self) -> float:
        """The latest process time that something is known of [s]."""
        told = self._entries[-1].at_s if self._entries else 0.0
        readings = self.readings
        return max(told, readings.last_s if readings else 0.0)

    def refresh(self) -> bool:
        """Read the journal again where it has grown; whether it had."""
        try:
            size = (self.run_dir / JOURNAL).stat().st_size
        except OSError:
            size = 0
        if size == self._size:
            return False
        self._size = size
        self._read()
        try:
            self._stored = Readings.of(self.run_dir)
        except ReadingsError as error:
            self.trouble = self.trouble or str(error)
        return True

    def until(self, at_s: float) -> tuple[Entry, ...]:
        """Everything that had happened at process time ``at_s`` [s]."""
        return self._entries[: bisect_right(self._entries, at_s, key=lambda entry: entry.at_s)]

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

    def _read(self) -> None:
        entries: list[Entry] = []
        lines: list[Line] = []
        self.trouble = ""
        story: Story | None = Story(self.plant.description)  # a directory may be called after what is wrong
        try:
            for record in read_events(self.run_dir):
                event = decode(record)
                if event is None:
                    continue
                entries.append(Entry(max(record.at_s, entries[-1].at_s if entries else 0.0), event))
                if story is not None and not isinstance(event, RunStarted):
                    try:
                        lines += [x for x in story.tell(event, record.happened_s) if x.label not in _TRUTH]
                    except _UNTOLD as error:
                        story, self.trouble = None, f"event {record.seq} cannot be told in the plant's words: {error!r}"
        except (BrokenChain, DecodeError, OSError) as error:
            self.trouble = str(error)
        self._entries, self.lines = tuple(entries), tuple(lines)
