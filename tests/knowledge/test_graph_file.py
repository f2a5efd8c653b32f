"""Graphs in files of every format are one graph each; a file that is none is refused in a line."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyoxigraph import DefaultGraph, Literal, NamedNode, Quad, RdfFormat, serialize

from homeostat.cli.arguments import ENDINGS
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.graph_file import FORMATS, UnreadableGraph, load_file
from homeostat.knowledge.store.store import QueryRejected

GRAPH = NamedNode("urn:graph#plant")
FACTS = (
    Quad(NamedNode("urn:plant#a"), NamedNode("urn:plant#feeds"), NamedNode("urn:plant#b"), GRAPH),
    Quad(NamedNode("urn:plant#a"), NamedNode("urn:plant#name"), Literal("Pumpe für Wärme"), DefaultGraph()),
)
ALL = "CONSTRUCT { ?s ?p ?o } WHERE { ?s ?p ?o }"


@pytest.mark.parametrize("ending", [*FORMATS, ".TTL"])
def test_every_format_is_one_graph(tmp_path: Path, ending: str) -> None:
    format = FORMATS[ending.lower()]
    facts = FACTS if format.supports_datasets else [fact.triple for fact in FACTS]
    path = tmp_path / f"plant{ending}"
    path.write_bytes(serialize(facts, format=format) or b"")
    store = EmbeddedStore()
    load_file(store, path)
    assert set(store.construct(ALL)) == {fact.triple for fact in FACTS}
    load_file(store, path, NamedNode("urn:other"))
    assert len(store.seeing(NamedNode("urn:other")).construct(ALL)) == 2


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("plant.csv", b"a,b", "has no ending of an RDF format; name it .ttl, .nt, .jsonld"),
        ("plant", b"", "has no ending"),
        ("plant.ttl", b"no : Turtle", "is no Turtle: "),
        ("plant.jsonld", b"<urn:a> <urn:b> <urn:c> .", "is no JSON-LD: "),
        ("plant.jsonld", bytes(range(256)), "is no JSON-LD: "),
        ("plant.rdf", b"<rdf", "is no RDF/XML: "),
        ("plant.jsonld", b'{"@context": "https://schema.org/", "@id": "urn:a", "name": "x"}', "is no JSON-LD: "),
        ("plant.jsonld", b'{"name": "Pump"}', "says nothing: it has no triple"),
    ],
)
def test_what_is_no_graph(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UnreadableGraph) as refused:
        load_file(EmbeddedStore(), tmp_path / name)
    assert words in str(refused.value) and repr(str(tmp_path / name)) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_help_names_every_ending() -> None:
    assert [word.strip(",") for word in ENDINGS.split() if word.startswith(".")] == list(FORMATS)
    assert set(FORMATS.values()) >= {RdfFormat.TURTLE, RdfFormat.JSON_LD}


HEAD = b'<r:RDF xmlns:r="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:e="urn:e:"><e:Pump r:about="urn:a">'
TAIL = b"</e:Pump></r:RDF>"


def abbreviated(entities: bytes, said: bytes) -> bytes:
    """RDF/XML with these entities, in which a thing has the property of what is said."""
    return b"<!DOCTYPE r [" + entities + b"]>" + HEAD + b"<e:p>" + said + b"</e:p>" + TAIL


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (abbreviated(b'<!ENTITY a "1234567890"><!ENTITY b "&a;&a;&a;">', b"&b;"), "the entity 'b' names another one"),
        (abbreviated(b"<!ENTITY a '" + 1001 * b"x" + b"'>", b"&a;"), "the entity 'a' stands for 1001 bytes"),
    ],
)
def test_a_small_file_that_swells_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    (tmp_path / "plant.owl").write_bytes(content)
    with pytest.raises(UnreadableGraph) as refused:
        load_file(EmbeddedStore(), tmp_path / "plant.owl")
    assert words in str(refused.value) and "plant.owl" in str(refused.value)


@pytest.mark.parametrize("ending", [".nt", ".owl"])
def test_a_value_that_is_longer_than_any_is_refused(tmp_path: Path, ending: str) -> None:
    much = b'<urn:a> <urn:p> "' + 2**24 * b"x" + b'" .'
    if ending == ".owl":
        much = abbreviated(b'<!ENTITY a "' + 1000 * b"x" + b'">', 17_000 * b"&a;")
    (tmp_path / f"plant{ending}").write_bytes(much)
    with pytest.raises((UnreadableGraph, QueryRejected), match="maximal size"):
        load_file(EmbeddedStore(), tmp_path / f"plant{ending}")


def test_addresses_that_an_editor_abbreviates_are_read(tmp_path: Path) -> None:
    (tmp_path / "plant.owl").write_bytes(abbreviated(b'<!ENTITY own "http://plant.example/own#">', b"&own;pump"))
    store = EmbeddedStore()
    load_file(store, tmp_path / "plant.owl")
    assert '"http://plant.example/own#pump"' in [str(triple.object) for triple in store.construct(ALL)]
