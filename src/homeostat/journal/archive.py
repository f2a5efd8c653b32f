"""Where the texts behind a run's events go: questions to the graph and to models, and their answers."""

from __future__ import annotations

import hashlib
from typing import Protocol

from homeostat.journal.files import StoredFile


class Archive(Protocol):
    """Keeps texts by content; a run directory is one."""

    def store_query(self, text: str) -> StoredFile:
        """Keep a question."""
        ...

    def store_subgraph(self, text: str) -> StoredFile:
        """Keep an answer in Turtle."""
        ...

    def store_prompt(self, text: str) -> StoredFile:
        """Keep what a language model was shown, or the words by which it was looked for."""
        ...

    def store_json(self, text: str) -> StoredFile:
        """Keep a JSON schema, or what a language model answered."""
        ...


class NoArchive:
    """Keeps nothing but the hash: for runs without a directory."""

    def store_query(self, text: str) -> StoredFile:
        """The hash of a question."""
        return _described(text)

    def store_subgraph(self, text: str) -> StoredFile:
        """The hash of an answer."""
        return _described(text)

    def store_prompt(self, text: str) -> StoredFile:
        """The hash of a prompt."""
        return _described(text)

    def store_json(self, text: str) -> StoredFile:
        """The hash of a schema or an answer."""
        return _described(text)


def _described(text: str) -> StoredFile:
    content = text.encode()
    return StoredFile(name="", size_bytes=len(content), sha256=hashlib.sha256(content).hexdigest())
