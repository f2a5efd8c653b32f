"""Names of files that name a study's plants, whatever these are called."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from homeostat.evaluate.report.tables.table import Table


def file_name(*words: str) -> str:
    """``words`` as the name of a file, without anything that a file system or a link could take amiss."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", "_".join(words)).strip("_") or "table"


def distinct(tables: Sequence[Table]) -> tuple[Table, ...]:
    """The tables, where names that occur again, in whatever case of letters, get a number."""
    taken: set[str] = set()
    named = []
    for table in tables:
        name, again = table.name, 2
        while name.casefold() in taken:
            name, again = f"{table.name}_{again}", again + 1
        taken.add(name.casefold())
        named.append(replace(table, name=name))
    return tuple(named)
