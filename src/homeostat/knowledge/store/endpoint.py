"""A graph store behind a SPARQL 1.1 endpoint: query, update and graph store protocol over HTTP.

Every exchange is bounded in time and size and never leaves the host that it was meant for.
"""

import asyncio
import ssl
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Final, Self
from urllib.parse import quote, urlencode, urlsplit

import httpx2
from pyoxigraph import NamedNode, QueryResultsFormat, RdfFormat, Triple, parse

from homeostat.knowledge.store import answers
from homeostat.knowledge.store.store import QueryRejected, Solution, StoreUnavailable, check_target

_MOST_REDIRECTS: Final = 3
_GRACE_S: Final = 0.5
"""Time beyond the limit in which an exchange ends by itself, and says why, before it is left behind [s]."""


@dataclass(frozen=True, slots=True)
class Reply:
    """What came back."""

    status: int
    """HTTP status code."""
    media_type: str
    """Media type without parameters, in lower case."""
    body: bytes
    """The body as sent, at most as long as asked for."""


@dataclass(frozen=True, slots=True)
class Transport:
    """How requests are sent. Each opens its own connection, so one object serves many threads; proxies are not used."""

    timeout_s: float = 30.0
    """Longest time from the start of a request to the last byte of its reply, in seconds."""
    max_bytes: int = 256 * 1024 * 1024
    """Longest reply that is read, in bytes."""

    def send(self, method: str, url: str, headers: Mapping[str, str], body: bytes | None = None) -> Reply:
        """Send a request and read the reply, whatever its status; redirects on the same host are followed.

        Raises StoreUnavailable where no complete reply came in time, it was too long, or it pointed to another host.
        """
        # Only an event loop can end a wait by the clock: a blocking read has all its time again with every byte that
        # drips in. It gets a thread of its own, because whoever asks may be in a loop already; that is left behind
        # where it does not end, as nothing can end a name server's lookup.
        aside = ThreadPoolExecutor(1)
        try:
            # What is packed has no limit that could be seen beforehand, so nothing packed is asked for or unpacked.
            request = httpx2.Request(method, url, headers={**headers, "Accept-Encoding": "identity"}, content=body)
            return aside.submit(asyncio.run, self._follow(request)).result(self.timeout_s + _GRACE_S)
        except TimeoutError as error:
            raise StoreUnavailable(
                f"store at {plain(url)} did not answer within {self.timeout_s:g} s; "
                "check that the server runs, or raise timeout_s if it is only slow"
            ) from error
        except (httpx2.HTTPError, httpx2.InvalidURL, OSError) as error:
            raise StoreUnavailable(
                f"store at {plain(url)} cannot be reached: {error or type(error).__name__}; "
                "check that the server runs and that the address is right"
            ) from error
        finally:
            aside.shutdown(wait=False)

    async def _follow(self, request: httpx2.Request) -> Reply:
        verify = ssl.create_default_context() if request.url.scheme == "https" else False
        async with (
            asyncio.timeout(self.timeout_s),
            httpx2.AsyncClient(timeout=None, trust_env=False, verify=verify) as client,
        ):
            for _ in range(_MOST_REDIRECTS + 1):
                response = await client.send(request, stream=True)
                moved = response.next_request
                if moved is None:
                    return await self._read(response)
                await response.aclose()
                if _origin(moved.url) != _origin(request.url) or moved.method != request.method:
                    raise StoreUnavailable(
                        f"store at {plain(str(request.url))} redirects a {request.method} to {plain(str(moved.url))} "
                        f"(status {response.status_code}), which is not followed; "
                        "configure that address if it is the right one"
                    )
                request = moved
        where = plain(str(request.url))
        raise StoreUnavailable(f"store at {where} redirects more than {_MOST_REDIRECTS} times; check its address")

    async def _read(self, response: httpx2.Response) -> Reply:
        content = bytearray()
        async for chunk in response.aiter_raw():
            content += chunk
            if len(content) > self.max_bytes:
                where = plain(str(response.url))
                raise StoreUnavailable(
                    f"store at {where} sent more than {self.max_bytes} bytes; ask for less or raise max_bytes"
                )
        media_type = response.headers.get("Content-Type", "").split(";")[0].strip().lower()
        return Reply(response.status_code, media_type, bytes(content))


def plain(url: str) -> str:
    """An address fit for messages: without query, and without a user name and a password."""
    parts = urlsplit(url)
    return parts._replace(netloc=parts.netloc.rpartition("@")[2], query="", fragment="").geturl()


def _origin(url: httpx2.URL) -> tuple[str, str, int | None]:
    return url.scheme, url.host, url.port


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
        """Refuse an address that is more than scheme, host, port and path, and what no header can carry."""
        for url in (self.query_url, self.update_url, self.graph_url, self.dataset_url):
            if not _is_place(url):
                told = "an address with a user name or a password" if "@" in url else f"address {url!r}"  # no secrets
                raise ValueError(f"{told} must be http(s)://host[:port]/path and nothing more")
        sent = self.authorization
        if sent is not None and not (sent.isascii() and sent.isprintable()):
            raise ValueError("authorization has a line break, or a sign that no header can carry; leave it out")

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

    def select(self, query: str) -> tuple[Solution, ...]:
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
        except (SyntaxError, ValueError, MemoryError) as error:
            raise self._garbled(error) from error.with_traceback(None)

    def ask(self, query: str) -> bool:
        """The answer of an ASK query."""
        answer = self._results(query, "ASK")
        if not isinstance(answer, bool):
            raise _other_form("a SELECT query", "ASK", query)
        return answer

    def update(self, text: str) -> None:
        """Carry a SPARQL update out."""
        self._send("POST", self.update_url, "update", {"Content-Type": _FORM}, _form([("update", text)]))

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

    def _results(self, query: str, form: str) -> tuple[Solution, ...] | bool:
        reply = self._query(query, _RESULTS, form)
        try:
            return answers.results(reply.body)
        except (SyntaxError, ValueError, MemoryError) as error:
            # The traceback would hold the answer, which must be let go of in the thread that got it.
            raise self._garbled(error) from error.with_traceback(None)

    def _query(self, query: str, accept: str, form: str) -> Reply:
        fields = [("query", query), *(("default-graph-uri", graph.value) for graph in self.default_graphs)]
        headers = {"Content-Type": _FORM, "Accept": accept}
        reply = self._send("POST", self.query_url, "query", headers, _form(fields))
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


def _is_place(url: str) -> bool:
    """Whether ``url`` is scheme, host, port and path, as whoever connects understands them, and nothing more."""
    try:
        parts, port = urlsplit(url), httpx2.URL(url).port
    except (ValueError, httpx2.InvalidURL):
        return False
    known = parts.scheme in ("http", "https") and bool(parts.hostname) and (port is None or 0 < port < 65_536)
    return known and not ("@" in parts.netloc or parts.query or parts.fragment)


def _form(fields: Iterable[tuple[str, str]]) -> str:
    """``fields`` as a form; QueryRejected where one has half a character, which nothing can be sent as."""
    named = tuple(fields)
    try:
        return urlencode(named)
    except UnicodeEncodeError as error:
        what = named[0][0]
        raise QueryRejected(f"the {what} is no text that can be sent: {error}; correct the {what}") from None
