"""The names of all tags of a store, which are asked for without opening years of tables."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from homeostat.journal.beside.files import write_whole

NAMES: Final = "tags.json"
"""File with the names."""


def read_names(store: Path) -> tuple[str, ...]:
    """Every name that was ever added."""
    try:
        names: list[str] = json.loads((store / NAMES).read_bytes())
    except FileNotFoundError:
        return ()
    return tuple(names)


def add_names(store: Path, names: Iterable[str]) -> None:
    """Add what is not there yet."""
    known = set(read_names(store))
    every = known.union(names)
    if every != known:
        write_whole(store / NAMES, json.dumps(sorted(every), indent=0).encode())
