"""A journal that was left, as one reading finds it: where it ends, how much of it is signed, and what it says."""

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from homeostat.journal.beside.files import JOURNAL
from homeostat.journal.chain import GENESIS, Chain
from homeostat.journal.events import Signed
from homeostat.journal.reading import BrokenChain, Record, skim
from homeostat.journal.signing.keys import SigningKey
from homeostat.journal.signing.signatures import Signatures


@dataclass(frozen=True, slots=True)
class Found:
    """What is needed to go on behind the last whole line."""

    path: Path
    """The file."""
    count: int
    """Whole lines."""
    size: int
    """Length of the whole lines [byte]."""
    last: str
    """Digest of the last one, which the next must carry."""
    at_s: float
    """Process time of the last one [s]; as a chain begins where there is none."""
    trusted: int
    """Lines, from the first, that the key which goes on has signed."""
    records: tuple[Record, ...]
    """The events of the kinds that were asked for, and the last one, in order."""

    @classmethod
    def in_directory(cls, directory: Path | str, key: SigningKey | None = None, kinds: Collection[str] = ()) -> "Found":
        """What is in ``directory``, of which events of ``kinds`` are wanted; ``key`` is the one that goes on signing.

        Raises FileNotFoundError where there is no run, BrokenChain where its journal is not what was written or
        carries a signature that is not of its lines.
        """
        path = Path(directory) / JOURNAL
        count, size, last, at_s = 0, 0, GENESIS, Chain().at_s
        signatures = Signatures(() if key is None else (key.public,))
        records, wanted, ending = list[Record](), frozenset(kinds), None
        for line in skim(path, wanted | {Signed.kind}):
            if (ending := line.record) is not None:
                if problem := signatures.follow(ending, last):
                    raise BrokenChain(problem, count)
                at_s = ending.at_s  # of the last line in the end
                if ending.kind in wanted:
                    records.append(ending)
            count, size, last = count + 1, size + len(line.raw) + 1, line.digest
        if ending is not None and ending.kind not in wanted:
            records.append(ending)
        return cls(path, count, size, last, at_s, signatures.trusted, tuple(records))
