"""The contract of graph stores, kept by every store there is."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyoxigraph import RdfFormat

from benchmarks.synthetic_plant import plant
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.endpoint import SparqlEndpoint
from homeostat.knowledge.store.store import QueryRejected, StoreUnavailable
from tests.contracts.graph_store import EVERYTHING, G, GraphStoreContract, P, S, See, one_line
from tests.knowledge.servers import graphdb_front, oxigraph_server

REPOSITORY = "plant one"


@pytest.fixture(scope="session")
def graphdb(oxigraph: str) -> Iterator[str]:
    """Address of a server with GraphDB's paths and the repository ``REPOSITORY``."""
    with graphdb_front(oxigraph, "plant%20one") as address:
        yield address


class TestInMemory(GraphStoreContract):
    @pytest.fixture
    def store(self) -> EmbeddedStore:
        return EmbeddedStore()

    @pytest.fixture
    def see(self, store: EmbeddedStore) -> See:
        return lambda graphs: store.seeing(*graphs)


class TestOxigraphServer(GraphStoreContract):
    @pytest.fixture
    def store(self, oxigraph: str) -> SparqlEndpoint:
        store = SparqlEndpoint.oxigraph(oxigraph)
        store.update("DROP ALL")
        return store

    @pytest.fixture
    def see(self, store: SparqlEndpoint) -> See:
        return lambda graphs: store.seeing(*graphs)


class TestGraphDbPaths(GraphStoreContract):
    @pytest.fixture
    def store(self, graphdb: str) -> SparqlEndpoint:
        store = SparqlEndpoint.graphdb(graphdb, REPOSITORY)
        store.update("DROP ALL")
        return store

    @pytest.fixture
    def see(self, store: SparqlEndpoint) -> See:
        return lambda graphs: store.seeing(*graphs)

    def test_another_repository_is_not_there(self, graphdb: str) -> None:
        with pytest.raises(StoreUnavailable) as error:
            SparqlEndpoint.graphdb(graphdb, "other").ask("ASK {}")
        assert "404" in one_line(error) and "check the address" in str(error.value)


class TestOnDisk(GraphStoreContract):
    @pytest.fixture
    def store(self, tmp_path: Path) -> EmbeddedStore:
        return EmbeddedStore(tmp_path / "a folder" / "store")

    @pytest.fixture
    def see(self, store: EmbeddedStore) -> See:
        return lambda graphs: store.seeing(*graphs)

    def test_what_was_written_is_there_after_reopening(self, tmp_path: Path) -> None:
        store = EmbeddedStore(tmp_path / "kept")
        store.load(plant(2), RdfFormat.N_TRIPLES, G)
        store.update(f"INSERT DATA {{ {S} {P} 1 }}")
        before = store.dump(RdfFormat.N_QUADS)
        del store
        gc.collect()
        again = EmbeddedStore(str(tmp_path / "kept"))
        assert sorted(again.dump(RdfFormat.N_QUADS).splitlines()) == sorted(before.splitlines())
        with pytest.raises(QueryRejected):
            again.update("INSERT DATA {")
        assert again.ask(f"ASK {{ {S} {P} 1 }}")

    def test_a_store_in_use_cannot_be_opened_again(self, tmp_path: Path) -> None:
        first = EmbeddedStore(tmp_path / "used")
        with pytest.raises(StoreUnavailable) as error:
            EmbeddedStore(tmp_path / "used")
        assert str(tmp_path / "used") in one_line(error) and "close its other user" in str(error.value)
        assert first.ask("ASK {}")

    def test_a_file_is_no_folder(self, tmp_path: Path) -> None:
        (tmp_path / "file").write_text("")
        with pytest.raises(StoreUnavailable) as error:
            EmbeddedStore(tmp_path / "file")
        assert "choose another folder" in one_line(error)

    def test_a_query_that_is_no_text_is_rejected(self) -> None:
        with pytest.raises(QueryRejected) as error:
            EmbeddedStore().ask("ASK { ?s ?p '\ud800' }")
        assert one_line(error)


def test_a_server_on_disk_keeps_its_data_over_a_restart(tmp_path: Path) -> None:
    with oxigraph_server(tmp_path) as address:
        SparqlEndpoint.oxigraph(address).load(plant(1), RdfFormat.N_TRIPLES, G)
    with oxigraph_server(tmp_path) as address:
        rows = SparqlEndpoint.oxigraph(f"{address}/").select(EVERYTHING)
    assert len(rows) == len(plant(1).splitlines())


def test_a_store_that_goes_down_is_unavailable_and_then_back(tmp_path: Path) -> None:
    with oxigraph_server(tmp_path) as address:
        endpoint = SparqlEndpoint.oxigraph(address, timeout_s=5)
        endpoint.update(f"INSERT DATA {{ {S} {P} 1 }}")
    for request in (
        lambda: endpoint.ask("ASK {}"),
        lambda: endpoint.select("SELECT * {}"),
        lambda: endpoint.construct("DESCRIBE <urn:x>"),
        lambda: endpoint.update("DROP ALL"),
        lambda: endpoint.load(b"", RdfFormat.TURTLE),
        lambda: endpoint.dump(RdfFormat.N_QUADS),
    ):
        with pytest.raises(StoreUnavailable) as error:
            request()
        assert address in one_line(error) and "check that the server runs" in str(error.value)
