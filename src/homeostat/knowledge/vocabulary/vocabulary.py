"""The terms of the T-Box that code names, one closed namespace per vocabulary; queries and shapes use more of them.

A term is a pyoxigraph NamedNode: ``UML.State``, ``HS.rateLimit``. A name that is not listed does not exist.
"""

from __future__ import annotations

from pyoxigraph import NamedNode

from homeostat.knowledge.vocabulary.namespace import ClosedNamespace

from .w3c import RDF, RDFS, SOSA, XSD

__all__ = [
    "DIN17359",
    "DINEN61360",
    "HS",
    "OWN_UNITS",
    "PREFIXES",
    "QUDT",
    "RDF",
    "RDFS",
    "SOSA",
    "UML",
    "VDI2206",
    "VDI3682",
    "XSD",
    "CPSMod",
    "M",
]


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

    Data_Element: NamedNode
    Instance_Description: NamedNode
    Type_Description: NamedNode
    Code: NamedNode
    Value: NamedNode


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


class QUDT(metaclass=ClosedNamespace, iri="http://qudt.org/schema/qudt/"):
    """QUDT: units and kinds of quantities. The units themselves are rows of ``units.csv``."""

    QuantityKind: NamedNode
    Unit: NamedNode
    hasQuantityKind: NamedNode
    hasUnit: NamedNode
    ucumCode: NamedNode


OWN_UNITS = "urn:homeostat:unit#"
"""Namespace of the units that QUDT has not."""


class HS(metaclass=ClosedNamespace, iri="urn:homeostat:ontology#"):
    """Our extension: signals, limits, command values, fault effects, symptoms, recovery, model parameters."""

    # signals
    Tag: NamedNode
    name: NamedNode
    role: NamedNode
    unit: NamedNode
    rangeLow: NamedNode
    rangeHigh: NamedNode
    scale: NamedNode
    rateLimit: NamedNode
    increment: NamedNode
    noiseSd: NamedNode
    modelVariable: NamedNode
    belongsTo: NamedNode
    concerns: NamedNode
    measures: NamedNode
    drives: NamedNode
    reportsPosition: NamedNode
    isProvidedBy: NamedNode
    isReportedBy: NamedNode
    sets: NamedNode
    overrides: NamedNode
    isSetpointOf: NamedNode
    isCarriedBy: NamedNode
    # structure and loops
    isConnectedTo: NamedNode
    feeds: NamedNode
    ControlLoop: NamedNode
    hasProcessVariable: NamedNode
    hasSetpoint: NamedNode
    hasManipulatedVariable: NamedNode
    proportionalGain: NamedNode
    hasGain: NamedNode
    hasReset: NamedNode
    # limits
    Limit: NamedNode
    TripLimit: NamedNode
    Permissive: NamedNode
    Envelope: NamedNode
    AcceptanceCriterion: NamedNode
    formula: NamedNode
    source: NamedNode
    hard: NamedNode
    owner: NamedNode
    asksAfter: NamedNode
    window: NamedNode
    appliesInState: NamedNode
    constrains: NamedNode
    protects: NamedNode
    isRequiredFor: NamedNode
    Price: NamedNode
    priceKind: NamedNode
    amount: NamedNode
    # behaviour
    risk: NamedNode
    settledWhen: NamedNode
    isInitialState: NamedNode
    isSafeState: NamedNode
    isRecoveryTarget: NamedNode
    requiresComponent: NamedNode
    requirementReason: NamedNode
    priority: NamedNode
    isRecovery: NamedNode
    requiresActuator: NamedNode
    writes: NamedNode
    commandValue: NamedNode
    order: NamedNode
    SetpointRange: NamedNode
    allowsSetpoint: NamedNode
    ofTag: NamedNode
    low: NamedNode
    high: NamedNode
    default: NamedNode
    # faults, symptoms, recovery
    affects: NamedNode
    hasFault: NamedNode
    disables: NamedNode
    isBlockedBy: NamedNode
    faultMode: NamedNode
    generatedMode: NamedNode
    priorProbability: NamedNode
    severityUnit: NamedNode
    severityNominal: NamedNode
    severityLow: NamedNode
    severityHigh: NamedNode
    featureExpression: NamedNode
    accumulationExpression: NamedNode
    filterTime: NamedNode
    usesTag: NamedNode
    watches: NamedNode
    sigma: NamedNode
    onDelay: NamedNode
    threshold: NamedNode
    direction: NamedNode
    FallbackStrategy: NamedNode
    hasCommand: NamedNode
    leadsTo: NamedNode
    actsOutOfService: NamedNode
    commandRate: NamedNode
    Waiver: NamedNode
    ofStrategy: NamedNode
    waives: NamedNode
    FallbackEffect: NamedNode
    effectTime: NamedNode
    largestRest: NamedNode
    # the guard
    QualityRule: NamedNode
    TripRule: NamedNode
    WriteRule: NamedNode
    StartUpLimit: NamedNode
    ofLimit: NamedNode
    staleTime: NamedNode
    frozenTime: NamedNode
    samplingTime: NamedNode
    fastestChange: NamedNode
    graceTime: NamedNode
    cusumThreshold: NamedNode
    carrierFormula: NamedNode
    largestLift: NamedNode
    liftTime: NamedNode
    tripLead: NamedNode
    fastestFallExpression: NamedNode
    fallenCarrierFormula: NamedNode
    tolerance: NamedNode
    confirmTime: NamedNode
    permittedRate: NamedNode
    rampedBy: NamedNode
    hasAutomatic: NamedNode
    startUpFormula: NamedNode
    isStartUpState: NamedNode
    startUpTime: NamedNode
    # physics
    ModelParameter: NamedNode
    symbol: NamedNode
    value: NamedNode
    sd: NamedNode
    relativeUncertainty: NamedNode
    hasParameter: NamedNode
    equationText: NamedNode
    denotes: NamedNode
    hasReferenceValue: NamedNode
    # time
    tick: NamedNode
    response: NamedNode
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
    ("qudt", QUDT.iri),
    ("unit", "http://qudt.org/vocab/unit/"),
    ("quantitykind", "http://qudt.org/vocab/quantitykind/"),
    ("hsunit", OWN_UNITS),
    ("rdf", RDF.iri),
    ("rdfs", RDFS.iri),
    ("xsd", XSD.iri),
)
"""Prefix and namespace IRI, as written in our Turtle and SPARQL files."""
