"""The graph of a plant in a store, and whether what it describes is the plant of a process model."""

from pyoxigraph import RdfFormat, parse

from homeostat.domain.plant.description import PlantDescription
from homeostat.knowledge.checks.consistency import ModelInterface, refuse_inconsistent
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.graph_file import load_triples
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


def refuse_other_model(plant: PlantDescription, model: ProcessModel, horizon_s: float) -> None:
    """GraphError where ``plant``, as its graph describes it, is not that of ``model``; ``horizon_s``: of a rollout."""
    refuse_inconsistent(plant, interface(model, horizon_s))


def interface(model: ProcessModel, horizon_s: float) -> ModelInterface:
    """What ``model`` offers to a graph."""
    return ModelInterface(
        parameters=frozenset(model.parameters),
        variables=frozenset(model.variables),
        faults=frozenset(model.faults),
        horizon_s=horizon_s,
    )
