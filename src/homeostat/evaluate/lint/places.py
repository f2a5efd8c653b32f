"""Where a plant's tables state a thing: file and row of what a check knows by its name."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final, final

from homeostat.evaluate.lint.finding import Place
from homeostat.knowledge.build.derived.tables import derived, stated_tables
from homeostat.knowledge.build.tables.reading import FOLDER, Origin, Rows
from homeostat.knowledge.build.tables.schemas import SCHEMAS, SHORT_SCHEMAS
from homeostat.knowledge.build.timing import timing_of
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.files.folder import SETTINGS

_TABLES: Final[Mapping[str, tuple[str, str]]] = {
    "tag": ("signals", "tag"),
    "parameter": ("parameters", "symbol"),
    "component": ("equipment", "id"),
    "operator": ("operators", "id"),
    "loop": ("loops", "id"),
    "equation": ("equations", "id"),
    "state": ("states", "id"),
    "transition": ("transitions", "id"),
    "limit": ("limits", "id"),
    "criterion": ("criteria", "id"),
    "fallback": ("fallbacks", "strategy"),
    "trip of limit": ("trips", "limit"),
    "start-up limit": ("start_up", "limit"),
    "quality of tag": ("quality", "tag"),
    "writable tag": ("writables", "tag"),
    "price of": ("prices", "item"),
    "fault": ("faults", "id"),
    "feature": ("features", "id"),
    "symptom": ("symptoms", "id"),
}
"""What a check calls a thing -> the table that states it, and the column of its name."""
_ROW: Final = re.compile(
    r"(?:[\w-]+\.csv, a row that follows from )?(?P<file>[\w-]+\.csv) row (?P<row>\d+)(?: \((?P<key>.*)\))?$"
)
_TAG: Final[Mapping[str, tuple[str, str]]] = {"fallback": ("fallbacks", "strategy"), "state": ("setpoints", "state")}
"""What is stated in a row for each tag -> the table, and the column of its name."""
_SERVES: Final = re.compile(r"fallback '(?P<strategy>.*)', limit '(?P<limit>.*)'$")
_SETTING: Final = re.compile(rf".*?/{re.escape(SETTINGS)}(?: line (?P<line>\d+))?: (?P<rest>.*)$", re.DOTALL)
_NAMED: Final = re.compile(r"(?P<kind>[\w -]+?) '(?P<name>.*)'$")


@final
class Places:
    """The rows of one plant's tables."""

    def __init__(self, folder: Path) -> None:
        """Read what can be read of the tables in ``folder``; what cannot be has no rows."""
        found, wrong = stated_tables(folder)
        short = {name: found[name] for name in SHORT_SCHEMAS if name in found}
        if not wrong:
            with contextlib.suppress(GraphError):  # the check of the tables says what is wrong with them
                found = derived(found, timing_of(folder))
        self._tables = {name: found.get(name, Rows((), ())) for name in SCHEMAS} | short

    def row(self, table: str, **cells: str) -> Place:
        """The line of the first row of ``table`` that has all these ``cells``, by column, or of what that follows from.

        The table where there is none.
        """
        key, rows = " ".join(cells.values()), self._tables.get(table, Rows((), ()))
        for number, row in enumerate(rows.rows):
            if all(row.get(column) == cell for column, cell in cells.items()):
                origin = rows.origins[number] if rows.origins else Origin(table, number + 2)
                return Place(f"{FOLDER}/{origin.table}.csv", origin.line, key)
        return Place(f"{FOLDER}/{table}.csv", None, key)

    def column(self, table: str, key: str, column: str) -> dict[str, str]:
        """What each row of ``table``, by its cell in ``key``, says in ``column``."""
        return {row.get(key, ""): row.get(column, "") for row in self._tables[table].rows}

    def cell(self, table: str, column: str, **cells: str) -> str:
        """What the first row of ``table`` that has all these ``cells`` says in ``column``; empty where none has."""
        rows = self._tables[table].rows
        return next((row.get(column, "") for row in rows if cells.items() <= row.items()), "")

    def about(self, thing: str, message: str) -> Place:
        """As :meth:`thing`; where ``message`` first names a tag for which that has a row of its own, that row."""
        named, quoted = _NAMED.match(thing), re.search(r"'([^']+)'", message)
        if named and quoted and named["kind"] in _TAG:
            table, column = _TAG[named["kind"]]
            place = self.row(table, **{column: named["name"], "tag": quoted[1]})
            if place.row is not None:
                return place
        return self.thing(thing)

    def thing(self, thing: str) -> Place:
        """Where ``thing`` is stated, as a message names it: ``limit 'LIM-T-HIGH'``, ``trips.csv row 2 ('x')``."""
        if stated := _ROW.match(thing):
            return Place(f"{FOLDER}/{stated['file']}", int(stated["row"]), (stated["key"] or "").strip("'"))
        if serves := _SERVES.match(thing):
            return self.row("fallback_limits", strategy=serves["strategy"], limit=serves["limit"])
        if (named := _NAMED.match(thing)) and named["kind"] in _TABLES:
            table, column = _TABLES[named["kind"]]
            return self.row(table, **{column: named["name"]})
        if thing.endswith(".csv"):
            return Place(f"{FOLDER}/{thing}")
        return self._of_graph(thing)

    def _of_graph(self, name: str) -> Place:
        """Where that of a name in the graph is stated: ``feature_F-MASS``, ``B204``, ``step_drain_3``."""
        for kind, (table, column) in _TABLES.items():
            known = {row.get(column) for row in self._tables[table].rows}
            for short in (name, name.removeprefix(f"{kind.replace(' ', '_')}_")):
                if short in known:
                    return self.row(table, **{column: short})
        for table, column in _TABLES.values():  # the name of a step has that of its strategy in it
            for cell in sorted({row.get(column, "") for row in self._tables[table].rows}, key=len, reverse=True):
                if cell and f"_{cell}_" in name:
                    return self.row(table, **{column: cell})
        return Place(f"{FOLDER}/*.csv", None, name)


def setting(message: str) -> tuple[Place, str]:
    """Place and rest of a message about settings: ``site/case.toml line 3: twin, errors: there is ...``."""
    stated = _SETTING.match(message)
    line, rest = (int(stated["line"]) if stated["line"] else None, stated["rest"]) if stated else (None, message)
    keys, separator, said = rest.partition(": ")
    if separator and re.fullmatch(r"[\w'., -]+", keys):
        return Place(SETTINGS, line, keys), said
    return Place(SETTINGS, line), rest
