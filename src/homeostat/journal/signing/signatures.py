"""What the signatures of a recorded run are worth to a reader who trusts certain keys."""

from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from typing import final

from homeostat.journal.beside.manifest import UNSIGNED_FORMAT, Manifest
from homeostat.journal.events import Signed
from homeostat.journal.reading import Record
from homeostat.journal.signing.signing import is_signature


class Signature(StrEnum):
    """Who vouches for a run."""

    TRUSTED = "trusted"
    """A trusted key signed every line and the manifest."""
    STRANGER = "stranger"
    """A key that is not trusted signed some or all of it."""
    NOT_CLOSED = "not-closed"
    """There are signatures, and none that closes the run."""
    NONE = "none"
    """It carries no signature."""
    OLDER = "older"
    """It carries none because its format is older than signatures."""


@dataclass(frozen=True, slots=True)
class Vouched:
    """How much of a run is vouched for, and by whom."""

    signature: Signature
    """Who vouches for it."""
    lines: int = 0
    """Number of lines, from the first, that a trusted key signed."""
    key: str = ""
    """Public key that is not trusted, else the one that signed last; in hexadecimal, empty where nobody signed."""


NOBODY = Vouched(Signature.NONE)
"""Nobody vouches for the run."""


@final
class Signatures:
    """Follows the lines of a journal and judges its signatures."""

    def __init__(self, keys: Collection[str]) -> None:
        """``keys``: public keys that the reader trusts, in hexadecimal."""
        self._keys = frozenset(keys)
        self.trusted = 0
        """Number of lines, from the first, that a trusted key signed so far."""
        self._signed = 0
        self._key = self._stranger = ""

    def follow(self, record: Record, last: str) -> str | None:
        """Take the next line; ``last`` is the digest of the one before. A problem in one sentence, or None."""
        if record.kind != Signed.kind:
            return None
        if not is_signature(record, last):
            return f"line {record.seq} carries a signature that is not of the lines before it"
        self._key, self._signed = str(record.fields["key"]), record.seq
        if self._key in self._keys:
            self.trusted = record.seq
        else:
            self._stranger = self._key
        return None

    def judge(self, manifest: Manifest | None, lines: int) -> Vouched:
        """What the signatures of a journal of ``lines`` lines and of its manifest, if it has one, are worth."""
        key = self._stranger or self._key
        if manifest is not None and manifest.signature and manifest.key not in self._keys:
            return Vouched(Signature.STRANGER, self.trusted, manifest.key)
        if self._stranger:
            return Vouched(Signature.STRANGER, self.trusted, key)
        if manifest is not None and manifest.signature and self._signed == lines:
            return Vouched(Signature.TRUSTED, self.trusted, key)
        if self._signed or (manifest is not None and manifest.signature):
            return Vouched(Signature.NOT_CLOSED, self.trusted, key)
        older = manifest is not None and manifest.format == UNSIGNED_FORMAT
        return Vouched(Signature.OLDER if older else Signature.NONE)
