"""What the project needs from a graph store, whether it runs in this process or behind a SPARQL endpoint.

The three questions have three return types, so that they cannot be confused: rows, triples, a truth value.
Misuse and failure are exceptions:

    StoreError
    ├── StoreUnavailable   nobody answered, or what answered is not a SPARQL store: try later, or correct the address
    ├── QueryRejected      the store understood that the request is wrong: correct the request
    └── UnexpectedAnswer   an answer has a gap or a term of another kind than its reader needs: correct the graph
"""

from dataclasses import dataclass
from typing import Final, Protocol, TypeAlias, TypeVar

from pyoxigraph import BlankNode, Literal, NamedNode, RdfFormat, Triple

from homeostat.knowledge.vocabulary.vocabulary import XSD

Term: TypeAlias = NamedNode | BlankNode | Literal
"""What a variable can be bound to."""

_T = TypeVar("_T")
_NUMBERS: Final = frozenset(
    NamedNode(XSD.iri + name) for name in ("integer", "decimal", "double", "float", "int", "long", "nonNegativeInteger")
)


class StoreError(Exception):
    """Something is wrong with a store, a request or an answer; the message is one line and names the remedy."""


class StoreUnavailable(StoreError):
    """No usable answer came: down, too slow, not allowed in, or no SPARQL store at this address."""


class QueryRejected(StoreError):
    """The store, or this client before sending, refused the request itself."""


class UnexpectedAnswer(StoreError):
    """An answer lacks a value or has a term of another kind than its reader needs."""


@dataclass(frozen=True, slots=True)
class Solution:
    """One solution of a SELECT query."""

    variables: tuple[str, ...]
    """Names of the selected variables, without the question mark."""
    terms: tuple[Term | None, ...]
    """Their terms, in the same order; None where unbound."""

    def term(self, name: str) -> Term | None:
        """The term of variable ``name``, None where unbound; UnexpectedAnswer where the query selects no such name."""
        if name not in self.variables:
            raise UnexpectedAnswer(f"no variable {name!r} in the answer; it has {', '.join(self.variables)}")
        return self.terms[self.variables.index(name)]

    def iri(self, name: str) -> NamedNode:
        """The IRI that ``name`` is bound to."""
        return _need(self.optional_iri(name), name, "an IRI")

    def text(self, name: str) -> str:
        """The text that ``name`` is bound to."""
        return _need(self.optional_text(name), name, "a text")

    def number(self, name: str) -> float:
        """The number that ``name`` is bound to."""
        return _need(self.optional_number(name), name, "a number")

    def flag(self, name: str) -> bool:
        """The truth value that ``name`` is bound to."""
        return _need(self.optional_flag(name), name, "a truth value")

    def optional_iri(self, name: str) -> NamedNode | None:
        """As ``iri``, but None where unbound."""
        term = self.term(name)
        if term is None or isinstance(term, NamedNode):
            return term
        raise _other_kind(name, term, "an IRI")

    def optional_text(self, name: str) -> str | None:
        """As ``text``, but None where unbound."""
        term = self.term(name)
        if term is None:
            return None
        if isinstance(term, Literal) and (term.language or term.datatype == XSD.string):
            return term.value
        raise _other_kind(name, term, "a text")

    def optional_number(self, name: str) -> float | None:
        """As ``number``, but None where unbound."""
        term = self.term(name)
        if term is None:
            return None
        if isinstance(term, Literal) and term.datatype in _NUMBERS:
            try:
                return float(term.value)
            except ValueError:
                pass  # an ill-typed literal such as ""^^xsd:double is no number
        raise _other_kind(name, term, "a number")

    def optional_flag(self, name: str) -> bool | None:
        """As ``flag``, but None where unbound."""
        term = self.term(name)
        if term is None:
            return None
        if isinstance(term, Literal) and term.datatype == XSD.boolean and term.value in ("true", "1", "false", "0"):
            return term.value in ("true", "1")
        raise _other_kind(name, term, "a truth value")


class GraphStore(Protocol):
    """A set of RDF graphs that answers SPARQL 1.1. Every method raises StoreUnavailable or QueryRejected."""

    def select(self, query: str) -> tuple[Solution, ...]:
        """The solutions of a SELECT query, in the order of the store."""

    def construct(self, query: str) -> tuple[Triple, ...]:
        """The graph of a CONSTRUCT or DESCRIBE query: each triple once, sorted by its N-Triples text."""

    def ask(self, query: str) -> bool:
        """The answer of an ASK query."""

    def update(self, text: str) -> None:
        """Carry a SPARQL update out, wholly or not at all."""

    def load(self, data: bytes, format: RdfFormat, graph: NamedNode | None = None) -> None:
        """Add what ``data`` says, wholly or not at all.

        A format of triples (Turtle, N-Triples, RDF/XML) goes into ``graph``, or into the default graph. A format that
        names graphs itself (JSON-LD, TriG, N-Quads) keeps those names and takes no ``graph``.
        """

    def dump(self, format: RdfFormat, graph: NamedNode | None = None) -> bytes:
        """The inverse of ``load``: one graph as triples, UTF-8, or everything in a format that names graphs."""


def check_target(format: RdfFormat, graph: NamedNode | None) -> None:
    """Refuse to send a format that names graphs itself into, or read it from, one named graph."""
    if graph is not None and format.supports_datasets:
        raise QueryRejected(
            f"{format.name} names its graphs itself and cannot be tied to graph {graph.value!r}; "
            "leave the graph out, or use Turtle or N-Triples"
        )


def _need(value: _T | None, name: str, kind: str) -> _T:
    if value is None:
        raise UnexpectedAnswer(f"variable {name!r} is unbound where {kind} is needed; complete the graph")
    return value


def _other_kind(name: str, term: Term, kind: str) -> UnexpectedAnswer:
    return UnexpectedAnswer(f"variable {name!r} is {term} where {kind} is needed; correct the graph")
