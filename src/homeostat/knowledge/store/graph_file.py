"""A graph in a file, in any of the RDF formats: the file's ending says which."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from pyoxigraph import NamedNode, RdfFormat, Triple, parse, serialize

from homeostat.knowledge.store import answers
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.former import in_terms

FORMATS: Final = {
    ".ttl": RdfFormat.TURTLE,
    ".nt": RdfFormat.N_TRIPLES,
    ".jsonld": RdfFormat.JSON_LD,
    ".rdf": RdfFormat.RDF_XML,
    ".owl": RdfFormat.RDF_XML,
    ".trig": RdfFormat.TRIG,
    ".nq": RdfFormat.N_QUADS,
}
"""Ending of a file -> its format."""
MOST_ENTITY: Final = 1000
"""Longest text that an abbreviation (an entity) of RDF/XML stands for [byte]; editors abbreviate addresses by them."""
_ENTITY: Final = re.compile(rb"""<!ENTITY\s+([^\s"']+)\s+(?:"([^"]*)"|'([^']*)')""")


class UnreadableGraph(ValueError):
    """A file that is no graph; one line that names the file and the remedy."""


def load_file(store: GraphStore, path: Path, graph: NamedNode | None = None, content: bytes | None = None) -> None:
    """Add what the file says to ``graph``, or to the default graph; ``content``: what it says, where that is known.

    A plant's export often wraps all it says into one named graph. The names of graphs say nothing about the plant, so
    everything in the file is read as one graph. Nothing is fetched: JSON-LD must carry its context with it.
    UnreadableGraph where the ending is unknown, the content is not what it says, or says nothing; QueryRejected where a
    value in it is longer than ``store`` reads; OSError as the file.
    """
    load_triples(store, _triples(path, path.read_bytes() if content is None else content), graph)


def load_triples(store: GraphStore, triples: Iterable[Triple], graph: NamedNode | None = None) -> None:
    """Add ``triples``, former terms as they are called today."""
    content = serialize(map(in_terms, triples), format=RdfFormat.N_TRIPLES)
    assert content is not None  # only what is written to a file returns nothing
    store.load(content, RdfFormat.N_TRIPLES, graph)


def _triples(path: Path, content: bytes) -> tuple[Triple, ...]:
    format = FORMATS.get(path.suffix.lower())
    if format is None:
        raise UnreadableGraph(f"{str(path)!r} has no ending of an RDF format; name it {', '.join(FORMATS)}")
    if format == RdfFormat.RDF_XML:
        _refuse_swelling(path, content)
    try:
        found = tuple(quad.triple for quad in parse(content, format=format))
    except (SyntaxError, ValueError, MemoryError) as error:  # the last one: a value is longer than the parser reads
        raise UnreadableGraph(f"{str(path)!r} is no {format.name}: {answers.one_line(error)}") from error
    if not found:
        raise UnreadableGraph(f"{str(path)!r} is {format.name} that says nothing: it has no triple")
    return found


def _refuse_swelling(path: Path, content: bytes) -> None:
    """UnreadableGraph where an entity stands for another one, or for much: a small file would fill the memory."""
    for found in _ENTITY.finditer(content):
        value = found[2] or found[3] or b""
        if b"&" in value or len(value) > MOST_ENTITY:
            what = "names another one" if b"&" in value else f"stands for {len(value)} bytes"
            raise UnreadableGraph(
                f"{str(path)!r}: the entity {found[1][:40].decode('utf-8', 'replace')!r} {what}; one may stand for "
                f"{MOST_ENTITY} bytes of text: write out what it stands for"
            )
