"""The journal: an append-only, hash-chained record of a run that survives being killed."""

import contextlib
import os
import threading
from pathlib import Path
from types import TracebackType
from typing import Self, final

from homeostat.journal.beside.files import JOURNAL, MANIFEST
from homeostat.journal.beside.manifest import Manifest, Summary, manifest_of, write_manifest
from homeostat.journal.chain import Chain
from homeostat.journal.events import Event, Resumed, Setting, Subscriber
from homeostat.journal.found import Found
from homeostat.journal.listeners import Listeners
from homeostat.journal.signing.keys import SigningKey
from homeostat.journal.signing.signing import Signer


@final
class Journal:
    """A run directory being written: ``events.jsonl`` now, ``manifest.json`` when it closes.

    Each event is one line and one system call, so a killed process leaves whole lines and at most one torn one. A write
    that fails leaves nothing, and the next one goes on where the last whole line ends. Leaving the ``with`` block
    without `close` leaves a run without manifest, which verifies as incomplete. Any thread may record and sync; a sync
    that hangs keeps nobody from recording.

    The chain shows every edit that does not also rewrite all that follows it and the manifest. With a key, a signature
    every so often and at the end shows those as well, to whoever knows the public key from elsewhere.
    """

    def __init__(self, directory: Path | str, key: SigningKey | None = None) -> None:
        """Begin a run in ``directory``, signed with ``key``; FileExistsError where it holds one."""
        self.directory = Path(directory)
        self.directory.mkdir(parents=True, exist_ok=True)
        self._path = self.directory / JOURNAL
        try:
            self._file = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except FileExistsError:
            raise FileExistsError(f"{str(self._path)!r} already holds a run; choose another directory") from None
        self._set_up(Chain(), 0, key)

    @classmethod
    def resume(cls, directory: Path | str, key: SigningKey | None = None, changed: tuple[Setting, ...] = ()) -> Self:
        """Go on with the run in ``directory``, which was left before it was closed; a torn last line is taken away.

        The first new line is a `Resumed`, which says how much of what was found is signed by ``key``, and what has
        ``changed`` since. Raises FileNotFoundError where there is no run, FileExistsError where it was closed,
        BrokenChain where its journal is not what was written or carries a signature that is not of its lines.
        """
        _refuse_closed(Path(directory))
        return cls.go_on(Found.in_directory(directory, key), key, changed)

    @classmethod
    def go_on(cls, found: Found, key: SigningKey | None = None, changed: tuple[Setting, ...] = ()) -> Self:
        """As :meth:`resume`, behind what was ``found`` with the same ``key``, and what nobody has added to since."""
        _refuse_closed(found.path.parent)
        journal = cls.__new__(cls)
        journal.directory, journal._path = found.path.parent, found.path
        journal._file = os.open(found.path, os.O_WRONLY | os.O_APPEND)
        journal._set_up(Chain(found.count, found.last, found.at_s), found.size, key)
        journal._torn = torn = found.path.stat().st_size > found.size
        at_s = found.at_s if found.count else 0.0
        journal.record(Resumed(found.count, found.trusted, torn, changed), at_s)
        return journal

    def record(self, event: Event, at_s: float) -> None:
        """Append ``event``, which happened at process time ``at_s`` [s]; see `homeostat.journal.events.Trace`."""
        with self._writing:
            self._append(event, at_s)
            self._listeners.put(event, at_s)
            if self._signer is not None and self._signer.due(self._chain):
                self._sign(self._signer)
        self._listeners.tell()

    def subscribe(self, subscriber: Subscriber) -> None:
        """Tell ``subscriber`` of every later event but signatures."""
        self._listeners.add(subscriber)

    def take_troubles(self) -> tuple[str, ...]:
        """What went wrong beside the record since this was last asked: subscribers, signatures; one line each."""
        return self._listeners.take_troubles()

    def sync(self) -> None:
        """Return when every recorded line is on the disk, safe from a power cut."""
        with self._syncing:
            self._require_open()
            os.fsync(self._file)

    def close(self, summary: Summary) -> Manifest:
        """End the run: sign and sync the journal, then describe it and every other file of the directory."""
        self._require_open()
        with self._writing:
            if self._signer is not None:
                self._append_signature(self._signer)
        self.sync()
        manifest = manifest_of(self.directory, summary, self._chain.count, self._chain.last, self._signer)
        write_manifest(self.directory, manifest)
        self._release()
        return manifest

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._open:
            try:
                with self._writing:
                    if self._signer is not None and self._chain.count:
                        self._sign(self._signer)
                self.sync()
            finally:
                self._release()

    def _set_up(self, chain: Chain, size: int, key: SigningKey | None) -> None:
        """Go on after the lines of ``chain``, which are ``size`` byte long."""
        self._chain, self._size = chain, size
        self._open, self._torn = True, False
        self._signer = None if key is None else Signer(key)
        self._listeners = Listeners()
        self._writing, self._syncing = threading.Lock(), threading.Lock()

    def _sign(self, signer: Signer) -> None:
        """Sign what is there; where that fails, the record still stands and the next line tries again."""
        try:
            self._append_signature(signer)
        except OSError as error:
            self._listeners.complain(f"the journal {str(self._path)!r} could not be signed: {error}")

    def _append_signature(self, signer: Signer) -> None:
        self._append(signer.signed(self._chain), self._chain.at_s)
        signer.done(self._chain)

    def _append(self, event: Event, at_s: float) -> None:
        self._require_open()
        line = self._chain.draft(event, at_s)
        self._mend()
        ended, written = line + b"\n", 0
        try:
            written = os.write(self._file, ended)
        finally:
            if written != len(ended):
                self._torn = True  # a torn line inside the journal would break the chain
                with contextlib.suppress(OSError):
                    self._mend()
        if written != len(ended):
            raise OSError(f"{str(self._path)!r}: only {written} of {len(ended)} byte fit on the disk; make room")
        self._size += written
        self._chain.commit(line, at_s)

    def _mend(self) -> None:
        """Take away what a failed write may have left after the last whole line."""
        if self._torn:
            os.ftruncate(self._file, self._size)
            self._torn = False

    def _require_open(self) -> None:
        if not self._open:
            raise ValueError(f"the journal {str(self._path)!r} is closed; record before closing it")

    def _release(self) -> None:
        with self._writing, self._syncing:
            self._open = False
            os.close(self._file)


def _refuse_closed(directory: Path) -> None:
    if (directory / MANIFEST).exists():
        raise FileExistsError(f"the run in {str(directory)!r} was closed; begin another one")
