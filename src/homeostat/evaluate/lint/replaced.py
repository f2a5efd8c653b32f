"""Features that replace one which follows from the tables, though they say something else."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from homeostat.evaluate.lint.finding import Finding, Severity
from homeostat.evaluate.lint.places import Places
from homeostat.knowledge.build.derived.tables import derived, stated_tables
from homeostat.knowledge.build.tables.reading import Rows, is_short
from homeostat.knowledge.build.timing import timing_of

_NAME: Final = re.compile(r"[A-Za-z_][\w.]*")


def replaced(folder: Path, places: Places) -> Iterator[Finding]:
    """Rows whose name is that of a feature which follows, and which reads what they do not.

    Symptoms that follow read them in its place, and see nothing of what they are to see.
    """
    tables, unread = stated_tables(folder)
    if unread or not is_short(folder):
        return
    timing = timing_of(folder)
    follows = derived({**tables, "features": Rows((), ())}, timing)["features"].rows
    meant = {row["id"]: row["expression"] for row in follows}
    symptoms = derived(tables, timing)["symptoms"]
    read: dict[str, list[str]] = {}
    for row, origin in zip(symptoms.rows, symptoms.origins, strict=True):
        if origin.generated:
            read.setdefault(row["feature"], []).append(row["id"])
    for row in tables["features"].rows:
        name, own = row.get("id", ""), row.get("expression", "")
        unread_tags = sorted(_names(meant.get(name, "")) - _names(own))
        if own and unread_tags and name in read:
            what = (
                f"replaces the feature of that name that follows, '{meant[name]}', which {', '.join(read[name])} "
                f"read{'s' if len(read[name]) == 1 else ''}: nothing looks at {', '.join(unread_tags)} there any more"
            )
            remedy = "give it another id; where it is meant, state those symptoms or omit them"
            yield Finding(Severity.WARNING, "tables", places.row("features", id=name), what, remedy)


def _names(expression: str) -> set[str]:
    return set(_NAME.findall(expression))
