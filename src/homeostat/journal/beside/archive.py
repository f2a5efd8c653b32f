"""Where the texts behind a run's events go: questions to the graph and to models, and their answers."""

import hashlib
from typing import Protocol

from homeostat.journal.beside.files import StoredFile


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


class MemoryArchive:
    """Keeps texts in memory, for runs without a directory, until somebody wants them elsewhere."""

    def __init__(self) -> None:
        """Nothing is kept yet."""
        self._kept: dict[tuple[str, str], StoredFile] = {}

    def store_query(self, text: str) -> StoredFile:
        """Keep a question."""
        return self._keep("query", text)

    def store_subgraph(self, text: str) -> StoredFile:
        """Keep an answer in Turtle."""
        return self._keep("subgraph", text)

    def store_prompt(self, text: str) -> StoredFile:
        """Keep a prompt."""
        return self._keep("prompt", text)

    def store_json(self, text: str) -> StoredFile:
        """Keep a schema or an answer."""
        return self._keep("json", text)

    def copy_to(self, archive: Archive) -> None:
        """Keep every text in ``archive`` as well."""
        store = {
            "query": archive.store_query,
            "subgraph": archive.store_subgraph,
            "prompt": archive.store_prompt,
            "json": archive.store_json,
        }
        for kind, text in self._kept:
            store[kind](text)

    def _keep(self, kind: str, text: str) -> StoredFile:
        key = (kind, text)
        if key not in self._kept:
            content = text.encode()
            self._kept[key] = StoredFile("", len(content), hashlib.sha256(content).hexdigest())
        return self._kept[key]
