"""What every graph store must do, wherever it runs. A test class inherits this and says how to open its store."""

from __future__ import annotations

import gc
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from types import FrameType
from typing import TypeAlias

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyoxigraph import BlankNode, CanonicalizationAlgorithm, Dataset, Literal, NamedNode, RdfFormat, Triple, parse

from benchmarks.synthetic_plant import node, plant
from homeostat.knowledge.questions import questions
from homeostat.knowledge.store.store import GraphStore, QueryRejected, StoreError
from tests.knowledge.terms import XSD

See: TypeAlias = Callable[[tuple[NamedNode, ...]], GraphStore]
"""The store under test, seen with other default graphs."""

G, H = NamedNode("urn:test:g"), NamedNode("urn:test:h")
S, P, Q = NamedNode("urn:test:s"), NamedNode("urn:test:p"), NamedNode("urn:test:q")
EVERYTHING = "SELECT ?s ?p ?o ?g WHERE { { ?s ?p ?o BIND('' AS ?g) } UNION { GRAPH ?g { ?s ?p ?o } } }"
ODD_TERMS = (
    Literal("plain"),
    Literal("→ × ∫ – é 😀"),
    Literal("quote \" tick ' back\\slash \n line \t tab \\u0022"),
    Literal("Ventil", language="de"),
    Literal("valve", language="en-gb"),
    Literal(1.5),
    Literal(3),
    Literal(True),
    Literal("2026-01-01T00:00:00Z", datatype=XSD.dateTime),
    Literal("", datatype=XSD.double),
    Literal("x", datatype=NamedNode("urn:test:type")),
    Literal(""),
    NamedNode("urn:test:größe/→"),
)
ANY_TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)


def canonical(data: bytes, format: RdfFormat) -> Dataset:
    """The parsed data with blank nodes named by their place, so that equal graphs compare equal."""
    dataset = Dataset(parse(data, format=format))
    dataset.canonicalize(CanonicalizationAlgorithm.UNSTABLE)
    return dataset


def one_line(error: pytest.ExceptionInfo[StoreError]) -> str:
    """The message, which must be one line."""
    message = str(error.value)
    assert message and "\n" not in message and len(message) < 700
    return message


@contextmanager
def profiled() -> Iterator[None]:
    """Another thread that looks at the frames of this one as often as it can, and holds the last ones."""
    me, done = threading.get_ident(), threading.Event()

    def look() -> None:
        seen: deque[FrameType] = deque(maxlen=50)
        while not done.is_set():
            frame = sys._current_frames().get(me)
            while frame is not None:
                seen.append(frame)
                frame = frame.f_back

    profiler, usual = threading.Thread(target=look), sys.getswitchinterval()
    profiler.start()
    sys.setswitchinterval(1e-5)
    try:
        yield
    finally:
        sys.setswitchinterval(usual)
        done.set()
        profiler.join()


