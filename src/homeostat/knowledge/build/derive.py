"""What the tables imply and a mapping cannot say: rules, links from formulas to tags, equations, units."""

from collections.abc import Callable, Iterable, Iterator
from importlib import resources
from itertools import groupby
from typing import Final, cast

from pyoxigraph import Literal, NamedNode, Quad, QueryTriples, Store, Triple

from homeostat.knowledge.build.constants import fill_in
from homeostat.knowledge.build.quantities import quantities
from homeostat.knowledge.build.statements import SCRATCH
from homeostat.knowledge.store import answers
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.knowledge.vocabulary.openmath import equation
from homeostat.knowledge.vocabulary.vocabulary import DIN17359, HS, RDF
from homeostat.stl.formula import Expression, Formula, FormulaError, parse, parse_expression

_RULES: Final = "rules"


def complete(stated: Iterable[Triple]) -> frozenset[Triple]:
    """What the tables ``stated`` and what follows from it; the scratch words are dropped.

    Numbers come out in their canonical form. Raises GraphError for a formula or an equation that cannot be read.
    """
    store = Store()
    _add(store, stated)
    for stage in _stages():
        # every rule is a CONSTRUCT
        _add(store, [t for rule in stage for t in answers.graph(cast(QueryTriples, store.query(rule)))])
    fill_in(store)
    _add(store, [*_formula_links(store), *_equations(store), *quantities(store)])
    return frozenset(quad.triple for quad in store if not quad.predicate.value.startswith(SCRATCH))


def _add(store: Store, triples: Iterable[Triple]) -> None:
    store.bulk_extend(Quad(triple.subject, triple.predicate, triple.object) for triple in triples)


def _stages() -> Iterator[tuple[str, ...]]:
    """The texts of the rules, by stage: a rule sees what earlier stages made."""
    files = resources.files(__package__).joinpath(_RULES).iterdir()
    rules = sorted((file.name, file.read_text("utf-8")) for file in files if file.name.endswith(".rq"))
    for _, stage in groupby(rules, key=lambda rule: rule[0].partition("-")[0]):
        yield tuple(text for _, text in stage)


def _formula_links(store: Store) -> Iterator[Triple]:
    """Which tags a limit constrains, and which a feature is computed from."""
    tags = _by_text(store, HS.name, HS.Tag)
    for subject, text in _texts(store, HS.formula):
        for name in sorted(_tags(parse, subject, text) & tags.keys()):
            yield Triple(subject, HS.constrains, tags[name])
    for predicate in (HS.featureExpression, HS.accumulationExpression):
        for subject, text in _texts(store, predicate):
            for name in sorted(_tags(parse_expression, subject, text) & tags.keys()):
                yield Triple(subject, HS.usesTag, tags[name])
                yield Triple(tags[name], DIN17359.ParameterIsDescribedByFeature, subject)


def _tags(read: Callable[[str], Formula | Expression], subject: NamedNode, text: str) -> frozenset[str]:
    try:
        return read(text).tags
    except FormulaError as error:
        raise GraphError(Code.BAD_FORMULA, _local(subject), str(error)) from error


def _equations(store: Store) -> Iterator[Triple]:
    denoted = {**_by_text(store, HS.symbol, HS.ModelParameter), **_by_text(store, HS.name, HS.Tag)}
    for subject, text in _texts(store, HS.equationText):
        try:
            yield from equation(subject, text, denoted)
        except ValueError as error:
            raise GraphError(Code.BAD_FORMULA, _local(subject), str(error)) from error


def _texts(store: Store, predicate: NamedNode) -> list[tuple[NamedNode, str]]:
    found = []
    for quad in store.quads_for_pattern(None, predicate, None):
        if isinstance(quad.subject, NamedNode) and isinstance(quad.object, Literal):
            found.append((quad.subject, quad.object.value))
    return sorted(found, key=lambda entry: (entry[0].value, entry[1]))


def _by_text(store: Store, predicate: NamedNode, kind: NamedNode) -> dict[str, NamedNode]:
    return {text: node for node, text in _texts(store, predicate) if Quad(node, RDF.type, kind) in store}


def _local(node: NamedNode) -> str:
    """The part of a plant's name after ``#``, for messages."""
    return node.value.rpartition("#")[2]
