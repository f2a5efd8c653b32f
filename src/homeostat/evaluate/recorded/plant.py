"""The plant that a run was made with, found again: by its folder, or its name where it is installed, and its digest."""

from pathlib import Path
from typing import Final

from homeostat.journal import RunStarted, Setting
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import INSTALLED, SETTINGS
from homeostat.plants.files.places import shipped_names
from homeostat.plants.plant import Plant, load_plant

FOLDER: Final = "plant folder"
"""Name of the setting that has the folder of a plant that is not installed, as an absolute path."""
_DIGITS: Final = 12
"""Digits of a digest that are shown."""


def place(folder: Path) -> tuple[Setting, ...]:
    """Where the plant of a run is, for its first event; nothing for an installed one, which has a name everywhere."""
    return () if folder.parent == INSTALLED else (Setting(FOLDER, str(folder)),)


def recorded_folder(started: RunStarted) -> str | None:
    """The folder that the run ``started`` in; None for an installed plant."""
    folder = started.settings.get(FOLDER)
    return None if folder is None or Path(str(folder)).parent == INSTALLED else str(folder)


def recorded_place(started: RunStarted) -> str:
    """The folder that the run had its plant in, or the plant's name where it has one.

    A plant of this package is that of this package, whatever folder of its name there is where somebody stands.
    """
    if (folder := recorded_folder(started)) is not None:
        return folder
    return str(INSTALLED / started.case) if started.case in shipped_names() else started.case


def recorded_plant_of(started: RunStarted, given: str | None = None, option: str = "--case") -> Plant:
    """The plant of a run: in the folder ``given`` or by that name, else where the run had it.

    PlantError where there is none, or another configuration than the run's, with the ``option`` that names it;
    GraphError where generated files disagree.
    """
    where = given or recorded_place(started)
    try:
        plant = load_plant(str(Path(where).resolve()) if (Path(where) / SETTINGS).is_file() else where)
    except PlantError as error:
        text = f"plant {started.case!r} of the run cannot be read from {where!r}: {error}"
        raise PlantError(f"{text}; name its folder with {option}") from None
    made = str(started.settings.get("configuration", plant.configuration))
    if plant.configuration != made:
        raise PlantError(
            f"the plant in {str(plant.files.folder)!r} has configuration {plant.configuration[:_DIGITS]}, and the run "
            f"was made with {started.case!r} in configuration {made[:_DIGITS]}; name its folder with {option}"
        )
    return plant
