"""The graph that a graph command works on: a plant's own, or one in a file, of a plant or of any plant."""

from dataclasses import dataclass, replace
from pathlib import Path

from pyoxigraph import NamedNode

from homeostat.cli.arguments import UsageError
from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.store.embedded import EmbeddedStore
from homeostat.knowledge.store.graph_file import UnreadableGraph, load_file
from homeostat.knowledge.vocabulary.tbox import ONTOLOGY_GRAPH, load_ontology
from homeostat.knowledge.vocabulary.vocabulary import PREFIXES
from homeostat.plants.files.folder import PlantFiles, read_files
from homeostat.plants.files.generated import with_fresh_graph
from homeostat.plants.files.places import plant_folder
from homeostat.plants.settings.file import read_settings
from homeostat.plants.settings.settings import Settings


@dataclass(frozen=True, slots=True)
class PlantGraph:
    """An installed plant, as far as graph commands need it."""

    files: PlantFiles
    """What its folder holds."""
    settings: Settings
    """Its settings."""

    @property
    def name(self) -> str:
        """Name of the plant."""
        return self.files.folder.name

    @property
    def system(self) -> NamedNode:
        """The plant in its graph."""
        return NamedNode(self.settings.system)

    @property
    def namespace(self) -> str:
        """What the names of its things begin with, without the #."""
        return self.system.value.rpartition("#")[0]


@dataclass(frozen=True, slots=True)
class Place:
    """Which graph is meant."""

    path: Path
    """File of the graph."""
    plant: PlantGraph | None
    """The plant that it is of; None for the graph of any other."""

    @property
    def own(self) -> bool:
        """Whether it is the one in the plant's folder."""
        return self.plant is not None and self.path == self.plant.files.folder / GRAPH

    @property
    def prefixes(self) -> dict[str, str]:
        """Prefix -> namespace IRI, a plant's own included."""
        own = {} if self.plant is None else {self.plant.name: self.plant.namespace + "#"}
        return {**dict(PREFIXES), **own}


def place(name: str | None, file: Path | None, fresh: bool = True) -> Place:
    """The graph in ``file``, or else that of the plant called ``name``; PlantError where there is no such plant.

    A plant's own graph is made where there is none and, if it is to be ``fresh``, made again where it is older than its
    tables. Raises GraphError where it was altered, or cannot be made.
    """
    plant = None if name is None else _plant(name)
    if file is not None:
        return Place(file, plant)
    if plant is None:
        raise UsageError("no graph is named; name a CASE, or a file with --graph FILE")
    if fresh or GRAPH not in plant.files.contents:
        plant = replace(plant, files=with_fresh_graph(plant.files, kept=True))
    return Place(plant.files.folder / GRAPH, plant)


def opened(where: Place) -> EmbeddedStore:
    """The graph alone."""
    store = EmbeddedStore()
    _load(store, where, None)
    return store


def with_ontology(where: Place) -> EmbeddedStore:
    """The graph and the ontologies in one store; a query that names no graph sees both."""
    store = EmbeddedStore()
    load_ontology(store)
    graph = NamedNode("urn:homeostat:file" if where.plant is None else where.plant.namespace)
    _load(store, where, graph)
    return store.seeing(graph, ONTOLOGY_GRAPH)


def _plant(name: str) -> PlantGraph:
    files = read_files(plant_folder(name))
    return PlantGraph(files, read_settings(files))


def _load(store: EmbeddedStore, where: Place, graph: NamedNode | None) -> None:
    try:
        own = where.plant.files.contents[GRAPH] if where.plant is not None and where.own else None
        load_file(store, where.path, graph, own)
    except UnreadableGraph as error:
        raise UsageError(str(error)) from error
