"""The terms of the T-Box that code may use, one closed namespace per vocabulary.

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
    "PREFIXES",
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
    Energy: NamedNode
    Information: NamedNode
    InformationInterface: NamedNode
    InformationProcessing: NamedNode
    Interface: NamedNode
    MathematicalModel: NamedNode
    MechanicalInterface: NamedNode
    Module: NamedNode
    Product: NamedNode
    Sensor: NamedNode
    System: NamedNode
    ComponentIsPartOfModule: NamedNode
    ComponentIsPartOfSystem: NamedNode
    ModuleConsistsOfComponent: NamedNode
    ModuleIsPartOfSystem: NamedNode
    SystemConsistsOfComponent: NamedNode
    SystemConsistsOfModule: NamedNode
    SystemConsistsOfSystem: NamedNode
    consistsOf: NamedNode
    hasInformationInterface: NamedNode
    hasInput: NamedNode
    hasInterface: NamedNode
    hasMechanicalInterface: NamedNode
    hasOutput: NamedNode
    isPartOf: NamedNode


class VDI3682(metaclass=ClosedNamespace, iri="http://www.w3id.org/hsu-aut/VDI3682#"):
    """VDI/VDE 3682: what the plant does to products, energy and information."""

    Energy: NamedNode
    Information: NamedNode
    Process: NamedNode
    ProcessOperator: NamedNode
    Product: NamedNode
    State: NamedNode
    SystemLimit: NamedNode
    TechnicalResource: NamedNode
    consistsOf: NamedNode
    dependency: NamedNode
    flow: NamedNode
    hasAlternativeInput: NamedNode
    hasAlternativeOutput: NamedNode
    hasInput: NamedNode
    hasOutput: NamedNode
    hasPredecessor: NamedNode
    hasSubProcess: NamedNode
    hasSuccessor: NamedNode
    isAssignedTo: NamedNode
    isComposedOf: NamedNode
    longName: NamedNode
    shortName: NamedNode


class UML(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/UMLStateMachine#"):
    """UML state machines: how the plant behaves over time."""

    Action: NamedNode
    Event: NamedNode
    State: NamedNode
    StateMachine: NamedNode
    Transition: NamedNode
    containsState: NamedNode
    containsTransition: NamedNode
    doAction: NamedNode
    effect: NamedNode
    entryAction: NamedNode
    exitAction: NamedNode
    sourceState: NamedNode
    targetState: NamedNode
    transitionEvent: NamedNode
    stateName: NamedNode
    transitionGuard: NamedNode


class DIN17359(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/DIN17359#"):
    """DIN ISO 17359: from parameters over symptoms to faults."""

    Anomaly: NamedNode
    Cause: NamedNode
    DataBasedDiagnosticModel: NamedNode
    DiagnosticModel: NamedNode
    DiagnosticSubject: NamedNode
    Diagnostics: NamedNode
    Fault: NamedNode
    Feature: NamedNode
    KnowledgeBasedDiagnosticModel: NamedNode
    MeasuredData: NamedNode
    Parameter: NamedNode
    ReferenceValue: NamedNode
    StatisticalDiagnosticModel: NamedNode
    Symptom: NamedNode
    CausesFault: NamedNode
    DiagnosticsModelIsAssignedTo: NamedNode
    FaultIsDescribedBySymptom: NamedNode
    FeatureConsistsOfFeature: NamedNode
    FeatureIsComparedTo: NamedNode
    ParameterIsDescribedByFeature: NamedNode
    SymptomDescribesAnomaly: NamedNode
    SymptomIndicatesFault: NamedNode
    SymptomIsExtractedFromFeature: NamedNode
    hasInputAnomaly: NamedNode
    hasInputSubject: NamedNode
    hasInputSymptom: NamedNode
    hasOutputFault: NamedNode
    isObservedBy: NamedNode
    actuatorID: NamedNode
    anomalyScore: NamedNode
    featureUnit: NamedNode
    modelVersion: NamedNode
    parameterUnit: NamedNode
    referenceUnit: NamedNode
    referenceValue: NamedNode
    sensorId: NamedNode


class DINEN61360(metaclass=ClosedNamespace, iri="http://www.hsu-ifa.de/ontologies/DINEN61360#"):
    """DIN EN 61360: data elements, their type and their values."""

    Data_Element: NamedNode
    Instance_Description: NamedNode
    Real: NamedNode
    Simple_Data_Type: NamedNode
    Type_Description: NamedNode
    Type_Description_has_Instance: NamedNode
    has_Data_Element: NamedNode
    has_Instance_Description: NamedNode
    has_Type_Description: NamedNode
    Code: NamedNode
    Created_at_Date: NamedNode
    Definition: NamedNode
    Expression_Goal: NamedNode
    Logic_Interpretation: NamedNode
    Preferred_Letter_Symbol: NamedNode
    Preferred_Name: NamedNode
    Short_Name: NamedNode
    Source_Document_of_Definition: NamedNode
    Unit_of_Measure: NamedNode
    Value: NamedNode
    Version_Number: NamedNode


class M(metaclass=ClosedNamespace, iri="http://openmath.org/vocab/math#"):
    """OpenMath in RDF: equations as expression trees."""

    Application: NamedNode
    Binding: NamedNode
    Literal: NamedNode
    Object: NamedNode
    ObjectList: NamedNode
    Reference: NamedNode
    Symbol: NamedNode
    Variable: NamedNode
    VariableList: NamedNode
    arguments: NamedNode
    binder: NamedNode
    body: NamedNode
    operator: NamedNode
    symbol: NamedNode
    target: NamedNode
    variables: NamedNode
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
    isCharacterizedByParameter: NamedNode
    isDataFor: NamedNode
    isObservedBySensor: NamedNode
    processRealizesBehavior: NamedNode
    technicalResourceRealizes: NamedNode


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
    biasSd: NamedNode
    samplePeriod: NamedNode
    initialValue: NamedNode
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
    redundantWith: NamedNode
    ControlLoop: NamedNode
    hasProcessVariable: NamedNode
    hasSetpoint: NamedNode
    hasManipulatedVariable: NamedNode
    proportionalGain: NamedNode
    integralGain: NamedNode
    hasGain: NamedNode
    hasReset: NamedNode
    derivativeGain: NamedNode
    directActing: NamedNode
    # limits
    Limit: NamedNode
    Interlock: NamedNode
    Permissive: NamedNode
    Envelope: NamedNode
    AcceptanceCriterion: NamedNode
    formula: NamedNode
    source: NamedNode
    clause: NamedNode
    severity: NamedNode
    hard: NamedNode
    owner: NamedNode
    finiteWindow: NamedNode
    window: NamedNode
    appliesInState: NamedNode
    constrains: NamedNode
    protects: NamedNode
    isRequiredFor: NamedNode
    trips: NamedNode
    # behaviour
    risk: NamedNode
    settledWhen: NamedNode
    isInitialState: NamedNode
    isSafeState: NamedNode
    isRecoveryTarget: NamedNode
    requiresComponent: NamedNode
    requirementReason: NamedNode
    nominalDuration: NamedNode
    maximumDuration: NamedNode
    priority: NamedNode
    isRecovery: NamedNode
    requiresActuator: NamedNode
    writes: NamedNode
    commandValue: NamedNode
    commandRate: NamedNode
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
    modelParameter: NamedNode
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
    offDelay: NamedNode
    deadband: NamedNode
    direction: NamedNode
    falseAlarmProbability: NamedNode
    Evidence: NamedNode
    ofSymptom: NamedNode
    forFault: NamedNode
    detectionProbability: NamedNode
    RecoveryMeasure: NamedNode
    recovers: NamedNode
    usesTransition: NamedNode
    usesActuator: NamedNode
    adjusts: NamedNode
    FallbackStrategy: NamedNode
    hasCommand: NamedNode
    leadsTo: NamedNode
    actsOutOfService: NamedNode
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
    fastestChange: NamedNode
    graceTime: NamedNode
    cusumThreshold: NamedNode
    carrierFormula: NamedNode
    largestLift: NamedNode
    liftTime: NamedNode
    tolerance: NamedNode
    confirmTime: NamedNode
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
    distribution: NamedNode
    hasParameter: NamedNode
    equationText: NamedNode
    denotes: NamedNode
    hasReferenceValue: NamedNode
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
