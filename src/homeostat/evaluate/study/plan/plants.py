"""The plants of a study: installed ones by their name, others by the path of their folder."""

from collections.abc import Mapping
from functools import cache, lru_cache
from pathlib import Path

from homeostat.evaluate.study.error import StudyError
from homeostat.evaluate.study.plan.job import Job, OwnPlant
from homeostat.evaluate.study.plan.plan import Plan
from homeostat.knowledge.store.error import GraphError
from homeostat.plants.configuration import configuration_digest
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, read_files
from homeostat.plants.files.places import is_path, plant_folder
from homeostat.plants.plant import Plant, load_plant


def placed(plan: Plan, folder: Path) -> Plan:
    """``plan`` with the paths of plants, which begin at ``folder``, as absolute ones: workers may stand elsewhere.

    StudyError where there is no plant.
    """
    scenarios = tuple(s.model_copy(update={"case": _place(s.case, folder)}) for s in plan.scenarios)
    proposers = tuple(
        p.model_copy(update={"cases": tuple(_place(case, folder) for case in p.cases)}) for p in plan.proposers
    )
    return plan.model_copy(update={"scenarios": scenarios, "proposers": proposers})


def plants_of(plan: Plan) -> Mapping[str, Plant]:
    """Case -> plant, for all that ``plan`` names; StudyError where one cannot be used, or two have the same name."""
    found: dict[str, Plant] = {}
    for case in dict.fromkeys([s.case for s in plan.scenarios] + [c for p in plan.proposers for c in p.cases]):
        plant = _own(case) if is_path(case) else loaded(case)
        for other in found.values():
            if other.name == plant.name:
                where = " and ".join(repr(str(p.files.folder)) for p in (other, plant))
                raise StudyError(f"two plants are called {plant.name!r}, {where}; rename a folder: rows have the name")
        found[case] = plant
    return found


def own_plant(plant: Plant) -> OwnPlant | None:
    """What a job needs to have ``plant`` again in another process; None for an installed one, which has a name."""
    folder = plant.files.folder
    return None if folder.parent == INSTALLED else OwnPlant(str(folder), plant.configuration)


def plant_of(job: Job) -> Plant:
    """The plant of ``job``; StudyError where it is gone, or its folder holds another one than when the study began."""
    if job.own is None:
        return loaded(job.scenario.case)
    plant = _own(job.own.folder)
    if plant.configuration != job.own.configuration:
        raise StudyError(f"the plant in {job.own.folder!r} was changed since the study began; start the study again")
    return plant


@cache
def loaded(name: str) -> Plant:
    """The installed plant called ``name``, loaded once per process; StudyError where there is none."""
    try:
        return load_plant(name)
    except PlantError as error:
        raise StudyError(str(error)) from None


def _own(folder: str) -> Plant:
    """The plant in ``folder`` as its files are now."""
    try:
        files = read_files(plant_folder(folder))
    except PlantError as error:
        raise StudyError(str(error)) from None
    try:
        return _as_it_is(folder, configuration_digest(files))
    except (PlantError, GraphError) as error:
        raise StudyError(f"plant {folder!r}: {error}") from None


@lru_cache(maxsize=8)
def _as_it_is(folder: str, digest: str) -> Plant:
    """The plant in ``folder``, loaded once as long as its files have ``digest``."""
    return load_plant(folder)


def _place(case: str, folder: Path) -> str:
    try:
        found = plant_folder(case, folder)
    except PlantError as error:
        raise StudyError(str(error)) from None
    return found.name if found.parent == INSTALLED else str(found)
