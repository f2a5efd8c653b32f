"""Units and kinds of quantities in QUDT, for whatever has a unit symbol that the vocabulary knows."""

from collections.abc import Iterator

from pyoxigraph import Literal, Store, Triple

from homeostat.knowledge.vocabulary.units import KnownUnit, known_units
from homeostat.knowledge.vocabulary.vocabulary import HS, QUDT, RDF, RDFS


def quantities(store: Store) -> Iterator[Triple]:
    """The unit of each tag and parameter in ``store``, its kind of quantity, and what units are that QUDT has not.

    Of a symbol that is not known nothing is said: `unknown_units` tells it.
    """
    known = known_units()
    for quad in store.quads_for_pattern(None, HS.unit, None):
        unit = known.get(quad.object.value) if isinstance(quad.object, Literal) else None
        if unit is not None:
            yield Triple(quad.subject, QUDT.hasUnit, unit.unit)
            if unit.kind is not None:
                yield Triple(quad.subject, QUDT.hasQuantityKind, unit.kind)
            if unit.own:
                yield from _described(unit)


def _described(unit: KnownUnit) -> Iterator[Triple]:
    yield Triple(unit.unit, RDF.type, QUDT.Unit)
    yield Triple(unit.unit, RDFS.label, Literal(unit.symbol))
    if unit.ucum:
        yield Triple(unit.unit, QUDT.ucumCode, Literal(unit.ucum))
