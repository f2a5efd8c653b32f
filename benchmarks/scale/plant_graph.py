"""The knowledge graph of a site: modules that are copies of the two reference plants, coupled by shared headers.

Module k says everything that its plant's ``plant.ttl`` says, in a namespace of its own. Ten modules in a row share four
headers. The site says what the headers are (VDI 2206), what they do (VDI/VDE 3682) and how they behave, and ties them
to the process operators of the modules with the properties that the plants themselves use; it states nothing else about
a module.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Final

from pyoxigraph import NamedNode, RdfFormat, Triple, parse, serialize

from benchmarks.scale.header_graph import HEADERS, SITE, connections, equipment_triples, header_triples
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.vocabulary.tbox import load_ontology
from homeostat.knowledge.vocabulary.vocabulary import RDF, VDI2206, VDI3682, CPSMod
from homeostat.plants.files.folder import INSTALLED

KINDS: Final = ("mixing_module", "cstr")
"""Plants that modules are copies of, in turn."""
ROOTS: Final = {"mixing_module": "equipment_MixingModule", "cstr": "equipment_CSTR"}
"""The whole of each plant, a System."""
GROUP: Final = 10
"""Most modules that share a header."""


def kind_of(module: int, first: str = KINDS[0]) -> str:
    """Plant that a module, counted from 1, is a copy of; ``first``: that of module 1."""
    return KINDS[(KINDS.index(first) + module - 1) % len(KINDS)]


def group_of(module: int) -> int:
    """Number of the group of headers that a module, counted from 1, is tied to; counted from 1."""
    return (module - 1) // GROUP + 1


def namespace(module: int) -> str:
    """Where the things of a module live."""
    return f"urn:homeostat:site:m{module:04d}#"


def load_site(modules: int, first: str = KINDS[0]) -> EmbeddedStore:
    """The graph of a site of that many modules in memory, with the T-Box in its own graph."""
    store = EmbeddedStore()
    load_ontology(store)
    for module in range(1, modules + 1):
        store.load(module_text(module, kind_of(module, first)), RdfFormat.N_TRIPLES)
    store.load(_n_triples(site_triples(modules, first)), RdfFormat.N_TRIPLES)
    return store


def module_text(module: int, kind: str) -> bytes:
    """Everything that the plant ``kind`` says, about a module of its own, as N-Triples."""
    return _case_text(kind).replace(f"<urn:homeostat:{kind}#".encode(), f"<{namespace(module)}".encode())


@cache
def _case_text(kind: str) -> bytes:
    quads = parse(path=INSTALLED / kind / "plant.ttl", format=RdfFormat.TURTLE)
    return _n_triples(quad.triple for quad in quads)


def _n_triples(triples: Iterable[Triple]) -> bytes:
    written = serialize(triples, format=RdfFormat.N_TRIPLES)
    assert written is not None  # only what is written to a file returns nothing
    return written


def site_triples(modules: int, first: str = KINDS[0]) -> Iterator[Triple]:
    """What the site says beyond its modules."""
    system, site, process = (NamedNode(SITE + name) for name in ("system", "equipment_SITE", "process"))
    yield Triple(system, RDF.type, CPSMod.SystemModel)
    yield Triple(system, CPSMod.consistsOfStructureModel, site)
    yield Triple(system, CPSMod.consistsOfFunctionModel, process)
    yield Triple(process, RDF.type, VDI3682.Process)
    yield from equipment_triples(site, VDI2206.System, "SITE", "Site")
    for module in range(1, modules + 1):
        kind = kind_of(module, first)
        yield Triple(site, VDI2206.SystemConsistsOfSystem, NamedNode(namespace(module) + ROOTS[kind]))
        yield Triple(system, CPSMod.consistsOfDiagnosticModel, NamedNode(f"{namespace(module)}diagnosticModel"))
        for header in HEADERS:
            yield from connections(header, group_of(module), kind, namespace(module))
    for group in range(1, group_of(modules) + 1):
        for header in HEADERS:
            yield from header_triples(header, group, site)
