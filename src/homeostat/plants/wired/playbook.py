"""A plant's playbook: its file, read once and fitted to the plant before a run begins."""

import logging
from collections.abc import Sequence
from pathlib import Path

from homeostat.agents.playbook.book import Book
from homeostat.plants.wired.guarding import Guarded
from homeostat.record.playbook import TOLD, Content, read_playbook

NAME = "playbook.jsonl"
"""Name under which a run keeps the playbook that it began with."""


def open_playbook(path: Path, plant: Guarded) -> tuple[Book, Content]:
    """The playbook at ``path`` for ``plant``, empty where there is no file yet, and what the file holds.

    What is no entry, is of another configuration or does not fit the plant is left out, and logged as a warning.
    Raises PlaybookError where it is no file, OSError where it cannot be read.
    """
    content, configuration = read_playbook(path), plant.configuration
    own = [entry for entry in content.entries if entry.configuration == configuration]
    book = Book(own, plant.description, content.sha256)
    foreign = len(content.entries) - len(own)
    told = list(content.troubles)
    if foreign:
        told.append(
            f"playbook {path.name!r}: {foreign} of {len(content.entries)} entries are of another configuration than "
            f"{plant.name} has now ({configuration[:12]}); they are not used: build it again"
        )
    for line in (*told, *_few([f"playbook {path.name!r}: {each}" for each in book.troubles])):
        logging.getLogger(__name__).warning("%s", line)
    return book, content


def _few(troubles: Sequence[str]) -> list[str]:
    """As many as somebody reads."""
    more = len(troubles) - TOLD
    return [*troubles[:TOLD], *([f"{more} more entries do not fit the plant; they are not used"] if more > 0 else [])]
