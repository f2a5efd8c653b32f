"""The graph of a case: read, checked against the process model, and turned into typed values."""

from __future__ import annotations

from pathlib import Path

from pyoxigraph import NamedNode, RdfFormat

from homeostat.domain.plant_description import PlantDescription
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.embedded import EmbeddedStore
from homeostat.knowledge.store import GraphStore
from homeostat.process.model import ProcessModel


def open_graph(path: Path) -> EmbeddedStore:
    """The A-Box in ``path`` (Turtle) in a store in memory."""
    store = EmbeddedStore()
    store.load(path.read_bytes(), RdfFormat.TURTLE)
    return store


def read_description(store: GraphStore, system: str, model: ProcessModel) -> PlantDescription:
    """The plant as its graph describes it; ``model`` must offer what the graph names."""
    return read_plant(store, NamedNode(system))
