"""Which files a graph was built from, and whether they are still the same."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse

from homeostat.knowledge.build.seal import sha256
from homeostat.knowledge.vocabulary.vocabulary import HS, RDF


def sources(system: NamedNode, folder: Path, tables: Iterable[str]) -> Iterator[Triple]:
    """That ``system`` was built from ``tables`` and their mapping, files relative to ``folder``, each with its hash."""
    namespace, _, _ = system.value.rpartition("#")
    for table in sorted(set(tables)):
        node = NamedNode(f"{namespace}#table_{Path(table).stem}")
        yield Triple(system, HS.wasBuiltFrom, node)
        yield Triple(node, RDF.type, HS.SourceTable)
        yield Triple(node, HS.fileName, Literal(table))
        yield Triple(node, HS.sha256, Literal(sha256((folder / table).read_bytes())))


def stale_tables(folder: Path, graph: bytes, format: RdfFormat = RdfFormat.TURTLE) -> tuple[str, ...]:
    """Files that are not as they were when ``graph`` was built, or came later, relative to ``folder``, sorted."""
    names: dict[str, str] = {}
    hashes: dict[str, str] = {}
    for triple in parse(graph, format=format):
        if isinstance(triple.object, Literal) and triple.predicate in (HS.fileName, HS.sha256):
            entries = names if triple.predicate == HS.fileName else hashes
            entries[str(triple.subject)] = triple.object.value
    stale = {name for node, name in names.items() if _changed(folder / name, hashes.get(node))}
    return tuple(sorted(stale | _unread(folder, names.values())))


def _unread(folder: Path, recorded: Iterable[str]) -> set[str]:
    """Tables beside the recorded ones that are not recorded."""
    known = set(recorded)
    beside = {str(PurePosixPath(name).parent) for name in known if name.endswith(".csv")}
    found = {path.relative_to(folder).as_posix() for parent in beside for path in (folder / parent).glob("*.csv")}
    return found - known


def _changed(path: Path, recorded: str | None) -> bool:
    return not path.is_file() or sha256(path.read_bytes()) != recorded
