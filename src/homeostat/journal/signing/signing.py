"""Signatures over a chain and over the manifest that closes it."""

from typing import final

from homeostat.journal.chain import Chain
from homeostat.journal.encode import Json, canonical
from homeostat.journal.events import Signed
from homeostat.journal.reading import Record
from homeostat.journal.signing.keys import SigningKey, vouches

EVERY_LINES = 64
"""A journal is signed at the latest after this many lines."""
EVERY_S = 60.0
"""A journal is signed with the first line after this much process time [s]."""


@final
class Signer:
    """Signs a growing chain, from time to time and at its end."""

    def __init__(self, key: SigningKey, every_lines: int = EVERY_LINES, every_s: float = EVERY_S) -> None:
        """``every_lines`` and ``every_s``: lines and process time [s] after which a signature is due."""
        self._key, self._every_lines, self._every_s = key, every_lines, every_s
        self.public = key.public
        """The public key, in hexadecimal."""
        self._lines = 0
        self._at_s: float | None = None

    def due(self, chain: Chain) -> bool:
        """Whether a signature should come next."""
        if self._at_s is None:
            self._at_s = chain.at_s
        return chain.count - self._lines >= self._every_lines or chain.at_s - self._at_s >= self._every_s

    def signed(self, chain: Chain) -> Signed:
        """The event that signs every line of ``chain``."""
        signature = self._key.sign(_of_chain(chain.count, chain.last))
        return Signed(self._key.public, chain.count, chain.last, signature)

    def done(self, chain: Chain) -> None:
        """``chain`` now ends with a signature."""
        self._lines, self._at_s = chain.count, chain.at_s

    def sign_manifest(self, content: dict[str, Json]) -> str:
        """The signature of a manifest with that ``content``, which has the key and no signature; in hexadecimal."""
        return self._key.sign(_of_manifest(content))


def is_signature(record: Record, last: str) -> bool:
    """Whether ``record`` truly signs the lines before it, the last of which has the digest ``last``."""
    key, signature = record.fields.get("key"), record.fields.get("wall_signature")
    stated = record.fields.get("lines"), record.fields.get("wall_digest")
    if not isinstance(key, str) or not isinstance(signature, str) or stated != (record.seq - 1, last):
        return False
    return vouches(key, _of_chain(record.seq - 1, last), signature)


def signs_manifest(content: dict[str, Json], key: str, signature: str) -> bool:
    """Whether ``signature`` by ``key`` is of a manifest with that ``content``, which has the key and no signature."""
    return vouches(key, _of_manifest(content), signature)


def _of_chain(lines: int, last: str) -> bytes:
    return f"homeostat journal\n{lines}\n{last}".encode()


def _of_manifest(content: dict[str, Json]) -> bytes:
    return b"homeostat manifest\n" + canonical(content).encode("ascii")
