"""The knowledge graph of a site: modules that are copies of the two reference cases, coupled by shared headers.

Module k says everything that its case's ``plant.ttl`` says, in a namespace of its own. Ten modules in a row share four
headers. The site says what the headers are (VDI 2206), what they do (VDI/VDE 3682) and how they behave, and ties them
to the process operators of the modules with the properties that the cases themselves use; it states nothing else about
a module.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Final

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse, serialize

from homeostat.cases.case import CASES
from homeostat.knowledge.embedded import EmbeddedStore
from homeostat.knowledge.tbox import load_ontology
from homeostat.knowledge.vocabulary import HS, RDF, RDFS, VDI2206, VDI3682, CPSMod

KINDS: Final = ("mixing_module", "cstr")
"""Cases that modules are copies of, in turn."""
ROOTS: Final = {"mixing_module": "equipment_MixingModule", "cstr": "equipment_CSTR"}
"""The whole plant of each case, a System."""
GROUP: Final = 10
"""Most modules that share a header."""
SITE: Final = "urn:homeostat:site#"
"""Namespace of what belongs to no module."""


@dataclass(frozen=True, slots=True)
class Header:
    """One kind of shared header."""

    name: str
    """Name of its equipment and of its process operator."""
    label: str
    """In the engineer's words."""
    kind: NamedNode
    """Product or Energy of VDI/VDE 3682."""
    equation: str
    """What it does, as text; empty where it does not act back on the modules."""
    users: dict[str, tuple[str, ...]]
    """Case -> process operators that take from the header."""
    givers: dict[str, tuple[str, ...]]
    """Case -> process operators that give to the header."""
    given: dict[str, str]
    """Case -> flow of the module that is given; one flow of the header where a case is missing."""


HEADERS: Final = (
    Header(
        "CW", "Cooling water", VDI3682.Product, "C dT/dt = sum(Q) - K (T - T_air)",
        {"cstr": ("PO_Cool",)}, {"cstr": ("PO_Cool",)}, {},
    ),
    Header(
        "FM", "Feed main", VDI3682.Product, "p / p0 = 1 - a (sum(F) / F_design)^2",
        {"cstr": ("PO_Feed",), "mixing_module": ("PO_Fill_B201", "PO_Fill_B202", "PO_Fill_B203")}, {}, {},
    ),
    Header(
        "EL", "Electric supply", VDI3682.Energy, "",
        {"cstr": ("PO_Withdraw",), "mixing_module": ("PO_PumpMain", "PO_PumpBypass")}, {}, {},
    ),
    Header(
        "PR", "Product header", VDI3682.Product, "", {},
        {"cstr": ("PO_Withdraw",), "mixing_module": ("PO_Drain",)},
        {"cstr": "flow_product_stream", "mixing_module": "flow_product"},
    ),
)  # fmt: skip
"""What the modules of a group share."""


def kind_of(module: int, first: str = KINDS[0]) -> str:
    """Case that a module, counted from 1, is a copy of; ``first``: that of module 1."""
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
    store.load(serialize(site_triples(modules, first), format=RdfFormat.N_TRIPLES), RdfFormat.N_TRIPLES)
    return store


def module_text(module: int, kind: str) -> bytes:
    """Everything that the case ``kind`` says, about a module of its own, as N-Triples."""
    return _case_text(kind).replace(f"<urn:homeostat:{kind}#".encode(), f"<{namespace(module)}".encode())


@cache
def _case_text(kind: str) -> bytes:
    quads = parse(path=CASES / kind / "plant.ttl", format=RdfFormat.TURTLE)
    return serialize((quad.triple for quad in quads), format=RdfFormat.N_TRIPLES)


def site_triples(modules: int, first: str = KINDS[0]) -> Iterator[Triple]:
    """What the site says beyond its modules."""
    site = NamedNode(f"{SITE}equipment_SITE")
    yield from _named(site, VDI2206.System, "Site")
    yield Triple(site, RDF.type, VDI2206.BasicSystem)
    for module in range(1, modules + 1):
        kind = kind_of(module, first)
        yield Triple(site, VDI2206.SystemConsistsOfSystem, NamedNode(namespace(module) + ROOTS[kind]))
        for header in HEADERS:
            yield from _connections(header, module, kind)
    for group in range(1, group_of(modules) + 1):
        for header in HEADERS:
            yield from _header(header, group, site)


def _header(header: Header, group: int, site: NamedNode) -> Iterator[Triple]:
    equipment, operator, flow = (_of_site(what, header, group) for what in ("equipment", "operator", "flow"))
    yield from _named(equipment, VDI2206.Module, header.label)
    yield Triple(equipment, RDF.type, VDI2206.BasicSystem)
    yield Triple(equipment, VDI2206.isPartOf, site)
    yield Triple(site, VDI2206.SystemConsistsOfModule, equipment)
    yield from _named(operator, VDI3682.ProcessOperator, header.label)
    yield Triple(operator, VDI3682.isAssignedTo, equipment)
    yield Triple(operator, VDI3682.hasOutput, flow)
    yield from _named(flow, header.kind, header.label)
    if header.equation:
        equation = _of_site("equation", header, group)
        yield from _named(equation, VDI2206.MathematicalModel, header.label)
        yield Triple(equation, HS.equationText, Literal(header.equation))
        yield Triple(operator, CPSMod.processRealizesBehavior, equation)


def _connections(header: Header, module: int, kind: str) -> Iterator[Triple]:
    group, own = group_of(module), namespace(module)
    operator = _of_site("operator", header, group)
    for name in header.users.get(kind, ()):
        user = NamedNode(f"{own}operator_{name}")
        yield Triple(user, VDI3682.hasInput, _of_site("flow", header, group))
        yield Triple(operator, VDI3682.hasSuccessor, user)
        yield Triple(user, VDI3682.hasPredecessor, operator)
    for name in header.givers.get(kind, ()):
        giver = NamedNode(f"{own}operator_{name}")
        given = NamedNode(own + header.given[kind]) if header.given else _of_site("return", header, group)
        yield Triple(giver, VDI3682.hasOutput, given)
        yield Triple(operator, VDI3682.hasInput, given)
        yield Triple(giver, VDI3682.hasSuccessor, operator)
        yield Triple(operator, VDI3682.hasPredecessor, giver)
        if not header.given:
            yield from _named(given, header.kind, f"{header.label}, return")


def _named(thing: NamedNode, kind: NamedNode, label: str) -> Iterator[Triple]:
    yield Triple(thing, RDF.type, kind)
    yield Triple(thing, RDFS.label, Literal(label, language="en"))


def _of_site(what: str, header: Header, group: int) -> NamedNode:
    return NamedNode(f"{SITE}{what}_{header.name}{group:03d}")
