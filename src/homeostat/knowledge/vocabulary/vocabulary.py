"""The terms of the T-Box that code names, one closed namespace per vocabulary; queries and shapes use more of them.

A term is a pyoxigraph NamedNode: ``UML.State``, ``HS.rateLimit``. A name that is not listed does not exist.
"""

from __future__ import annotations

from pyoxigraph import NamedNode

from homeostat.knowledge.vocabulary.namespace import ClosedNamespace


class SOSA(metaclass=ClosedNamespace, iri="http://www.w3.org/ns/sosa/"):
    """W3C SOSA: sensors, actuators and what they observe or move."""

    ActuatableProperty: NamedNode


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
    dateTime: NamedNode


class VDI2206(metaclass=ClosedNamespace, iri="http://www.w3id.org/hsu-aut/VDI2206#"):
    """VDI 2206: what the plant is made of."""

    Actuator: NamedNode
    BasicSystem: NamedNode
    Component: NamedNode
    MathematicalModel: NamedNode
    Module: NamedNode
    Sensor: NamedNode
    System: NamedNode
    ModuleConsistsOfComponent: NamedNode
    SystemConsistsOfModule: NamedNode
    SystemConsistsOfSystem: NamedNode
    hasInput: NamedNode
    hasInterface: NamedNode
    hasOutput: NamedNode
    isPartOf: NamedNode


class VDI3682(metaclass=ClosedNamespace, iri="http://www.w3id.org/hsu-aut/VDI3682#"):
    """VDI/VDE 3682: what the plant does to products, energy and information."""

    Energy: NamedNode
    Process: NamedNode
    ProcessOperator: NamedNode
    Product: NamedNode
    consistsOf: NamedNode
    hasInput: NamedNode
    hasOutput: NamedNode
    hasPredecessor: NamedNode
    hasSuccessor: NamedNode
    isAssignedTo: NamedNode
    shortName: NamedNode


class UML(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/UMLStateMachine#"):
    """UML state machines: how the plant behaves over time."""

    Action: NamedNode
    State: NamedNode
    StateMachine: NamedNode
    Transition: NamedNode
    containsState: NamedNode
    containsTransition: NamedNode
    doAction: NamedNode
    sourceState: NamedNode
    targetState: NamedNode
    transitionEvent: NamedNode
    stateName: NamedNode
    transitionGuard: NamedNode


class DIN17359(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/DIN17359#"):
    """DIN ISO 17359: from parameters over symptoms to faults."""

    Fault: NamedNode
    Symptom: NamedNode
    ParameterIsDescribedByFeature: NamedNode
    SymptomIndicatesFault: NamedNode
    SymptomIsExtractedFromFeature: NamedNode


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
    consistsOfBehaviorModel: NamedNode
    consistsOfDiagnosticModel: NamedNode
    consistsOfFunctionModel: NamedNode
    consistsOfStructureModel: NamedNode
    isChangedByActuator: NamedNode
    processRealizesBehavior: NamedNode


class HS(metaclass=ClosedNamespace, iri="urn:homeostat:ontology#"):
    """Our extension: signals, limits, command values, fault effects, symptoms, recovery, model parameters."""

    # signals
    Tag: NamedNode
    name: NamedNode
    unit: NamedNode
    rateLimit: NamedNode
    belongsTo: NamedNode
    measures: NamedNode
    drives: NamedNode
    # structure and loops
    isConnectedTo: NamedNode
    # limits
    Limit: NamedNode
    Envelope: NamedNode
    formula: NamedNode
    source: NamedNode
    hard: NamedNode
    constrains: NamedNode
    protects: NamedNode
    # behaviour
    risk: NamedNode
    settledWhen: NamedNode
    isInitialState: NamedNode
    requiresComponent: NamedNode
    requirementReason: NamedNode
    requiresActuator: NamedNode
    # faults, symptoms, recovery
    affects: NamedNode
    hasFault: NamedNode
    disables: NamedNode
    priorProbability: NamedNode
    featureExpression: NamedNode
    accumulationExpression: NamedNode
    usesTag: NamedNode
    sigma: NamedNode
    Waiver: NamedNode
    ofStrategy: NamedNode
    waives: NamedNode
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
    ("sosa", SOSA.iri),
    ("CPSMod", CPSMod.iri),
    ("hs", HS.iri),
    ("rdf", RDF.iri),
    ("rdfs", RDFS.iri),
    ("xsd", XSD.iri),
)
"""Prefix and namespace IRI, as written in our Turtle and SPARQL files."""
