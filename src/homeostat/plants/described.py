"""A plant as its graph and settings describe it, without its process model: none of the plant's code runs."""

from collections.abc import Mapping
from dataclasses import dataclass

from pyoxigraph import NamedNode

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.flowsheet import Flowsheet
from homeostat.domain.plant.prices import Prices, prices_of
from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.description.function import flowsheet, remarks, sensor_noise
from homeostat.knowledge.description.plant import read_plant
from homeostat.plants.configuration import configuration_digest
from homeostat.plants.files.folder import PlantFiles, read_files
from homeostat.plants.files.generated import with_fresh_graph
from homeostat.plants.files.graph import open_graph
from homeostat.plants.files.places import plant_folder
from homeostat.plants.settings.check import refuse_misnamed
from homeostat.plants.settings.file import read_settings
from homeostat.plants.settings.settings import Settings


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
    def prices(self) -> Prices:
        """What production is, and what everything that does not forbid costs."""
        objective, plant = self.settings.objective, self.description
        return prices_of(plant.prices, objective.production, objective.currency, plant.limits, plant.machine)


def read_described(name: str) -> DescribedPlant:
    """Read the plant called ``name``, or the one in the folder ``name``; reference values are not needed.

    Nothing is written: a graph that is older than its tables is made again for this once. Raises PlantError where
    there is no such plant or its settings are wrong, GraphError where the graph was altered or cannot be read.
    """
    files = read_files(plant_folder(name))
    settings = read_settings(files)
    fresh = with_fresh_graph(files, kept=False)
    graph, system = open_graph(fresh.contents[GRAPH]), NamedNode(settings.system)
    description = read_plant(graph, system)
    refuse_misnamed(files.folder.name, settings, description)
    return DescribedPlant(
        files=fresh,
        settings=settings,
        description=description,
        flowsheet=flowsheet(graph, system),
        noise=sensor_noise(graph, system),
        remarks=remarks(graph, system),
    )
