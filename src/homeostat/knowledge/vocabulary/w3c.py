"""Terms of W3C vocabularies that code may use, one closed namespace each."""

from __future__ import annotations

from pyoxigraph import NamedNode

from homeostat.knowledge.vocabulary.namespace import ClosedNamespace


class SOSA(metaclass=ClosedNamespace, iri="http://www.w3.org/ns/sosa/"):
    """W3C SOSA: sensors, actuators and what they observe or move."""

    ActuatableProperty: NamedNode
    Actuator: NamedNode
    ObservableProperty: NamedNode
    Sensor: NamedNode
    observes: NamedNode


class RDF(metaclass=ClosedNamespace, iri="http://www.w3.org/1999/02/22-rdf-syntax-ns#"):
    """RDF itself: the terms used here."""

    type: NamedNode
    first: NamedNode
    rest: NamedNode
    nil: NamedNode
    List: NamedNode
    langString: NamedNode


class RDFS(metaclass=ClosedNamespace, iri="http://www.w3.org/2000/01/rdf-schema#"):
    """RDF Schema: the terms used here."""

    label: NamedNode
    comment: NamedNode
    subClassOf: NamedNode
    subPropertyOf: NamedNode
    Class: NamedNode


class XSD(metaclass=ClosedNamespace, iri="http://www.w3.org/2001/XMLSchema#"):
    """XML Schema datatypes: the ones used here."""

    string: NamedNode
    boolean: NamedNode
    integer: NamedNode
    double: NamedNode
    decimal: NamedNode
    dateTime: NamedNode
