"""The texts behind a run's events, each in a file that is named by its content."""

import hashlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import final

from homeostat.journal import StoredFile
from homeostat.journal.beside.artifacts import write_text
from homeostat.journal.beside.files import describe

QUERIES = "queries"
"""Folder of the questions that were put to the graph."""
SUBGRAPHS = "subgraphs"
"""Folder of what the graph answered."""
PROMPTS = "prompts"
"""Folder of what language models were shown."""
ANSWERS = "answers"
"""Folder of what they were to answer in (JSON schemas), and answered."""


@final
class Texts:
    """Implements :class:`homeostat.journal.beside.archive.Archive` in a run directory."""

    def __init__(self, path: Path, spared: Callable[[str], AbstractContextManager[None]]) -> None:
        """``path``: the directory; ``spared``: goes on where there is no room for what it names."""
        self._path, self._spared = path, spared
        self._kept: dict[str, StoredFile] = {}

    def store_query(self, text: str) -> StoredFile:
        """Keep a question; the file's name is relative to the run directory."""
        return self._store(QUERIES, text, ".rq")

    def store_subgraph(self, text: str) -> StoredFile:
        """Keep an answer in Turtle; the file's name is relative to the run directory."""
        return self._store(SUBGRAPHS, text, ".ttl")

    def store_prompt(self, text: str) -> StoredFile:
        """Keep a prompt; the file's name is relative to the run directory."""
        return self._store(PROMPTS, text, ".md")

    def store_json(self, text: str) -> StoredFile:
        """Keep a schema or an answer; the file's name is relative to the run directory."""
        return self._store(ANSWERS, text, ".json")

    def _store(self, folder: str, text: str, suffix: str) -> StoredFile:
        content = text.encode()
        key = f"{folder}/{hashlib.sha256(content).hexdigest()}{suffix}"  # texts of weeks fit into no memory
        if key not in self._kept:  # agents ask the same again, and writing waits for the disk while they think
            self._kept[key] = StoredFile("", len(content), hashlib.sha256(content).hexdigest())
            with self._spared(folder):
                stored = write_text(self._path / folder, text, suffix)
                self._kept[key] = describe(self._path / folder / stored.name, self._path)
        return self._kept[key]
