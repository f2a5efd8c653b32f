"""Does a plant's process model fit what its tables and settings say? Its code is run for the first time here."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from pyoxigraph import NamedNode

from homeostat.evaluate.lint.finding import Finding, Place, Severity, split
from homeostat.evaluate.lint.places import Places
from homeostat.evaluate.lint.stated import CORRECT, of_mistake, of_setting
from homeostat.knowledge.build.build import GRAPH
from homeostat.knowledge.build.tables.reading import FOLDER
from homeostat.knowledge.checks.consistency import inconsistencies
from homeostat.knowledge.description.plant import read_plant
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.equations import unit_mistakes
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS, read_files
from homeostat.plants.files.generated import with_fresh_graph
from homeostat.plants.files.graph import interface, open_graph
from homeostat.plants.model import find_model
from homeostat.plants.plant import load_plant
from homeostat.plants.settings.check import refuse_misfit
from homeostat.plants.settings.defaults import completed
from homeostat.plants.settings.file import read_settings

PARAMETERS: Final = f"{FOLDER}/parameters.csv"
"""Where units of equations are stated."""


def fits(folder: Path) -> Iterator[Finding]:
    """Where model, tables and settings of the plant in ``folder`` disagree; its settings and tables are sound."""
    files, places = read_files(folder), Places(folder)
    settings = read_settings(files)
    fresh = with_fresh_graph(files, kept=False)
    described = read_plant(open_graph(fresh.contents[GRAPH]), NamedNode(settings.system))
    try:
        settings = completed(folder.name, settings, described)
        model = find_model(fresh, settings.model, described)
    except PlantError as error:
        what, remedy = split(str(error), "mend it")
        yield Finding(Severity.ERROR, "model", Place(SETTINGS, None, "model"), what, remedy)
        return
    wrong = [
        of_mistake("consistency", GraphError(*mistake), places)
        for mistake in inconsistencies(described, interface(model, settings.twin.settings.horizon_s))
    ]
    yield from wrong
    for said in unit_mistakes(folder.name, described, model):
        what, remedy = split(said.partition(": ")[2], CORRECT)
        yield Finding(Severity.ERROR, "units", Place(PARAMETERS), what, remedy)
    try:
        refuse_misfit(folder.name, settings, described, model)
        if not wrong:
            load_plant(str(folder), learned=False, kept=False)  # what is left: balances, choices of whole routes
    except PlantError as error:
        yield of_setting(str(error))
    except GraphError as error:
        yield of_mistake("consistency", error, places)
