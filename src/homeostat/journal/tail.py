"""A journal that grows, read on from where it was read to; each line is checked against the one before."""

from collections.abc import Iterator
from pathlib import Path
from typing import final

from homeostat.journal.beside.files import JOURNAL
from homeostat.journal.chain import GENESIS, digest
from homeostat.journal.reading import Record, follow


@final
class Tail:
    """The end to which the journal of one run has been read."""

    def __init__(self, run_dir: Path) -> None:
        """Nothing of the journal in ``run_dir`` was read yet."""
        self._path = run_dir / JOURNAL
        self._file = 0
        self._begin()

    def _begin(self) -> None:
        self._read, self._number, self._last = 0, 0, GENESIS

    def replaced(self) -> bool:
        """Whether the journal is another file than the one that was read, or shorter; it is read from its start then.

        False where there is none.
        """
        try:
            found = self._path.stat()
        except OSError:
            return False
        another = self._number > 0 and (found.st_ino != self._file or found.st_size < self._read)
        self._file = found.st_ino
        if another:
            self._begin()
        return another

    def more(self) -> Iterator[Record]:
        """The whole lines that came since.

        BrokenChain at the first that does not follow, which is looked at again the next time; FileNotFoundError where
        there is no journal.
        """
        with self._path.open("rb") as file:
            file.seek(self._read)
            for ended in file:
                if not ended.endswith(b"\n"):
                    return
                raw = ended[:-1]
                record = follow(self._number + 1, raw, self._last)
                self._read, self._number, self._last = self._read + len(ended), self._number + 1, digest(raw)
                yield record
