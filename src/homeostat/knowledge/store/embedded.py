"""A graph store inside this process: Oxigraph, in memory or on disk."""

import copy
import os
from collections.abc import Callable
from pathlib import Path
from typing import Final, Self, TypeVar

from pyoxigraph import (
    BlankNode,
    DefaultGraph,
    NamedNode,
    QueryBoolean,
    QuerySolutions,
    QueryTriples,
    RdfFormat,
    Store,
    Triple,
)

from homeostat.knowledge.store import answers
from homeostat.knowledge.store.store import QueryRejected, Solution, StoreUnavailable, check_target

_T = TypeVar("_T")
_Answer = TypeVar("_Answer", QuerySolutions, QueryTriples, QueryBoolean)
_FORM: Final[dict[type, str]] = {QuerySolutions: "SELECT", QueryTriples: "CONSTRUCT or DESCRIBE", QueryBoolean: "ASK"}


class EmbeddedStore:
    """A graph store of this process.

    Reading and writing from several threads is safe; each query sees one state of the store. Queries have no time
    limit here: use ``endpoint.SparqlEndpoint`` for questions that do not come from the project's own templates.
    """

    def __init__(self, path: str | os.PathLike[str] | None = None) -> None:
        """Open the store in folder ``path``, creating it where absent; in memory where None.

        The folder stays taken as long as this object, or a view of it, exists. Raises StoreUnavailable where the folder
        cannot be opened or is taken.
        """
        self._default_graphs: list[NamedNode | BlankNode | DefaultGraph] | None = None
        self._place = "in memory" if path is None else repr(os.fspath(path))
        try:
            if path is not None:
                Path(path).mkdir(parents=True, exist_ok=True)
            self._store = Store() if path is None else Store(path)
        except OSError as error:
            message = f"store {self._place} cannot be opened: {answers.one_line(error)}"
            raise StoreUnavailable(f"{message}; close its other user or choose another folder") from error

    def seeing(self, *graphs: NamedNode) -> Self:
        """This store, with ``graphs`` as what a query sees where it names none."""
        view = copy.copy(self)
        view._default_graphs = [*graphs] or None
        return view

    def select(self, query: str) -> tuple[Solution, ...]:
        """The solutions of a SELECT query."""
        return self._answer(query, QuerySolutions, answers.rows)

    def construct(self, query: str) -> tuple[Triple, ...]:
        """The graph of a CONSTRUCT or DESCRIBE query, sorted."""
        return self._answer(query, QueryTriples, answers.graph)

    def ask(self, query: str) -> bool:
        """The answer of an ASK query."""
        return self._answer(query, QueryBoolean, bool)

    def update(self, text: str) -> None:
        """Carry a SPARQL update out, wholly or not at all."""
        self._guard("update", lambda: self._store.update(text))

    def load(self, data: bytes, format: RdfFormat, graph: NamedNode | None = None) -> None:
        """Add what ``data`` says, wholly or not at all."""
        check_target(format, graph)
        self._guard(f"{format.name} data", lambda: self._store.load(data, format=format, to_graph=graph))

    def dump(self, format: RdfFormat, graph: NamedNode | None = None) -> bytes:
        """One graph as triples, or everything in a format that names graphs."""
        check_target(format, graph)
        source = None if format.supports_datasets else graph or DefaultGraph()
        written = self._guard("dump", lambda: self._store.dump(format=format, from_graph=source))
        assert written is not None  # only a dump to a file returns nothing
        return written

    def _answer(self, query: str, form: type[_Answer], read: Callable[[_Answer], _T]) -> _T:
        def run() -> _T:
            answer = self._store.query(query, default_graph=self._default_graphs)
            try:
                if isinstance(answer, form):
                    return read(answer)
                came = _FORM[type(answer)]
            finally:
                del answer  # in this thread: see homeostat.knowledge.store.answers
            raise QueryRejected(f"a {came} query came where {_FORM[form]} is needed: {answers.one_line(query, 80)}")

        return self._guard("query", run)

    def _guard(self, what: str, action: Callable[[], _T]) -> _T:
        # Without their tracebacks, which would hold frames of a query: see homeostat.knowledge.store.answers.
        try:
            return action()
        except (SyntaxError, ValueError, MemoryError) as error:  # the last one: a value is longer than is read
            told = _reason(answers.one_line(error))
            message = f"store {self._place} rejected the {what}: {told}; correct the {what}"
            raise QueryRejected(message) from error.with_traceback(None)
        except (OSError, RuntimeError) as error:
            message = f"store {self._place} failed: {answers.one_line(error)}; check its folder and the disk"
            raise StoreUnavailable(message) from error.with_traceback(None)


def _reason(error: str) -> str:
    """What the parser says; of a prefix that is not declared it says everything else that might stand there."""
    place, expected, _ = error.partition(": expected one of Prefix not found")
    return f"{place}: a prefix is not declared there, which PREFIX NAME: <IRI> does" if expected else error
