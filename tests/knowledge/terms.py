"""Terms of the T-Box that tests and benchmarks name, beside those that code names."""

from __future__ import annotations

from pyoxigraph import NamedNode

from homeostat.knowledge.vocabulary.vocabulary import ClosedNamespace


class SOSA(metaclass=ClosedNamespace, iri="http://www.w3.org/ns/sosa/"):
    """W3C SOSA: sensors, actuators and what they observe or move."""

    ActuatableProperty: NamedNode


class XSD(metaclass=ClosedNamespace, iri="http://www.w3.org/2001/XMLSchema#"):
    """XML Schema datatypes: the ones used here."""

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
    stateName: NamedNode
    transitionGuard: NamedNode


class DIN17359(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/DIN17359#"):
    """DIN ISO 17359: from parameters over symptoms to faults."""

    Fault: NamedNode
    Symptom: NamedNode
    SymptomIndicatesFault: NamedNode
    SymptomIsExtractedFromFeature: NamedNode


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

    Tag: NamedNode
    name: NamedNode
    unit: NamedNode
    belongsTo: NamedNode
    measures: NamedNode
    drives: NamedNode
    isConnectedTo: NamedNode
    Limit: NamedNode
    Envelope: NamedNode
    formula: NamedNode
    source: NamedNode
    hard: NamedNode
    constrains: NamedNode
    protects: NamedNode
    risk: NamedNode
    requiresComponent: NamedNode
    requirementReason: NamedNode
    requiresActuator: NamedNode
    affects: NamedNode
    hasFault: NamedNode
    disables: NamedNode
    priorProbability: NamedNode
    sigma: NamedNode
    Waiver: NamedNode
    ofStrategy: NamedNode
    waives: NamedNode
    equationText: NamedNode
    denotes: NamedNode
    fileName: NamedNode
    sha256: NamedNode
    rateLimit: NamedNode
