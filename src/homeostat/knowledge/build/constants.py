"""Parameters in formulas: a table names one, the graph says its value, and the number is written in one table only."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from pyoxigraph import Literal, NamedNode, Quad, Store

from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.vocabulary.vocabulary import HS, RDF, UML
from homeostat.stl.constants import filled
from homeostat.stl.formula import FormulaError, parse, parse_expression
from homeostat.stl.text import render

_CONDITIONS: Final = (
    HS.formula,
    HS.startUpFormula,
    HS.carrierFormula,
    HS.fallenCarrierFormula,
    HS.settledWhen,
    UML.transitionGuard,
)
_EXPRESSIONS: Final = (HS.featureExpression, HS.accumulationExpression, HS.fastestFallExpression)


@dataclass(frozen=True, slots=True)
class _Unit:
    """What the rule language asks of a name."""

    unit: str
    scale: float = 1.0


def fill_in(store: Store) -> None:
    """Put the best estimate of every parameter in place of its name, in every formula of ``store``.

    Equations keep the names. A tag comes before a parameter of its name. Raises GraphError where a parameter is
    compared with, or added to, something of another unit, or has no value.
    """
    tags = dict(_named(store, HS.Tag, HS.name))
    parameters = {name: node for name, node in _named(store, HS.ModelParameter, HS.symbol) if name not in tags}
    stated = {name: _one(store, node, HS.value) for name, node in parameters.items()}
    values = {name: float(value) if value else math.nan for name, value in stated.items()}
    units = {name: _Unit(_one(store, node, HS.unit)) for name, node in (tags | parameters).items()}
    for predicate in (*_CONDITIONS, *_EXPRESSIONS):
        for quad in list(store.quads_for_pattern(None, predicate, None)):
            assert isinstance(quad.object, Literal)  # a mapping writes texts
            text = _filled_text(quad, quad.object.value, values, units)
            if text is not None:
                store.remove(quad)
                store.add(Quad(quad.subject, predicate, Literal(text)))


def _filled_text(quad: Quad, text: str, values: Mapping[str, float], units: Mapping[str, _Unit]) -> str | None:
    """The text with numbers; None where it names no parameter, or cannot be read: that is said where it is used."""
    read = parse if quad.predicate in _CONDITIONS else parse_expression
    try:
        names = read(text).tags
    except FormulaError:
        return None
    if not names & values.keys():
        return None
    for name in sorted(names & values.keys()):
        if math.isnan(values[name]):
            raise GraphError(
                Code.MISSING_VALUE, f"parameter {name!r}", "has no value, and a formula names it; fill the cell"
            )
    try:
        # A name that is neither is an unknown tag, which is said where the formula is used.
        return render(filled(read(text, units if names <= units.keys() else None).root, values))
    except FormulaError as error:
        raise GraphError(Code.BAD_FORMULA, str(quad.subject).rpartition("#")[2].strip("<>"), str(error)) from error


def _named(store: Store, kind: NamedNode, name: NamedNode) -> Iterator[tuple[str, NamedNode]]:
    for quad in store.quads_for_pattern(None, RDF.type, kind):
        if isinstance(quad.subject, NamedNode):
            yield _one(store, quad.subject, name), quad.subject


def _one(store: Store, node: NamedNode, predicate: NamedNode) -> str:
    """The first value; empty where there is none, which the shapes refuse."""
    found = (quad.object for quad in store.quads_for_pattern(node, predicate, None))
    return next((term.value for term in found if isinstance(term, Literal)), "")
