"""Documents: the plant's graph in plain words, one short paragraph per thing, and which of them match a question.

They hold the same facts as the Turtle of :mod:`~homeostat.knowledge.context.context`, so that a study can tell what
the graph's structure is worth. Left out is what no agent is ever shown: the syntax trees of equations, whose text
stays, the second description of model parameters by DIN EN 61360, what the guard alone needs, and the hashes of the
source tables.
"""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse

from homeostat.domain.quotation import quote, quoted
from homeostat.knowledge.context.context import PLAIN, TEXT_LIMIT
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.former import TERMS, in_terms
from homeostat.knowledge.vocabulary.vocabulary import DINEN61360, HS, QUDT, RDF, RDFS, M

_GUARD: Final = {HS.QualityRule, HS.TripRule, HS.WriteRule, HS.StartUpLimit, HS.Waiver, HS.FallbackEffect}
_UNTOLD: Final = _GUARD | {HS.SourceTable, DINEN61360.Type_Description, DINEN61360.Instance_Description}
"""Types of things without a document."""
_UNSAID: Final = frozenset({RDF.type, RDFS.label, HS.belongsTo, QUDT.hasUnit, QUDT.hasQuantityKind})
"""Said by the first words of a document, or, as units are, by another property; or the same of everything."""
_TOLD: Final = {term: former for former, term in TERMS.items()}
"""What documents call by its former name: recorded answers of models are found by the words that these were shown."""
_WORD: Final = re.compile(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])|[^\sA-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True)
class Document:
    """What the graph says about one thing."""

    name: str
    """Kind and name of the thing, as in ``state_normal``."""
    label: str
    """What people call it, as it is recorded; empty where it has no label."""
    text: str
    """One line; whatever was recorded as text is quoted."""


def documents(store: GraphStore, namespace: str) -> tuple[Document, ...]:
    """One document per thing of the plant in ``namespace``, sorted by name."""
    about: dict[str, list[Triple]] = {}
    for quad in parse(store.dump(RdfFormat.N_TRIPLES), RdfFormat.N_TRIPLES):
        if isinstance(quad.subject, NamedNode) and quad.subject.value.startswith(namespace):
            about.setdefault(quad.subject.value.removeprefix(namespace), []).append(in_terms(quad.triple, _TOLD))
    told = {name: triples for name, triples in about.items() if _is_told(triples)}
    return tuple(_document(name, told[name], namespace, told) for name in sorted(told))


def _is_told(triples: Sequence[Triple]) -> bool:
    types = {t.object for t in triples if t.predicate == RDF.type}
    return not types & _UNTOLD and not (types and all(_is_syntax(kind) for kind in types))


def _is_syntax(kind: object) -> bool:
    """Whether things of ``kind`` are parts of an equation's tree."""
    return isinstance(kind, NamedNode) and kind.value.startswith(M.iri)


def _document(name: str, triples: Sequence[Triple], namespace: str, told: Collection[str]) -> Document:
    """``told``: names of the things that have a document; relations to others are not told."""
    ordered = sorted(triples, key=lambda t: (t.predicate != RDFS.comment, t.predicate.value, str(t.object)))
    labels = [t.object.value for t in ordered if t.predicate == RDFS.label and isinstance(t.object, Literal)]
    kinds = [_words(t.object) for t in ordered if t.predicate == RDF.type and not _is_syntax(t.object)]
    named = {*labels, _called(name)}
    by_phrase: dict[str, list[str]] = {}
    for triple in ordered:
        if triple.predicate not in _UNSAID and (shown := _object(triple.object, named, namespace, told)):
            by_phrase.setdefault("" if triple.predicate == RDFS.comment else _words(triple.predicate), []).append(shown)
    by_objects: dict[str, list[str]] = {}  # the T-Box names many relations twice, by a special and a general property
    for phrase, objects in by_phrase.items():
        by_objects.setdefault(_listed(objects), []).append(phrase)
    heading = " ".join((_listed(kinds), _called(name), *(quote(label, TEXT_LIMIT) for label in labels)))
    said = [f"{_listed([p for p in phrases if p])} {objects}" for objects, phrases in by_objects.items()]
    return Document(
        name, (*labels, "")[0], " ".join(f"{s[0].upper()}{s[1:]}." for s in map(str.strip, (heading, *said)))
    )


def _object(term: object, named: Collection[str], namespace: str, told: Collection[str]) -> str:
    """What is related, in words; empty for what has no document, and for a text that is ``named`` in the heading."""
    if isinstance(term, Literal):
        form = PLAIN.get(term.datatype)
        if form is not None and form.fullmatch(term.value):
            return term.value
        return "" if term.value in named else quote(term.value, TEXT_LIMIT)
    assert isinstance(term, NamedNode)
    name = term.value.removeprefix(namespace)
    return _called(name) if name in told else ""


def _called(name: str) -> str:
    """How a thing is called without its kind: ``normal`` for ``state_normal``."""
    return quoted(name.partition("_")[2] or name, TEXT_LIMIT)


def _words(term: object) -> str:
    """The local name of a type or a property, word by word: ``range high`` for ``hs:rangeHigh``."""
    assert isinstance(term, NamedNode)
    local = quoted(re.split("[#/]", term.value)[-1], TEXT_LIMIT)
    return " ".join(word.lower() for word in _WORD.findall(local))


def _listed(words: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)


EXTRA: Final = "retrieving documents needs 'bm25s': pip install 'homeostat[campaign]'"
"""Said where the library is not installed."""
_SEARCHED: Final = re.compile(r"\w+(?:[.-]\w+)*")
_JOINTS: Final = re.compile(r"[_.-]")
_COMMON: Final = frozenset(
    _SEARCHED.findall(
        "a an and are as at be by every for from has if in into is it its no not of on or that the their them then "
        "these they this to was with"
    )
)
"""English words that are in too many documents to tell them apart."""


class LexicalIndex:
    """Documents by their words, ranked by BM25 with the usual k1 = 1.5 and b = 0.75."""

    def __init__(self, documents: Sequence[Document]) -> None:
        """Index ``documents``. ImportError, in one line, where the library is not installed."""
        try:
            import bm25s
        except ImportError as error:
            raise ImportError(EXTRA, name="bm25s") from error
        self._documents = tuple(documents)
        self._scores = bm25s.BM25()
        self._scores.index([words(document.text) for document in documents], show_progress=False)

    def matching(self, question: str) -> tuple[Document, ...]:
        """The documents with at least one word of ``question``, best first; of equals the first by name."""
        scores = self._scores.get_scores(words(question))
        found = [(-float(score), k) for k, score in enumerate(scores) if score > 0.0]
        return tuple(self._documents[k] for _, k in sorted(found, key=lambda f: (f[0], self._documents[f[1]].name)))


def words(text: str) -> list[str]:
    """The words of ``text`` that are looked for: names as a whole and by their parts, in lower case.

    >>> words("Is V2.cmd of cool_stuck_closed at 0.5?")
    ['v2.cmd', 'v2', 'cmd', 'cool_stuck_closed', 'cool', 'stuck', 'closed', '0.5']
    """
    found = []
    for word in _SEARCHED.findall(text.lower()):
        parts = [part for part in _JOINTS.split(word) if part] if word[0].isalpha() else []
        found += [word, *parts] if len(parts) > 1 else [word]
    return [word for word in found if word not in _COMMON]
