"""From tables to triples by an RML mapping. An empty cell makes no statement.

``make graph`` lets morph-kgc do the same and compares; here no other environment is needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from pyoxigraph import NamedNode, Triple

from homeostat.knowledge.build.rml_mapping import TriplesMap
from homeostat.knowledge.build.tables.reading import read_rows
from homeostat.knowledge.store.error import Code, GraphError


def materialise(maps: Iterable[TriplesMap], folder: Path) -> frozenset[Triple]:
    """All triples that the maps make of the tables under ``folder``.

    Raises GraphError that names table and row of a mistake; also for a table or a column that no map reads.
    """
    chosen = tuple(maps)
    sources = sorted({item.source for item in chosen})
    for path in sorted({path for source in sources for path in (folder / source).parent.glob("*.csv")}):
        if path not in {folder / source for source in sources}:
            raise GraphError(Code.BAD_MAPPING, path.name, "is read by no map; map it or move it away")
    tables = {source: read_rows(folder / source).rows for source in sources}
    for source in sources:
        _check_columns(Path(source).name, tables[source], tuple(item for item in chosen if item.source == source))
    return frozenset(triple for item in chosen for triple in _triples(item, tables[item.source]))


def _check_columns(table: str, rows: tuple[Mapping[str, str], ...], maps: tuple[TriplesMap, ...]) -> None:
    if not rows:
        return
    for item in maps:
        if missing := sorted(item.columns - rows[0].keys()):
            raise GraphError(Code.BAD_MAPPING, item.name, f"table {table} has no column {missing[0]!r}")
    if unread := sorted(rows[0].keys() - frozenset().union(*(item.columns for item in maps))):
        raise GraphError(Code.BAD_MAPPING, table, f"column {unread[0]!r} is read by no map; map it or remove it")


def _triples(item: TriplesMap, rows: tuple[Mapping[str, str], ...]) -> Iterator[Triple]:
    table = Path(item.source).name
    for line, row in enumerate(rows, start=2):
        subject = item.subject.term(row)
        if not isinstance(subject, NamedNode):
            empty = [column for column in item.subject.columns if not row[column]]
            raise GraphError(Code.BAD_TABLE, f"{table} row {line}", f"column {empty[0]!r} is empty, but names the row")
        made = 0
        for predicate_map, object_map in item.pairs:
            predicate, value = predicate_map.term(row), object_map.term(row)
            if isinstance(predicate, NamedNode) and value is not None:
                made += 1
                yield Triple(subject, predicate, value)
        if not made:
            raise GraphError(Code.BAD_TABLE, f"{table} row {line}", "says nothing: the cells beside its key are empty")
