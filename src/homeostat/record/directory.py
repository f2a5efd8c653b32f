"""A run directory: the journal while the run goes on, what belongs to it beside, the manifest last."""

import contextlib
import itertools
import os
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self, final

from homeostat.domain.snapshot import Trajectory
from homeostat.journal import Followed, Journal, Manifest, Record, StoredFile, Summary
from homeostat.journal.beside.artifacts import write_parquet
from homeostat.journal.beside.files import JOURNAL, MANIFEST, describe, write_whole
from homeostat.journal.beside.lock import locked
from homeostat.journal.events import Event, Setting
from homeostat.journal.found import Found
from homeostat.journal.signing.keys import KeyTrouble, SigningKey, installation_key
from homeostat.record.texts import Texts

TRAJECTORY = "trajectory.parquet"
"""Measured and true values of every tag."""
MEASURED = "measured "
"""Begin of the columns of a trajectory that instruments have filled."""
FIGURE = "figure.png"
"""The run as a picture."""
LOOKED_S = 0.5
"""Longest wait for who only looks whether a run goes on, as a page does, wall-clock [s]."""


class RunDirectoryError(ValueError):
    """A run cannot be kept where it should be; one line with the remedy."""


def _key() -> tuple[SigningKey | None, str]:
    """The installation's key and an empty text, or nothing and why there is none: a run without a key goes on."""
    try:
        return installation_key(), ""
    except KeyTrouble as trouble:
        return None, str(trouble)


def _held(path: Path) -> int:
    """A descriptor with the lock of the run in ``path``, which ends with the process that writes the run.

    Raises RunDirectoryError where another one has it.
    """
    descriptor = os.open(path / JOURNAL, os.O_RDONLY)
    if not locked(descriptor, LOOKED_S):
        os.close(descriptor)
        raise RunDirectoryError(f"run {str(path)!r} still goes on; stop it first")
    return descriptor


def clear(path: Path) -> None:
    """Remove what an earlier try has left in ``path``; RunDirectoryError where that run still goes on."""
    if (path / JOURNAL).exists():
        os.close(_held(path))
    shutil.rmtree(path, ignore_errors=True)


