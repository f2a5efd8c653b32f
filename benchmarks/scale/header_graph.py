"""What the graph of a site says about its shared headers, in the terms of VDI 2206 and VDI/VDE 3682."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from pyoxigraph import Literal, NamedNode, Triple

from homeostat.knowledge.vocabulary.openmath import equation
from homeostat.knowledge.vocabulary.vocabulary import HS, RDF, RDFS, VDI2206, VDI3682, CPSMod

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
    """What it does, with ``{0}`` for the number of the group; empty where it does not act back on the modules."""
    users: dict[str, tuple[str, ...]]
    """Plant -> process operators that take from the header."""
    givers: dict[str, tuple[str, ...]]
    """Plant -> process operators that give to the header."""
    given: dict[str, str]
    """Plant -> flow of the module that is given; one flow of the header where a plant is missing."""


HEADERS: Final = (
    Header(
        "CW", "Cooling water", VDI3682.Product,
        "dT_CW{0}/dt = (Q_CW{0} - K_CW{0} * (T_CW{0} - T_air)) / C_CW{0}",
        {"cstr": ("PO_Cool",)}, {"cstr": ("PO_Cool",)}, {},
    ),
    Header(
        "FM", "Feed main", VDI3682.Product,
        "p_FM{0} = p_supply * (1 - a_FM{0} * F_FM{0} * F_FM{0})",
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


def header_triples(header: Header, group: int, site: NamedNode) -> Iterator[Triple]:
    """What ``header`` of ``group``, a part of ``site``, is, does and behaves like."""
    equipment, operator, flow = (_of_site(what, header, group) for what in ("equipment", "operator", "flow"))
    name = equipment.value.rpartition("_")[2]
    yield from equipment_triples(equipment, VDI2206.Module, name, header.label)
    yield Triple(equipment, VDI2206.isPartOf, site)
    yield Triple(site, VDI2206.SystemConsistsOfModule, equipment)
    yield from _named(operator, VDI3682.ProcessOperator, header.label)
    yield Triple(operator, VDI3682.shortName, Literal(f"PO_{name}"))
    yield Triple(operator, VDI3682.isAssignedTo, equipment)
    yield Triple(NamedNode(f"{SITE}process"), VDI3682.consistsOf, operator)
    yield from _flow(flow, header.kind, header.label)
    yield Triple(operator, VDI3682.hasOutput, flow)
    if not header.given:
        taken = _of_site("return" if header.givers else "intake", header, group)
        yield from _flow(taken, header.kind, f"{header.label}, {'return' if header.givers else 'intake'}")
        yield Triple(operator, VDI3682.hasInput, taken)
    if header.equation:
        node, text = _of_site("equation", header, group), header.equation.format(f"{group:03d}")
        yield from _named(node, VDI2206.MathematicalModel, header.label)
        yield Triple(node, HS.name, Literal(f"EQ-{name}"))
        yield Triple(node, HS.equationText, Literal(text))
        yield from equation(node, text, {})
        yield Triple(operator, CPSMod.processRealizesBehavior, node)
        yield Triple(NamedNode(f"{SITE}system"), CPSMod.consistsOfBehaviorModel, node)


def connections(header: Header, group: int, kind: str, own: str) -> Iterator[Triple]:
    """What ties ``header`` of ``group`` to a module: a copy of plant ``kind`` in namespace ``own``."""
    operator = _of_site("operator", header, group)
    for name in header.users.get(kind, ()):
        user = NamedNode(f"{own}operator_{name}")
        yield Triple(user, VDI3682.hasInput, _of_site("flow", header, group))
        yield Triple(operator, VDI3682.hasSuccessor, user)
        yield Triple(user, VDI3682.hasPredecessor, operator)
    for name in header.givers.get(kind, ()):
        giver = NamedNode(f"{own}operator_{name}")
        given = NamedNode(own + header.given[kind]) if header.given else _of_site("return", header, group)
        if not header.given:  # otherwise the module says so itself
            yield Triple(giver, VDI3682.hasOutput, given)
        yield Triple(operator, VDI3682.hasInput, given)
        yield Triple(giver, VDI3682.hasSuccessor, operator)
        yield Triple(operator, VDI3682.hasPredecessor, giver)


def equipment_triples(thing: NamedNode, kind: NamedNode, name: str, label: str) -> Iterator[Triple]:
    """What every piece of equipment says of itself."""
    yield from _named(thing, kind, label)
    yield Triple(thing, RDF.type, VDI2206.BasicSystem)
    yield Triple(thing, HS.name, Literal(name))
    yield Triple(thing, HS.belongsTo, NamedNode(f"{SITE}system"))


def _flow(thing: NamedNode, kind: NamedNode, label: str) -> Iterator[Triple]:
    yield from _named(thing, kind, label)
    yield Triple(thing, VDI3682.shortName, Literal(thing.value.removeprefix(SITE)))


def _named(thing: NamedNode, kind: NamedNode, label: str) -> Iterator[Triple]:
    yield Triple(thing, RDF.type, kind)
    yield Triple(thing, RDFS.label, Literal(label, language="en"))


def _of_site(what: str, header: Header, group: int) -> NamedNode:
    return NamedNode(f"{SITE}{what}_{header.name}{group:03d}")
