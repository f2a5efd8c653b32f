"""The terms of the T-Box that code names, one closed namespace per vocabulary; queries and shapes use more of them.

A term is a pyoxigraph NamedNode: ``UML.State``, ``HS.formula``. A name that is not listed does not exist.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from pyoxigraph import NamedNode

from homeostat.stl.spelling import near_matches


class ClosedNamespace(type):
    """Metaclass: turns every annotated name of the class body into the term of that name, and refuses all others.

    ``class UML(metaclass=ClosedNamespace, iri="http://...#"): State: NamedNode`` gives ``UML.State``.
    A type checker sees the annotations; at run time an unknown name raises AttributeError naming the nearest terms.
    """

    iri: str
    """The namespace IRI that every term starts with."""
    terms: tuple[NamedNode, ...]
    """All terms, in the order written."""

    def __new__(mcs, name: str, bases: tuple[type, ...], body: dict[str, Any], *, iri: str) -> ClosedNamespace:
        """Fill the annotated names in with terms of namespace ``iri``."""
        filled = {term: NamedNode(iri + term) for term in body.get("__annotations__", {})}
        return super().__new__(mcs, name, bases, {**body, **filled, "iri": iri, "terms": tuple(filled.values())})

    def __init__(cls, name: str, bases: tuple[type, ...], body: dict[str, Any], *, iri: str) -> None:
        """Accept the keyword that ``__new__`` used."""
        super().__init__(name, bases, body)

    if not TYPE_CHECKING:  # a type checker must go by the annotations alone

        def __getattr__(cls, name: str) -> NoReturn:
            """Refuse a name that is no term."""
            raise AttributeError(cls._unknown(name))

    def __setattr__(cls, name: str, value: object) -> None:
        """Refuse to add or change a term, except what the interpreter itself keeps on classes."""
        if not name.startswith("__"):
            raise AttributeError(f"namespace {cls.__name__} is closed: {name!r} cannot be set")
        super().__setattr__(name, value)

    def __getitem__(cls, name: str) -> NamedNode:
        """The term of local name ``name``, for names read from data; KeyError naming the nearest terms otherwise."""
        term = NamedNode(cls.iri + name)
        if term not in cls.terms:
            raise KeyError(cls._unknown(name))
        return term

    def _unknown(cls, name: str) -> str:
        known = [term.value.removeprefix(cls.iri) for term in cls.terms]
        return f"term {name!r} is not in namespace {cls.__name__} <{cls.iri}>{near_matches(name, known)}"


class RDF(metaclass=ClosedNamespace, iri="http://www.w3.org/1999/02/22-rdf-syntax-ns#"):
    """RDF itself: the terms used here."""

    type: NamedNode
    first: NamedNode
    rest: NamedNode
    nil: NamedNode


class RDFS(metaclass=ClosedNamespace, iri="http://www.w3.org/2000/01/rdf-schema#"):
    """RDF Schema: the terms used here."""

    label: NamedNode
    comment: NamedNode
    subClassOf: NamedNode
    subPropertyOf: NamedNode


class XSD(metaclass=ClosedNamespace, iri="http://www.w3.org/2001/XMLSchema#"):
    """XML Schema datatypes: the ones used here."""

    string: NamedNode
    boolean: NamedNode
    integer: NamedNode
    double: NamedNode
    decimal: NamedNode


class VDI2206(metaclass=ClosedNamespace, iri="http://www.w3id.org/hsu-aut/VDI2206#"):
    """VDI 2206: what the plant is made of."""

    Component: NamedNode
    hasInput: NamedNode
    hasInterface: NamedNode
    hasOutput: NamedNode


class VDI3682(metaclass=ClosedNamespace, iri="http://www.w3id.org/hsu-aut/VDI3682#"):
    """VDI/VDE 3682: what the plant does to products, energy and information."""

    hasInput: NamedNode
    hasOutput: NamedNode


class UML(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/UMLStateMachine#"):
    """UML state machines: how the plant behaves over time."""

    State: NamedNode
    StateMachine: NamedNode
    Transition: NamedNode
    containsState: NamedNode
    transitionEvent: NamedNode
    transitionGuard: NamedNode


class DIN17359(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/DIN17359#"):
    """DIN ISO 17359: from parameters over symptoms to faults."""

    ParameterIsDescribedByFeature: NamedNode


class DINEN61360(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/DINEN61360#"):
    """DIN EN 61360: data elements, their type and their values."""

    Instance_Description: NamedNode
    Type_Description: NamedNode


class M(metaclass=ClosedNamespace, iri="http://openmath.org/vocab/math#"):
    """OpenMath in RDF: equations as expression trees."""

    Application: NamedNode
    Literal: NamedNode
    ObjectList: NamedNode
    Symbol: NamedNode
    Variable: NamedNode
    arguments: NamedNode
    operator: NamedNode
    name: NamedNode
    value: NamedNode


class CPSMod(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/CPSMod#"):
    """CPSMod: the system model that joins structure, function, behaviour and diagnosis."""

    SystemModel: NamedNode


class HS(metaclass=ClosedNamespace, iri="urn:homeostat:ontology#"):
    """Our extension: signals, limits, command values, fault effects, symptoms, recovery, model parameters."""

    # signals
    Tag: NamedNode
    name: NamedNode
    unit: NamedNode
    belongsTo: NamedNode
    # structure and loops
    isConnectedTo: NamedNode
    # limits
    formula: NamedNode
    constrains: NamedNode
    # behaviour
    settledWhen: NamedNode
    isInitialState: NamedNode
    # faults, symptoms, recovery
    featureExpression: NamedNode
    accumulationExpression: NamedNode
    usesTag: NamedNode
    Waiver: NamedNode
    FallbackEffect: NamedNode
    # the guard
    QualityRule: NamedNode
    TripRule: NamedNode
    WriteRule: NamedNode
    StartUpLimit: NamedNode
    carrierFormula: NamedNode
    startUpFormula: NamedNode
    # physics
    ModelParameter: NamedNode
    symbol: NamedNode
    value: NamedNode
    equationText: NamedNode
    denotes: NamedNode
    # provenance of the graph
    SourceTable: NamedNode
    wasBuiltFrom: NamedNode
    fileName: NamedNode
    sha256: NamedNode


PREFIXES: tuple[tuple[str, str], ...] = (
    ("VDI2206", VDI2206.iri),
    ("VDI3682", VDI3682.iri),
    ("UML", UML.iri),
    ("DIN17359", DIN17359.iri),
    ("DINEN61360", DINEN61360.iri),
    ("M", M.iri),
    ("sosa", "http://www.w3.org/ns/sosa/"),
    ("CPSMod", CPSMod.iri),
    ("hs", HS.iri),
    ("rdf", RDF.iri),
    ("rdfs", RDFS.iri),
    ("xsd", XSD.iri),
)
"""Prefix and namespace IRI, as written in our Turtle and SPARQL files."""