@final
class RunDirectory:
    """A run directory being written. Leaving the ``with`` block without `close` leaves an incomplete run."""

    def __init__(self, path: Path) -> None:
        """Make ``path``, which must be new or empty, and open the journal in it, signed by the installation's key.

        Where there is no key, ``unsigned`` says why.

        Raises RunDirectoryError where it holds something, OSError where it cannot be made; nothing is left behind then.
        """
        if path.is_dir() and any(path.iterdir()):
            raise RunDirectoryError(f"{str(path)!r} is not empty; choose another directory or remove it first")
        made = [p for p in (path, *path.parents) if not p.exists()]
        try:
            path.mkdir(parents=True, exist_ok=True)
            key, self.unsigned = _key()
            self.journal = Journal(path, key)
            self._lock = _held(path)
        except OSError:
            for folder in made:
                with contextlib.suppress(OSError):
                    folder.rmdir()
            raise
        self._set_up(path)

    @classmethod
    def resume(cls, path: Path, changed: tuple[Setting, ...] = ()) -> Self:
        """Go on with the run in ``path``, which was killed; ``changed``: what was chosen otherwise since.

        Raises RunDirectoryError where it still goes on, and as :meth:`homeostat.journal.Journal.resume`.
        """
        with cls._again(path) as (directory, key):
            directory.journal = Journal.resume(path, key, changed)
        directory._set_up(path)
        return directory

    @classmethod
    def reopen(
        cls, path: Path, kinds: Collection[str], changed: Callable[[tuple[Record, ...]], tuple[Setting, ...]]
    ) -> tuple[Self, tuple[Record, ...]]:
        """As :meth:`resume`, also where the run was closed; with it its events of ``kinds``, and its last one.

        The journal is read once; ``changed`` says of what was read what was chosen otherwise since. A run whose journal
        is not what was written stays closed.
        """
        with cls._again(path) as (directory, key):
            found = Found.in_directory(path, key, kinds)
            stated = changed(found.records)
            (path / MANIFEST).unlink(missing_ok=True)
            directory.journal = Journal.go_on(found, key, stated)
        directory._set_up(path)
        return directory, found.records

    @classmethod
    @contextlib.contextmanager
    def _again(cls, path: Path) -> Iterator[tuple[Self, SigningKey | None]]:
        """One that has the lock of the run in ``path``, and its journal in a moment; the lock goes where that fails."""
        directory = cls.__new__(cls)
        directory._lock = _held(path)
        try:
            key, directory.unsigned = _key()
            yield directory, key
        except BaseException:
            os.close(directory._lock)
            raise

    @classmethod
    def next_free(cls, root: Path, stem: str) -> Self:
        """A directory of its own: the first of ``root/stem``, ``root/stem-2``, ``root/stem-3``, ... that is free."""
        for number in itertools.count(1):
            path = root / (stem if number == 1 else f"{stem}-{number}")
            with contextlib.suppress(FileExistsError):
                root.mkdir(parents=True, exist_ok=True)
                path.mkdir()  # fails where another process has just taken the name
                return cls(path)
        raise AssertionError("counting never ends")

    def _set_up(self, path: Path) -> None:
        self.path = path
        """The directory."""
        self.trace = Followed(self.journal)
        """Where events go: followers are told of each, also where there is no room for it."""
        self._texts = Texts(path, self.spared)
        self._missing: dict[str, str] = {}

    @property
    def missing(self) -> str:
        """What of the run could not be stored, and why, in one line; empty where nothing is missing."""
        events = {f"{n} event{'s' * (n != 1)}": "no room"} if (n := self.trace.missing) else {}
        return "; ".join(f"{what}: {why}" for what, why in {**events, **self._missing}.items())

    def keeps(self, name: str) -> bool:
        """Whether the file called ``name`` is not among what could not be stored."""
        return name not in self._missing

    @contextlib.contextmanager
    def spared(self, what: str) -> Iterator[None]:
        """Go on where there is no room for ``what``, which is `missing` then."""
        try:
            yield
        except OSError as error:
            self._missing.setdefault(what, str(error))

    def record(self, event: Event, at_s: float) -> None:
        """Record ``event``, which happened at process time ``at_s`` [s]; where there is no room, it is `missing`."""
        with contextlib.suppress(OSError):  # it is told, and waits
            self.trace.record(event, at_s)

    def store_query(self, text: str) -> StoredFile:
        """Keep a question; the file's name is relative to the run directory."""
        return self._texts.store_query(text)

    def store_subgraph(self, text: str) -> StoredFile:
        """Keep an answer in Turtle; the file's name is relative to the run directory."""
        return self._texts.store_subgraph(text)

    def store_prompt(self, text: str) -> StoredFile:
        """Keep a prompt; the file's name is relative to the run directory."""
        return self._texts.store_prompt(text)

    def store_json(self, text: str) -> StoredFile:
        """Keep a schema or an answer; the file's name is relative to the run directory."""
        return self._texts.store_json(text)

    def store_trajectory(self, measured: Trajectory, truth: Trajectory, units: Mapping[str, str]) -> StoredFile:
        """Keep the columns ``measured TAG`` and ``true TAG`` of every tag in ``units`` (tag -> unit)."""
        columns = {f"{MEASURED}{tag}": measured.signals[tag][0] for tag in units}
        columns |= {f"true {tag}": truth.signals[tag][0] for tag in units}
        by_column = {name: units[name.partition(" ")[2]] for name in columns}
        return write_parquet(self.path / TRAJECTORY, truth.times_s, columns, by_column)

    def store_whole(self, name: str, content: bytes) -> StoredFile:
        """Keep a file called ``name``."""
        write_whole(self.path / name, content)
        return describe(self.path / name, self.path)

    def close(self, summary: Summary) -> Manifest | None:
        """End the run: the manifest confirms every file that is here now; None where anything is `missing`."""
        with contextlib.suppress(OSError):  # the last chance of what waits for room
            self.trace.sync()
        if not self.missing:
            with self.spared(MANIFEST):
                return self.journal.close(summary)
        return None

    def take_troubles(self) -> tuple[str, ...]:
        """What went wrong beside the record since this was last asked, one line each."""
        signing = self.journal.take_troubles()
        return (*self.trace.take_troubles(), *(() if self.missing else signing))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            with self.spared(JOURNAL):
                self.journal.__exit__(kind, error, traceback)
        finally:
            os.close(self._lock)
