"""A graph store behind a SPARQL 1.1 endpoint: query, update and graph store protocol over HTTP."""

from dataclasses import dataclass, field, replace
from typing import Final, Self
from urllib.parse import quote, urlencode, urlsplit

from pyoxigraph import NamedNode, QueryResultsFormat, RdfFormat, Triple, parse

from homeostat.knowledge.store import answers
from homeostat.knowledge.store.store import QueryRejected, Row, StoreUnavailable, check_target
from homeostat.knowledge.store.transport import Reply, Transport, plain

_RESULTS: Final = QueryResultsFormat.JSON.media_type
_TRIPLES: Final = RdfFormat.N_TRIPLES.media_type
_FORM: Final = "application/x-www-form-urlencoded; charset=utf-8"
_GRAPHS: Final = (RdfFormat.N_TRIPLES, RdfFormat.N_QUADS, RdfFormat.TURTLE, RdfFormat.RDF_XML)
_ANSWERS: Final = frozenset(kind.media_type for kind in (QueryResultsFormat.JSON, QueryResultsFormat.XML, *_GRAPHS))
"""Media types of answers to some form of query."""
_REQUEST_IS_WRONG: Final = frozenset({400, 406, 411, 413, 414, 415, 422, 431})


@dataclass(frozen=True, slots=True)
class SparqlEndpoint:
    """A remote graph store. Bodies are always read as UTF-8, whatever charset the server forgets to state."""

    query_url: str
    """Address of the SPARQL query service."""
    update_url: str
    """Address of the SPARQL update service."""
    graph_url: str
    """Address of the graph store protocol; the graph is named in the query part."""
    dataset_url: str
    """Address where data that names its graphs itself is posted, and from which all of it can be fetched."""
    transport: Transport = field(default_factory=Transport)
    """Time and size limits."""
    default_graphs: tuple[NamedNode, ...] = ()
    """Graphs that a query sees where it names none; empty: the store's own default graph."""
    authorization: str | None = field(default=None, repr=False)
    """Value of the Authorization header; None sends none."""

    def __post_init__(self) -> None:
        """Refuse an address that is more than scheme, host, port and path."""
        for url in (self.query_url, self.update_url, self.graph_url, self.dataset_url):
            parts = urlsplit(url)
            if parts.scheme not in ("http", "https") or not parts.hostname or parts.username or parts.query:
                raise ValueError(f"address {url!r} must be http(s)://host[:port]/path and nothing more")

    @classmethod
    def oxigraph(cls, base_url: str, timeout_s: float = 30.0) -> Self:
        """An Oxigraph server, for example ``http://localhost:7878``."""
        base = base_url.rstrip("/")
        return cls(f"{base}/query", f"{base}/update", f"{base}/store", f"{base}/store", Transport(timeout_s))

    @classmethod
    def graphdb(cls, base_url: str, repository: str, timeout_s: float = 30.0) -> Self:
        """A repository of a GraphDB or RDF4J server, for example ``http://localhost:7200`` and ``plant``."""
        base = f"{base_url.rstrip('/')}/repositories/{quote(repository, safe='')}"
        statements = f"{base}/statements"
        return cls(base, statements, f"{base}/rdf-graphs/service", statements, Transport(timeout_s))

    def seeing(self, *graphs: NamedNode) -> Self:
        """This store, with ``graphs`` as what a query sees where it names none."""
        return replace(self, default_graphs=graphs)

    def select(self, query: str) -> tuple[Row, ...]:
        """The solutions of a SELECT query."""
        rows = self._results(query, "SELECT")
        if isinstance(rows, bool):
            raise _other_form("an ASK query", "SELECT", query)
        return rows

    def construct(self, query: str) -> tuple[Triple, ...]:
        """The graph of a CONSTRUCT or DESCRIBE query, sorted."""
        reply = self._query(query, _TRIPLES, "CONSTRUCT or DESCRIBE")
        try:
            return answers.graph(quad.triple for quad in parse(reply.body, format=RdfFormat.N_TRIPLES))
        except (SyntaxError, ValueError) as error:
            raise self._garbled(error) from error.with_traceback(None)

    def ask(self, query: str) -> bool:
        """The answer of an ASK query."""
        answer = self._results(query, "ASK")
        if not isinstance(answer, bool):
            raise _other_form("a SELECT query", "ASK", query)
        return answer

    def update(self, text: str) -> None:
        """Carry a SPARQL update out."""
        self._send("POST", self.update_url, "update", {"Content-Type": _FORM}, urlencode({"update": text}))

    def load(self, data: bytes, format: RdfFormat, graph: NamedNode | None = None) -> None:
        """Add what ``data`` says."""
        check_target(format, graph)
        self._send("POST", self._place(format, graph), f"{format.name} data", {"Content-Type": format.media_type}, data)

    def dump(self, format: RdfFormat, graph: NamedNode | None = None) -> bytes:
        """One graph as triples, or everything in a format that names graphs."""
        check_target(format, graph)
        if graph is not None:  # asked as a query, because a graph store answers 404 for a graph without triples
            query = f"CONSTRUCT {{ ?s ?p ?o }} WHERE {{ GRAPH {graph} {{ ?s ?p ?o }} }}"
            return self._query(query, format.media_type, "CONSTRUCT").body
        return self._send("GET", self._place(format, None), "dump", {"Accept": format.media_type}).body

    def _place(self, format: RdfFormat, graph: NamedNode | None) -> str:
        if graph is not None:
            return f"{self.graph_url}?graph={quote(graph.value, safe='')}"
        return self.dataset_url if format.supports_datasets else f"{self.graph_url}?default"

    def _results(self, query: str, form: str) -> tuple[Row, ...] | bool:
        reply = self._query(query, _RESULTS, form)
        try:
            return answers.results(reply.body)
        except (SyntaxError, ValueError) as error:
            # The traceback would hold the answer, which must be let go of in the thread that got it.
            raise self._garbled(error) from error.with_traceback(None)

    def _query(self, query: str, accept: str, form: str) -> Reply:
        fields = [("query", query), *(("default-graph-uri", graph.value) for graph in self.default_graphs)]
        headers = {"Content-Type": _FORM, "Accept": accept}
        reply = self._send("POST", self.query_url, "query", headers, urlencode(fields))
        if reply.media_type == accept:
            return reply
        if reply.media_type in _ANSWERS:
            raise _other_form(f"a query that is answered as {reply.media_type}", form, query)
        raise self._garbled(f"media type {reply.media_type!r} instead of {accept!r}")

    def _send(self, method: str, url: str, what: str, headers: dict[str, str], body: str | bytes = b"") -> Reply:
        if self.authorization is not None:
            headers = {**headers, "Authorization": self.authorization}
        data = body.encode("ascii") if isinstance(body, str) else body
        reply = self.transport.send(method, url, headers, data if method == "POST" else None)
        if 200 <= reply.status < 300:
            return reply
        said = answers.one_line(reply.body[:2000].decode("utf-8", "replace")) or "no reason given"
        if reply.status in _REQUEST_IS_WRONG:
            raise QueryRejected(
                f"store at {plain(url)} rejected the {what} (status {reply.status}): {said}; correct the {what}"
            )
        remedy = {401: "set authorization", 403: "set authorization", 404: "check the address"}.get(
            reply.status, "see the server's log"
        )
        raise StoreUnavailable(f"store at {plain(url)} failed (status {reply.status}): {said}; {remedy}")

    def _garbled(self, error: object) -> StoreUnavailable:
        return StoreUnavailable(
            f"store at {plain(self.query_url)} sent an answer that cannot be read: {answers.one_line(error)}; "
            "check that the address is a SPARQL query service"
        )


def _other_form(came: str, form: str, query: str) -> QueryRejected:
    return QueryRejected(f"{came} came where {form} is needed: {answers.one_line(query, 80)}")
