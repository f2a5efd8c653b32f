"""Which tables a graph was built from, and whether they are still the same."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse

from .graph_error import Code, GraphError
from .vocabulary import HS, RDF


def sources(system: NamedNode, folder: Path, tables: Iterable[str]) -> Iterator[Triple]:
    """That ``system`` was built from ``tables``, files relative to ``folder``, each with its hash."""
    namespace, _, _ = system.value.rpartition("#")
    for table in sorted(set(tables)):
        node = NamedNode(f"{namespace}#table_{Path(table).stem}")
        yield Triple(system, HS.wasBuiltFrom, node)
        yield Triple(node, RDF.type, HS.SourceTable)
        yield Triple(node, HS.fileName, Literal(table))
        yield Triple(node, HS.sha256, Literal(_hash(folder / table)))


def stale_tables(folder: Path, graph: bytes, format: RdfFormat = RdfFormat.TURTLE) -> tuple[str, ...]:
    """Tables that are not as they were when ``graph`` was built, relative to ``folder``, sorted."""
    names: dict[str, str] = {}
    hashes: dict[str, str] = {}
    for triple in parse(graph, format=format):
        if isinstance(triple.object, Literal) and triple.predicate in (HS.fileName, HS.sha256):
            entries = names if triple.predicate == HS.fileName else hashes
            entries[str(triple.subject)] = triple.object.value
    return tuple(sorted(name for node, name in names.items() if _changed(folder / name, hashes.get(node))))


def refuse_stale(folder: Path, graph: bytes) -> None:
    """GraphError where a table changed after ``graph`` was built."""
    if stale := stale_tables(folder, graph):
        message = f"was built before {', '.join(stale)} changed; run 'make graph'"
        raise GraphError(Code.STALE_GRAPH, f"graph of {folder.name!r}", message)


def _changed(path: Path, recorded: str | None) -> bool:
    return not path.is_file() or _hash(path) != recorded


def _hash(path: Path) -> str:
    """SHA-256 in lower-case hexadecimal; line ends count as one byte, however the file was checked out."""
    return hashlib.sha256(path.read_bytes().replace(b"\r\n", b"\n")).hexdigest()
