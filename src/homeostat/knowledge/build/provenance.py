"""Which files a graph was built from, whether they are still the same, and the seal of a generated file.

The seal is the last line: the hash of all lines before it, so that a change by hand is seen. It is a comment in Turtle
and in our CSV files. Line ends count as one byte, however a file was checked out. A seal protects against mistakes, not
against somebody who computes a new one; that is what signatures are for.
"""

import hashlib
import re
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import Final
from urllib.parse import quote

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse

from homeostat.domain.plant.timing import Timing
from homeostat.knowledge.build.tables.reading import is_short
from homeostat.knowledge.build.timing import timing_of
from homeostat.knowledge.store.error import GraphError
from homeostat.knowledge.vocabulary.vocabulary import HS, RDF, XSD

_SEAL: Final = re.compile(rb"# sha256 ([0-9a-f]{64})\n\Z")


def with_one_line_end(content: bytes) -> bytes:
    """``content`` with LF at the end of every line."""
    return content.replace(b"\r\n", b"\n")


def sha256(content: bytes) -> str:
    """SHA-256 in lower-case hexadecimal, whatever the line ends are."""
    return hashlib.sha256(with_one_line_end(content)).hexdigest()


def seal(content: bytes) -> bytes:
    """``content`` with its seal as the last line; ``content`` must end with a line end."""
    return content + f"# sha256 {sha256(content)}\n".encode("ascii")


def is_sealed(content: bytes) -> bool:
    """Whether ``content`` is as it was sealed: not a byte before the last line has changed."""
    plain = with_one_line_end(content)
    found = _SEAL.search(plain)
    return found is not None and found[1].decode("ascii") == sha256(plain[: found.start()])


MAPPING: Final = "mapping.rml.ttl"
"""Name of the mapping, the same one for every plant."""


DERIVED: Final = "derived"
"""Stands for the rows that follow from others, among the files that a graph was built from."""
_SETTINGS: Final = "case.toml"


def namespace_of(folder: Path) -> str:
    """Where the plant's things live: where its settings say that its system is, or else after the folder's name."""
    try:
        system = str(tomllib.loads((folder / _SETTINGS).read_text("utf-8"))["system"])
    except (OSError, ValueError, KeyError, RecursionError):  # whoever needs the settings says what is wrong with them
        system = f"urn:homeostat:{quote(folder.resolve().name)}#system"
    return system.rpartition("#")[0] + "#"


def sources(system: NamedNode, folder: Path, tables: Iterable[str]) -> Iterator[Triple]:
    """That ``system`` was built from ``tables``, relative to ``folder``, and from the mapping, each with its hash.

    So it is with all rows together where some follow from others: a package that derives other ones makes it stale.
    """
    namespace, _, _ = system.value.rpartition("#")
    for table in sorted({*tables, MAPPING, *([DERIVED] if is_short(folder) else [])}):
        node = NamedNode(f"{namespace}#table_{Path(table).stem}")
        yield Triple(system, HS.wasBuiltFrom, node)
        yield Triple(node, RDF.type, HS.SourceTable)
        yield Triple(node, HS.fileName, Literal(table))
        yield Triple(node, HS.sha256, Literal(_hash(folder, table) or ""))


def timing(system: NamedNode, folder: Path) -> Iterator[Triple]:
    """How often the plant is sampled and how fast it is, where that is not as where nothing is stated."""
    found = timing_of(folder)
    if found != Timing():
        yield Triple(system, HS.tick, Literal(str(found.tick_s), datatype=XSD.double))
        yield Triple(system, HS.response, Literal(str(found.response_s), datatype=XSD.double))


def stale_tables(folder: Path, graph: bytes, format: RdfFormat = RdfFormat.TURTLE) -> tuple[str, ...]:
    """Files that are not as they were when ``graph`` was built, or came later, relative to ``folder``, sorted."""
    names: dict[str, str] = {}
    hashes: dict[str, str] = {}
    told: dict[NamedNode, float] = {}
    for triple in parse(graph, format=format):
        if isinstance(triple.object, Literal) and triple.predicate in (HS.tick, HS.response):
            told[triple.predicate] = float(triple.object.value)
        if isinstance(triple.object, Literal) and triple.predicate in (HS.fileName, HS.sha256):
            entries = names if triple.predicate == HS.fileName else hashes
            entries[str(triple.subject)] = triple.object.value
    stale = {name for node, name in names.items() if name != DERIVED and _changed(folder, name, hashes.get(node))}
    mine = f"<{namespace_of(folder)}"
    now, usual = timing_of(folder), Timing()
    built = told.get(HS.tick, usual.tick_s), told.get(HS.response, usual.response_s)
    if not all(node.startswith(mine) for node in names) or built != (now.tick_s, now.response_s):
        stale.add(_SETTINGS)
    stale |= _unread(folder, names.values())
    if not stale:  # or else what follows from the tables need not be worked out
        stale = {name for node, name in names.items() if name == DERIVED and _changed(folder, name, hashes.get(node))}
    return tuple(sorted(stale))


def source_words(name: str) -> str:
    """What a message calls a file that `stale_tables` names."""
    if name == MAPPING:
        return "the package's mapping"
    if name == DERIVED:
        return "what follows from the tables"
    return f"table {name!r}" if name.endswith(".csv") else repr(name)


def _unread(folder: Path, recorded: Iterable[str]) -> set[str]:
    """Tables beside the recorded ones that are not recorded."""
    known = set(recorded)
    beside = {str(PurePosixPath(name).parent) for name in known if name.endswith(".csv")}
    found = {path.relative_to(folder).as_posix() for parent in beside for path in (folder / parent).glob("*.csv")}
    return found - known


def _hash(folder: Path, name: str) -> str | None:
    """Hash of a source as it is now, None where there is no such file; GraphError where nothing follows from tables."""
    if name == DERIVED:
        from homeostat.knowledge.build.derived.tables import digest  # most plants are loaded without the schemas

        return digest(folder)
    path = Path(__file__).with_name(MAPPING) if name == MAPPING else folder / name
    return sha256(path.read_bytes()) if path.is_file() else None


def _changed(folder: Path, name: str, recorded: str | None) -> bool:
    try:
        found = _hash(folder, name)
    except GraphError:
        return True
    return found is None or found != recorded
