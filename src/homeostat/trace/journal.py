"""The journal: an append-only, hash-chained record of a run that survives being killed."""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import Self, final

from homeostat.trace.chain import Chain
from homeostat.trace.events import Event, Subscriber
from homeostat.trace.files import JOURNAL
from homeostat.trace.manifest import Manifest, Summary, manifest_of, write_manifest


@final
class Journal:
    """A run directory being written: ``events.jsonl`` now, ``manifest.json`` when it closes.

    Each event is one line and one system call, so a killed process leaves whole lines and at most one torn one. Leaving
    the ``with`` block without `close` leaves a run without manifest, which verifies as incomplete.

    The chain shows every edit that does not also rewrite all that follows it and the manifest. Where an attacker could
    do that, keep the manifest's ``sha256`` somewhere else.
    """

    def __init__(self, directory: Path | str) -> None:
        self.directory = Path(directory)
        self.directory.mkdir(parents=True, exist_ok=True)
        self._path = self.directory / JOURNAL
        try:
            self._file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except FileExistsError:
            raise FileExistsError(f"{str(self._path)!r} already holds a run; choose another directory") from None
        self._open = True
        self._size = 0
        self._chain = Chain()
        self._subscribers: list[Subscriber] = []

    def record(self, event: Event, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]; see `homeostat.trace.events.Trace`."""
        line = self._chain.draft(event, at_s)
        self._append(line + b"\n")
        self._chain.commit(line)
        for subscriber in self._subscribers:
            subscriber(event, at_s)

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event."""
        self._subscribers.append(subscriber)

    def sync(self) -> None:
        """Return when every recorded line is on the disk, safe from a power cut."""
        self._require_open()
        os.fsync(self._file)

    def close(self, summary: Summary) -> Manifest:
        """End the run: sync the journal, then describe it and every other file of the directory in the manifest."""
        self.sync()
        manifest = manifest_of(self.directory, summary, self._chain.count, self._chain.last)
        write_manifest(self.directory, manifest)
        self._release()
        return manifest

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._open:
            os.fsync(self._file)
            self._release()

    def _append(self, line: bytes) -> None:
        self._require_open()
        written = os.write(self._file, line)
        if written != len(line):
            os.ftruncate(self._file, self._size)  # a torn line inside the journal would break the chain
            raise OSError(f"{str(self._path)!r}: only {written} of {len(line)} byte fit on the disk; make room")
        self._size += written

    def _require_open(self) -> None:
        if not self._open:
            raise ValueError(f"the journal {str(self._path)!r} is closed; record before closing it")

    def _release(self) -> None:
        self._open = False
        os.close(self._file)
