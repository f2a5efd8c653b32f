"""The graph of a plant: read, checked against the process model, and turned into typed values."""

from pyoxigraph import NamedNode, RdfFormat, parse

from homeostat.domain.plant.description import PlantDescription
from homeostat.knowledge.checks.consistency import ModelInterface, refuse_inconsistent
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.graph_file import load_triples
from homeostat.knowledge.store.store import GraphStore
from homeostat.knowledge.vocabulary.former import mentioned
from homeostat.process.model import ProcessModel


def open_graph(content: bytes) -> EmbeddedStore:
    """The A-Box in ``content`` (Turtle) in a store in memory."""
    store = EmbeddedStore()
    if mentioned(content):
        load_triples(store, (quad.triple for quad in parse(content, format=RdfFormat.TURTLE)))
    else:
        store.load(content, RdfFormat.TURTLE)
    return store


def read_description(store: GraphStore, system: str, model: ProcessModel, horizon_s: float) -> PlantDescription:
    """The plant as its graph describes it.

    Raises:
        GraphError: the graph is incomplete, or it and ``model`` do not fit; ``horizon_s`` is a rollout's length [s].
    """
    plant = read_plant(store, NamedNode(system))
    refuse_inconsistent(plant, interface(model, horizon_s))
    return plant


def interface(model: ProcessModel, horizon_s: float) -> ModelInterface:
    """What ``model`` offers to a graph."""
    return ModelInterface(
        parameters=frozenset(model.parameters),
        variables=frozenset(model.variables),
        faults=frozenset(model.faults),
        horizon_s=horizon_s,
    )
