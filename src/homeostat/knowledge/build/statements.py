"""What a plant's tables say, as triples: each line of ``statements.csv``, said about every row of its table.

A line has a subject, a property, an object and the kind of that object, with columns in braces; an empty cell makes no
statement. ``mapping.rml.ttl`` states the same in RML; ``make graph`` lets morph-kgc carry that out, and compares.
"""

from collections.abc import Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path
from typing import Final
from urllib.parse import quote

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.knowledge.build.tables.reading import FOLDER, OPTIONAL, SHORT, Rows, is_short, read_rows
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.vocabulary.vocabulary import PREFIXES, XSD

SCRATCH: Final = "urn:homeostat:table#"
"""Namespace of the words of the tables that the rules translate; none of it is left in a finished graph."""
MAPPED: Final = "urn:homeostat:plant#"
"""Where every plant's things live in the RML mapping."""
_NAMESPACES: Final = {**dict(PREFIXES), "table": SCRATCH}


@cache
def _statements() -> tuple[Mapping[str, str], ...]:
    return read_rows(Path(__file__).with_name("statements.csv")).rows


def table_files(folder: Path) -> tuple[str, ...]:
    """The tables of the plant in ``folder`` that are read, relative to it, sorted; without those that it may lack."""
    named, short = _tables(), is_short(folder)
    needed = frozenset[str]() if short else named - OPTIONAL
    read = named | SHORT if short else named
    return tuple(_file(name) for name in sorted(read) if name in needed or (folder / _file(name)).exists())


def _tables() -> frozenset[str]:
    return frozenset(statement["table"] for statement in _statements())


def stated(folder: Path, namespace: str) -> frozenset[Triple]:
    """Everything that the tables of the plant in ``folder`` say, its things in ``namespace``.

    Raises GraphError where a table cannot be read or a row has no name; what else is wrong in it others find.
    """
    rows = _rows(folder)
    return frozenset(
        triple for statement in _statements() for triple in _said(statement, rows[statement["table"]], namespace)
    )


def _rows(folder: Path) -> Mapping[str, Rows]:
    """Table -> its rows, with those that follow from others."""
    if is_short(folder):
        from homeostat.knowledge.build.derived.tables import tables  # other plants are built without the schemas

        return tables(folder)
    return {name: read_rows(folder / _file(name)) for name in _tables()}


def _said(statement: Mapping[str, str], table: Rows, namespace: str) -> Iterator[Triple]:
    """One statement about each row of ``table`` whose cells it needs."""
    subject, verb = (_iri(statement[part], namespace) for part in ("subject", "property"))
    kind, item = statement["kind"], statement["object"]
    thing = _iri(item, namespace) if kind == "thing" else None
    for number, row in enumerate(table.rows):
        cells = {column: cell for column, cell in row.items() if cell}
        names = {column: _quoted(cell) for column, cell in cells.items()}
        try:
            about = NamedNode(subject.format_map(names))
        except KeyError as empty:
            message = f"column {empty} is empty, but names the row"
            raise GraphError(Code.BAD_TABLE, table.place(statement["table"], number), message) from None
        try:
            value = NamedNode(thing.format_map(names)) if thing else _literal(item.format_map(cells), kind)
            yield Triple(about, NamedNode(verb.format_map(names)), value)
        except KeyError:  # the cell is empty
            continue


@lru_cache(maxsize=8192)
def _quoted(cell: str) -> str:
    """A cell as a part of an IRI; every statement about a row quotes the same few."""
    return quote(cell, safe="")


def _iri(name: str, namespace: str) -> str:
    """The IRI that ``name`` is short for; without a prefix it is one of the plant's own."""
    prefix, colon, local = name.rpartition(":")
    return (_NAMESPACES[prefix] if colon else namespace) + local


def _literal(text: str, kind: str) -> Literal:
    if kind == "english":
        return Literal(text, language="en")
    return Literal(text) if kind == "text" else Literal(text, datatype=XSD[kind])


def _file(table: str) -> str:
    return f"{FOLDER}/{table}.csv"