class GraphStoreContract:
    """Inherit, and provide the fixtures ``store`` (empty) and ``see`` (the same store with other default graphs)."""

    def test_an_empty_store_answers(self, store: GraphStore) -> None:
        assert store.select("SELECT * { ?s ?p ?o }") == ()
        assert store.construct("CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }") == ()
        assert store.ask("ASK {}") is True
        assert store.ask("ASK { ?s ?p ?o }") is False

    def test_rows_keep_the_order_of_variables_and_solutions(self, store: GraphStore) -> None:
        store.update(f"INSERT DATA {{ {S} {P} 2 . {S} {P} 10 . {S} {P} 1 }}")
        rows = store.select(f"SELECT ?missing ?n ?s {{ ?s {P} ?n }} ORDER BY DESC(?n)")
        assert [row.variables for row in rows] == [("missing", "n", "s")] * 3
        assert [row.terms for row in rows] == [(None, Literal(n), S) for n in (10, 2, 1)]

    def test_a_graph_is_sorted_and_has_each_triple_once(self, store: GraphStore) -> None:
        store.update(f"INSERT DATA {{ {S} {P} {Q} . {S} {Q} {P} . {Q} {P} {S} }}")
        triples = store.construct(f"CONSTRUCT {{ {S} {P} ?o . ?s ?p ?o }} WHERE {{ ?s ?p ?o }}")
        assert len(triples) == 5 and list(triples) == sorted(set(triples), key=str)
        assert Triple(S, P, S) in triples and Triple(S, P, P) in triples

    def test_describe_is_asked_like_construct(self, store: GraphStore) -> None:
        store.update(f"INSERT DATA {{ {S} {P} 1 ; {Q} 2 . {Q} {P} 3 }}")
        assert store.construct(f"DESCRIBE {S}") == (Triple(S, P, Literal(1)), Triple(S, Q, Literal(2)))

    @pytest.mark.parametrize("query", ["ASK {}", "CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }", f"DESCRIBE {S}"])
    def test_select_refuses_other_forms(self, store: GraphStore, query: str) -> None:
        with pytest.raises(QueryRejected) as error:
            store.select(query)
        assert one_line(error)

    @pytest.mark.parametrize("query", ["ASK {}", "SELECT * {}"])
    def test_construct_refuses_other_forms(self, store: GraphStore, query: str) -> None:
        with pytest.raises(QueryRejected) as error:
            store.construct(query)
        assert one_line(error)

    @pytest.mark.parametrize("query", ["SELECT * {}", "CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }", f"DESCRIBE {S}"])
    def test_ask_refuses_other_forms(self, store: GraphStore, query: str) -> None:
        with pytest.raises(QueryRejected) as error:
            store.ask(query)
        assert one_line(error)

    def test_a_malformed_request_is_rejected_with_the_place(self, store: GraphStore) -> None:
        for request in (
            lambda: store.select("SELECT * {\n ?s ?p }"),
            lambda: store.construct("CONSTRUCT {"),
            lambda: store.ask("ASK"),
            lambda: store.update("INSERT DATA { <urn:a> }"),
            lambda: store.load(b"<urn:a> <urn:b>", RdfFormat.TURTLE),
            lambda: store.load(b"{", RdfFormat.JSON_LD),
        ):
            with pytest.raises(QueryRejected) as error:
                request()
            assert "rejected" in one_line(error) and "correct the" in str(error.value)

    def test_a_query_cannot_change_the_store(self, store: GraphStore) -> None:
        store.update(f"INSERT DATA {{ {S} {P} 1 }}")
        for ask in (store.select, store.construct, store.ask):
            with pytest.raises(QueryRejected):
                ask("DROP ALL")
        with pytest.raises(QueryRejected):
            store.update("SELECT * {}")
        assert store.ask(f"ASK {{ {S} {P} 1 }}")

    def test_what_is_rejected_leaves_no_trace(self, store: GraphStore) -> None:
        requests: tuple[Callable[[], None], ...] = (
            lambda: store.load(f"{S} {P} 1 .\n{S} {P} .".encode(), RdfFormat.TURTLE, G),
            lambda: store.load(f"{S} {P} 1 {G} .\n{S} {P} .".encode(), RdfFormat.N_QUADS),
            lambda: store.update(f"INSERT DATA {{ {S} {P} 1 }} ; INSERT DATA {{ {S} }}"),
        )
        for request in requests:
            with pytest.raises(QueryRejected):
                request()
        assert store.select(EVERYTHING) == ()

    def test_update_inserts_and_deletes(self, store: GraphStore) -> None:
        store.update(f"INSERT DATA {{ GRAPH {G} {{ {S} {P} 1, 2 }} }}")
        store.update(f"DELETE WHERE {{ GRAPH {G} {{ ?s {P} 1 }} }} ; INSERT DATA {{ {S} {P} 3 }}")
        rows = {(row.term("o"), row.term("g")) for row in store.select(EVERYTHING)}
        assert rows == {(Literal(2), G), (Literal(3), Literal(""))}

    @pytest.mark.parametrize("format", [RdfFormat.TURTLE, RdfFormat.N_TRIPLES, RdfFormat.RDF_XML])
    @pytest.mark.parametrize("graph", [None, G])
    def test_triples_go_where_they_are_sent(
        self, store: GraphStore, format: RdfFormat, graph: NamedNode | None
    ) -> None:
        source = f"{S} {P} {Q} .".encode()
        if format is RdfFormat.RDF_XML:
            source = (
                b'<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:t="urn:test:">'
                b'<rdf:Description rdf:about="urn:test:s"><t:p rdf:resource="urn:test:q"/></rdf:Description></rdf:RDF>'
            )
        store.load(source, format, graph)
        (row,) = store.select(EVERYTHING)
        assert row.terms == (S, P, Q, graph or Literal(""))
        assert canonical(store.dump(RdfFormat.TURTLE, graph), RdfFormat.TURTLE) == canonical(source, format)
        assert store.dump(RdfFormat.N_TRIPLES, H) == b""

    @pytest.mark.parametrize("format", [RdfFormat.TRIG, RdfFormat.N_QUADS, RdfFormat.JSON_LD])
    def test_data_that_names_its_graphs_keeps_the_names(self, store: GraphStore, format: RdfFormat) -> None:
        nquads = f"{S} {P} _:b {G} .\n_:b {P} {Q} {G} .\n{S} {P} {Q} .\n".encode()
        store.load(nquads, RdfFormat.N_QUADS)
        written = store.dump(format)
        assert canonical(written, format) == canonical(nquads, RdfFormat.N_QUADS)
        store.update("DROP ALL")
        store.load(written, format)
        assert canonical(store.dump(RdfFormat.N_QUADS), RdfFormat.N_QUADS) == canonical(nquads, RdfFormat.N_QUADS)

    def test_data_that_names_its_graphs_takes_no_other(self, store: GraphStore) -> None:
        for request in (
            lambda: store.load(f"{S} {P} {Q} {H} .".encode(), RdfFormat.N_QUADS, G),
            lambda: store.dump(RdfFormat.TRIG, G),
        ):
            with pytest.raises(QueryRejected) as error:
                request()
            assert G.value in one_line(error)
        assert store.select(EVERYTHING) == ()

    def test_load_adds(self, store: GraphStore) -> None:
        for number in (1, 2, 1):
            store.load(f"{S} {P} {number} .".encode(), RdfFormat.TURTLE, G)
        assert len(store.select(EVERYTHING)) == 2

    def test_odd_terms_come_back_as_they_were(self, store: GraphStore) -> None:
        lines = "".join(f"{S} {P} {term} .\n" for term in ODD_TERMS).encode()
        store.load(lines, RdfFormat.N_TRIPLES, G)
        rows = store.select(f"SELECT ?o {{ GRAPH {G} {{ {S} {P} ?o }} }}")
        assert {row.term("o") for row in rows} == set(ODD_TERMS)
        graph = store.construct(f"CONSTRUCT {{ ?s ?p ?o }} {{ GRAPH {G} {{ ?s ?p ?o }} }}")
        assert {triple.object for triple in graph} == set(ODD_TERMS)
        for format in (RdfFormat.TURTLE, RdfFormat.N_TRIPLES):
            again = parse(store.dump(format, G), format=format)
            assert {quad.object for quad in again} == set(ODD_TERMS)

    def test_blank_nodes_stay_joined(self, store: GraphStore) -> None:
        data = f"{S} {P} _:x . _:x {P} _:y ; {Q} 1 . _:y {Q} 2 .".encode()
        store.load(data, RdfFormat.TURTLE, G)
        (row,) = store.select(f"SELECT ?x ?n {{ GRAPH {G} {{ {S} {P}/{P} ?x . ?x {Q} ?n }} }}")
        assert isinstance(row.term("x"), BlankNode) and row.number("n") == 2.0
        triples = store.construct(f"CONSTRUCT {{ ?s ?p ?o }} {{ GRAPH {G} {{ ?s ?p ?o }} }}")
        text = "".join(f"{triple} .\n" for triple in triples).encode()
        assert canonical(text, RdfFormat.N_TRIPLES) == canonical(data, RdfFormat.TURTLE)
        assert canonical(store.dump(RdfFormat.TURTLE, G), RdfFormat.TURTLE) == canonical(data, RdfFormat.TURTLE)

    @given(text=ANY_TEXT)
    @settings(
        max_examples=25,
        database=None,
        suppress_health_check=[
            HealthCheck.function_scoped_fixture,
            HealthCheck.differing_executors,
            HealthCheck.too_slow,
        ],
    )
    def test_any_text_comes_back(self, store: GraphStore, text: str) -> None:
        store.update(f"DROP ALL ; INSERT DATA {{ {S} {P} {Literal(text)} }}")
        (row,) = store.select("SELECT ?o { ?s ?p ?o }")
        assert row.text("o") == text
        assert store.ask(f"ASK {{ {S} {P} {Literal(text)} }}")

    def test_queries_without_a_graph_see_the_default_graphs(self, store: GraphStore, see: See) -> None:
        store.update(f"INSERT DATA {{ {S} {P} 0 . GRAPH {G} {{ {S} {P} 1 }} GRAPH {H} {{ {S} {P} 2 }} }}")
        for graphs, numbers in (((), {0}), ((G,), {1}), ((G, H), {1, 2}), ((NamedNode("urn:test:none"),), set())):
            view = see(graphs)
            seen = {row.number("o") for row in view.select("SELECT ?o { ?s ?p ?o }")}
            assert seen == numbers
            assert view.ask("ASK { ?s ?p ?o }") == bool(numbers)
            assert len(view.construct("CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }")) == len(numbers)
            assert canonical(view.dump(RdfFormat.N_QUADS), RdfFormat.N_QUADS) == canonical(
                store.dump(RdfFormat.N_QUADS), RdfFormat.N_QUADS
            )

    def test_many_threads_may_ask_at_once(self, store: GraphStore) -> None:
        store.load(plant(3), RdfFormat.N_TRIPLES)
        with ThreadPoolExecutor(8) as threads:
            asked = [threads.submit(questions.transitions, store, node(n % 3, "machine")) for n in range(24)]
            answers = [future.result() for future in asked]
        assert [len(answer) for answer in answers] == [24] * 24
        assert all(answers[n] == answers[n % 3] for n in range(24))

    def test_an_error_may_be_let_go_of_in_another_thread(
        self, store: GraphStore, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        store.load(plant(1), RdfFormat.N_TRIPLES)

        def failures() -> list[StoreError]:
            kept = []
            for ask, query in ((store.ask, "SELECT * { ?s ?p ?o }"), (store.select, "DESCRIBE ?s { ?s ?p ?o }")):
                try:
                    ask(query)
                except StoreError as error:
                    kept.append(error)
            return kept

        lost: list[object] = []
        monkeypatch.setattr(sys, "unraisablehook", lost.append)
        with ThreadPoolExecutor(1) as other:
            errors = other.submit(failures).result()
            assert len(errors) == 2
            errors.clear()
            gc.collect()
        assert lost == []

    def test_an_answer_is_let_go_of_in_its_own_thread_though_a_profiler_looks_on(
        self, store: GraphStore, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A sampling profiler holds the frames that it saw for longer than they run, and drops them in its thread."""
        store.load(plant(1), RdfFormat.N_TRIPLES)
        lost: list[object] = []
        monkeypatch.setattr(sys, "unraisablehook", lost.append)
        with profiled():
            for _ in range(50):
                assert store.select("SELECT ?s ?o { ?s ?p ?o } LIMIT 50")
                assert store.construct("CONSTRUCT WHERE { ?s ?p ?o } LIMIT 50")
                for ask, query in ((store.select, "ASK {}"), (store.ask, "SELECT ?s { ?s ?p ?o }")):
                    with pytest.raises(QueryRejected):
                        ask(query)
        gc.collect()
        assert lost == []

    def test_a_large_answer_is_complete(self, store: GraphStore) -> None:
        data = plant(20)
        store.load(data, RdfFormat.N_TRIPLES)
        graph = store.construct("CONSTRUCT { ?s ?p ?o } { ?s ?p ?o }")
        assert "".join(f"{triple} .\n" for triple in graph).encode().splitlines() == sorted(data.splitlines())
