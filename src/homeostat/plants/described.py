"""A plant as its graph and settings describe it, without its process model: none of the plant's code runs."""

from collections.abc import Mapping
from dataclasses import dataclass

from pyoxigraph import NamedNode

from homeostat.domain.mode import Side
from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.flowsheet import Flowsheet
from homeostat.domain.plant.prices import Prices, prices_of
from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.description.function import flowsheet, remarks, sensor_noise
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.store import GraphStore
from homeostat.plants.configuration import configuration_digest
from homeostat.plants.files.folder import PlantFiles, read_files
from homeostat.plants.files.generated import with_fresh_graph
from homeostat.plants.files.graph import open_graph
from homeostat.plants.files.places import plant_folder
from homeostat.plants.settings.check import refuse_misnamed
from homeostat.plants.settings.defaults import completed
from homeostat.plants.settings.file import read_settings
from homeostat.plants.settings.settings import Settings


@dataclass(frozen=True, slots=True)
class StatedPlant:
    """What a plant's folder states, before any of its code runs."""

    read: PlantFiles
    """What the folder held."""
    files: PlantFiles
    """The same with a graph of the tables as they are now."""
    settings: Settings
    """What ``case.toml`` says, with what it leaves open."""
    graph: GraphStore
    """The knowledge graph."""
    description: PlantDescription
    """What the graph says."""


@dataclass(frozen=True, slots=True)
class DescribedPlant:
    """What tables and settings say of one plant."""

    files: PlantFiles
    """What its folder holds, with a graph of the tables as they are now."""
    settings: Settings
    """What ``case.toml`` says."""
    description: PlantDescription
    """What the graph says."""
    flowsheet: Flowsheet
    """What the plant does."""
    noise: Mapping[str, tuple[float, str]]
    """Tag -> standard deviation of its sensor's noise, and its unit; ``1`` where it is relative to the reading."""
    remarks: Mapping[str, str]
    """State or transition -> what engineering says about it."""

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.files.folder.name

    @property
    def configuration(self) -> str:
        """Digest of everything that configures the plant."""
        return configuration_digest(self.files)

    @property
    def recipe(self) -> Side:
        """Who runs the nominal sequence in modes that write."""
        return Side(self.settings.recipe)

    @property
    def prices(self) -> Prices:
        """What production is, and what everything that does not forbid costs."""
        objective, plant = self.settings.objective, self.description
        return prices_of(
            plant.prices, objective.production, objective.currency, plant.limits, plant.machine, plant.timing
        )


def read_stated(name: str, kept: bool) -> StatedPlant:
    """Read settings and tables of the plant called ``name``, or the one in the folder ``name``.

    A graph that is older than its tables is made again and, where ``kept``, written to the folder. Raises PlantError
    where there is no such plant or its settings are wrong, GraphError where the graph was altered or cannot be read.
    """
    files = read_files(plant_folder(name))
    settings = read_settings(files)
    fresh = with_fresh_graph(files, kept)
    graph = open_graph(fresh.contents[GRAPH])
    description = read_plant(graph, NamedNode(settings.system))
    settings = completed(files.folder.name, settings, description)
    refuse_misnamed(files.folder.name, settings, description)
    return StatedPlant(files, fresh, settings, graph, description)


def read_described(name: str) -> DescribedPlant:
    """Read the plant called ``name``, or the one in the folder ``name``; reference values are not needed.

    Nothing is written: a graph that is older than its tables is made again for this once. Raises as
    :func:`read_stated`.
    """
    stated = read_stated(name, kept=False)
    graph, system = stated.graph, NamedNode(stated.settings.system)
    return DescribedPlant(
        files=stated.files,
        settings=stated.settings,
        description=stated.description,
        flowsheet=flowsheet(graph, system),
        noise=sensor_noise(graph, system),
        remarks=remarks(graph, system),
    )
