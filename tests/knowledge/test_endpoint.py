"""What a client does when the other side is slow, wrong, or no store at all. Every other side here is a real server."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import pytest
from pyoxigraph import NamedNode, RdfFormat

from homeostat.knowledge.store.endpoint import SparqlEndpoint, Transport
from homeostat.knowledge.store.store import QueryRejected, StoreError, StoreUnavailable
from tests.contracts.graph_store import one_line
from tests.knowledge.servers import Quiet, free_port, http_server

JSON = "application/sparql-results+json"
YES = b'{"head":{},"boolean":true}'
Handle = Callable[[Quiet], None]


def send(status: int, media_type: str, body: bytes, **headers: str) -> Handle:
    """A server that reads each request and gives this reply."""

    def handle(request: Quiet) -> None:
        request.sent()
        request.answer(status, media_type, body, **headers)

    return handle


def at(urls: Sequence[str], authorization: str | None = None) -> SparqlEndpoint:
    """A client of these four addresses."""
    query, update, graph, dataset = urls
    return SparqlEndpoint(query, update, graph, dataset, authorization=authorization)


@contextmanager
def endpoint(handle: Handle, timeout_s: float = 5.0, max_bytes: int = 1_000_000) -> Iterator[SparqlEndpoint]:
    """A client of a server that answers every request with ``handle``."""

    class Handler(Quiet):
        def do_POST(self) -> None:
            handle(self)

        do_GET = do_POST

    with http_server(Handler) as address:
        url = f"{address}/query"
        yield SparqlEndpoint(url, url, url, url, Transport(timeout_s, max_bytes))


def failure(handle: Handle, timeout_s: float = 5.0, max_bytes: int = 1_000_000) -> StoreError:
    """The error that an ASK query ends with; its message is one line and names the address."""
    with endpoint(handle, timeout_s, max_bytes) as store, pytest.raises(StoreError) as error:
        store.ask("ASK {}")
    assert store.query_url in one_line(error)
    return error.value


def test_a_store_that_never_answers_is_given_up_in_time() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:  # accepts by its backlog, and never ends it by itself
        url = f"http://127.0.0.1:{silent.getsockname()[1]}/query"
        store = SparqlEndpoint(url, url, url, url, Transport(timeout_s=0.3))
        requests: tuple[Callable[[], object], ...] = (
            lambda: store.ask("ASK {}"),
            lambda: store.update("DROP ALL"),
            lambda: store.dump(RdfFormat.N_QUADS),
        )
        for request in requests:
            with pytest.raises(StoreUnavailable) as error:
                request()
            assert "did not answer within 0.3 s" in one_line(error) and "timeout_s" in str(error.value)


@pytest.mark.parametrize("part", ["headers", "body"])
def test_a_store_that_drips_is_given_up_in_time(part: str) -> None:
    stop = threading.Event()  # set once the store was given up: the server does not end it before

    def drip(request: Quiet) -> None:
        request.sent()
        if part == "headers":
            request.wfile.write(b"HTTP/1.1 200 OK\r\nX-Drip: ")
        else:
            request.wfile.write(f"HTTP/1.1 200 OK\r\nContent-Type: {JSON}\r\n\r\n".encode())
        while not stop.wait(0.05):
            try:
                request.wfile.write(b" ")
            except OSError:
                return

    try:
        error = failure(drip, timeout_s=0.5)
    finally:
        stop.set()
    assert isinstance(error, StoreUnavailable) and "did not answer within 0.5 s" in str(error)


def test_nobody_at_the_address() -> None:
    store = SparqlEndpoint.oxigraph(f"http://127.0.0.1:{free_port()}")
    with pytest.raises(StoreUnavailable) as error:
        store.ask("ASK {}")
    assert store.query_url in one_line(error) and "check that the server runs" in str(error.value)


@pytest.mark.parametrize(
    ("status", "kind", "remedy"),
    [
        (400, QueryRejected, "correct the query"),
        (413, QueryRejected, "correct the query"),
        (401, StoreUnavailable, "set authorization"),
        (403, StoreUnavailable, "set authorization"),
        (404, StoreUnavailable, "check the address"),
        (500, StoreUnavailable, "see the server's log"),
        (503, StoreUnavailable, "see the server's log"),
        (304, StoreUnavailable, "see the server's log"),
    ],
)
def test_a_status_tells_who_is_to_blame(status: int, kind: type[StoreError], remedy: str) -> None:
    error = failure(send(status, "text/plain", b"" if status == 304 else b"line one\nline two " + b"x" * 5000))
    assert type(error) is kind
    assert f"status {status}" in str(error) and str(error).endswith(remedy)
    assert status == 304 or "line one line two" in str(error)


@pytest.mark.parametrize(
    ("media_type", "body"),
    [
        ("text/html", b"<html>welcome</html>"),
        ("", b""),
        (JSON, b"{"),
        (JSON, b"[]"),
        (JSON, b"\xff\xfe"),
        (JSON, b'{"head":{"vars":["a"]},"results":{"bindings":[{"a":{"type":"uri","value":"not an iri"}}]}}'),
    ],
)
def test_what_is_no_answer_is_no_store(media_type: str, body: bytes) -> None:
    error = failure(send(200, media_type, body))
    assert type(error) is StoreUnavailable and "check that the address is a SPARQL query service" in str(error)


def test_an_answer_that_breaks_off_is_no_answer() -> None:
    def break_off(request: Quiet) -> None:
        request.sent()
        request.wfile.write(f"HTTP/1.1 200 OK\r\nContent-Type: {JSON}\r\nContent-Length: 9999\r\n\r\n".encode() + YES)

    assert type(failure(break_off)) is StoreUnavailable


def test_an_answer_without_end_is_cut() -> None:
    def flood(request: Quiet) -> None:
        request.sent()
        request.wfile.write(f"HTTP/1.1 200 OK\r\nContent-Type: {JSON}\r\n\r\n".encode())
        try:
            while True:
                request.wfile.write(b" " * 65536)
        except OSError:
            return

    error = failure(flood, max_bytes=100_000)
    assert type(error) is StoreUnavailable and "more than 100000 bytes" in str(error)


def test_an_answer_of_the_greatest_length_is_read() -> None:
    with endpoint(send(200, JSON, YES), max_bytes=len(YES)) as store:
        assert store.ask("ASK {}") is True


def test_a_graph_that_is_sent_twice_over_is_one_graph() -> None:
    lines = b"<urn:b> <urn:p> <urn:x> .\n<urn:a> <urn:p> <urn:x> .\n"
    with endpoint(send(200, "application/n-triples", lines * 2)) as store:
        subjects = [str(triple.subject) for triple in store.construct("CONSTRUCT WHERE { ?s ?p ?o }")]
    assert subjects == ["<urn:a>", "<urn:b>"]


def test_a_redirect_to_another_host_is_refused_and_not_visited() -> None:
    visited = threading.Event()

    def trap(request: Quiet) -> None:
        visited.set()
        request.answer(200, JSON, YES)

    with endpoint(trap) as other:
        for status in (301, 302, 303, 307, 308):
            error = failure(send(status, "text/plain", b"", Location=other.query_url))
            assert type(error) is StoreUnavailable and other.query_url in str(error)
    assert not visited.is_set()


@pytest.mark.parametrize("status", [307, 308])
def test_a_redirect_on_the_same_host_is_followed_with_the_same_request(status: int) -> None:
    def move(request: Quiet) -> None:
        body = request.sent()
        if request.path == "/query":
            request.answer(status, "text/plain", b"", Location="/moved")
        else:
            said = request.path == "/moved" and request.command == "POST" and body == b"query=ASK+%7B%7D"
            request.answer(200, JSON, b'{"head":{},"boolean":%s}' % str(said).lower().encode())

    with endpoint(move) as store:
        assert store.ask("ASK {}") is True


def test_a_redirect_that_would_lose_the_question_is_not_followed() -> None:
    error = failure(send(303, "text/plain", b"", Location="/other"))
    assert type(error) is StoreUnavailable and "configure that address" in str(error)


def test_redirects_in_a_circle_end() -> None:
    error = failure(send(307, "text/plain", b"", Location="/query"))
    assert "redirects more than 3 times" in str(error)


def test_what_is_sent_is_what_the_protocol_asks_for() -> None:
    seen: list[tuple[str, str, str | None, str | None, bytes]] = []

    def record(request: Quiet) -> None:
        headers = (request.headers.get("Accept"), request.headers.get("Content-Type"))
        seen.append((request.command, request.path, *headers, request.sent()))
        request.answer(200, f"{headers[0]}; charset=iso-8859-1", YES)

    form = "application/x-www-form-urlencoded; charset=utf-8"
    with endpoint(record) as store:
        assert store.seeing(NamedNode("urn:g:ü")).ask('ASK { ?s ?p "→" }') is True
        store.update("DROP ALL")
        store.load(b"<urn:a> <urn:b> 1 .", RdfFormat.TURTLE, NamedNode("urn:g?&#ü"))
        store.load(b"<urn:a> <urn:b> 1 .", RdfFormat.TURTLE)
        assert store.dump(RdfFormat.TRIG) == YES
    ask = b"query=ASK+%7B+%3Fs+%3Fp+%22%E2%86%92%22+%7D&default-graph-uri=urn%3Ag%3A%C3%BC"
    assert seen == [
        ("POST", "/query", JSON, form, ask),
        ("POST", "/query", None, form, b"update=DROP+ALL"),
        ("POST", "/query?graph=urn%3Ag%3F%26%23%C3%BC", None, "text/turtle", b"<urn:a> <urn:b> 1 ."),
        ("POST", "/query?default", None, "text/turtle", b"<urn:a> <urn:b> 1 ."),
        ("GET", "/query", "application/trig", None, b""),
    ]


def test_authorization_is_sent_but_not_shown() -> None:
    def guard(request: Quiet) -> None:
        request.sent()
        known = request.headers.get("Authorization") == "Basic c2VjcmV0"
        request.answer(200 if known else 401, JSON, YES if known else b"who are you?")

    with endpoint(guard) as store:
        with pytest.raises(StoreUnavailable, match="who are you"):
            store.ask("ASK {}")
        allowed = at([store.query_url] * 4, authorization="Basic c2VjcmV0")
        assert allowed.ask("ASK {}") is True
    assert "c2VjcmV0" not in repr(allowed)


@pytest.mark.parametrize(
    "url",
    [
        "",
        "localhost:7878",
        "ftp://host/x",
        "file:///etc/passwd",
        "http:///x",
        "http://me:secret@host",
        "http://h/q?x=1",
    ],
)
def test_an_address_is_a_plain_http_address(url: str) -> None:
    good = "http://localhost:7878/query"
    for position in range(4):
        with pytest.raises(ValueError, match="must be http"):
            at([url if i == position else good for i in range(4)])


def test_the_two_products_differ_in_paths_only() -> None:
    oxigraph = SparqlEndpoint.oxigraph("http://host:7878/", timeout_s=3.0)
    assert (oxigraph.query_url, oxigraph.update_url) == ("http://host:7878/query", "http://host:7878/update")
    assert oxigraph.graph_url == oxigraph.dataset_url == "http://host:7878/store"
    assert oxigraph.transport.timeout_s == 3.0
    graphdb = SparqlEndpoint.graphdb("https://host/x", "a/b ü")
    root = "https://host/x/repositories/a%2Fb%20%C3%BC"
    assert graphdb.query_url == root and graphdb.update_url == graphdb.dataset_url == f"{root}/statements"
    assert graphdb.graph_url == f"{root}/rdf-graphs/service"


@pytest.mark.parametrize(
    "address",
    [
        "http://me:s3cret@127.0.0.1:1/query",
        "http://:s3cret@127.0.0.1:1/query",
        "http://127.0.0.1:99999999/query",
        "http://127.0.0.1:x/query",
        "http://[bad/query",
        "http://h\x01st/query",
        "http://127.0.0.1/\udc80",
        "http://127.0.0.1/query#part",
    ],
)
def test_an_address_that_is_none_is_refused_without_its_secret(address: str) -> None:
    with pytest.raises(ValueError, match=r"must be http\(s\)://host\[:port\]/path and nothing more") as refused:
        at([address] * 4)
    assert "s3cret" not in str(refused.value)


@pytest.mark.parametrize("authorization", ["Bearer s3cret\n", "Bearer s3cr\u00e9t", "Bearer s3cret\r\nHost: other"])
def test_an_authorization_that_no_header_carries_is_refused_and_not_shown(authorization: str) -> None:
    with pytest.raises(ValueError, match="authorization has a line break") as refused:
        at(["http://127.0.0.1:1/query"] * 4, authorization)
    assert "s3cr" not in str(refused.value)


def test_half_a_character_is_refused_before_anything_is_sent() -> None:
    store = at([f"http://127.0.0.1:{free_port()}/query"] * 4)
    for ask in (lambda: store.select("SELECT * { ?s ?p '\udc80' }"), lambda: store.update("\udc80")):
        with pytest.raises(QueryRejected, match="is no text that can be sent"):
            ask()


def test_a_name_server_that_says_nothing_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    looked_up = threading.Event()

    def silent(*_: object, **__: object) -> None:
        looked_up.wait(10.0)
        raise socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")

    monkeypatch.setattr(socket, "getaddrinfo", silent)
    url = "http://store.plant.example/query"
    begin = time.monotonic()
    with pytest.raises(StoreUnavailable, match=r"did not answer within 0\.2 s"):
        SparqlEndpoint(url, url, url, url, Transport(timeout_s=0.2)).ask("ASK {}")
    assert time.monotonic() - begin < 5.0
    looked_up.set()


def test_where_a_redirect_leads_is_told_without_its_secret() -> None:
    error = failure(send(307, "text/plain", b"", Location="http://me:s3cret@other.example/query"))
    assert "other.example" in str(error) and "s3cret" not in str(error)
