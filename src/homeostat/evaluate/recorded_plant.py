"""The plant that a run was made with, found again: by its folder, or its name where it is installed, and its digest."""

from pathlib import Path
from typing import Final

from homeostat.journal import RunStarted, Setting
from homeostat.plants.error import PlantError
from homeostat.plants.folder import CASES, SETTINGS
from homeostat.plants.plant import Plant, load_plant

FOLDER: Final = "plant folder"
"""Name of the setting that has the folder of a plant that is not installed, as an absolute path."""
_DIGITS: Final = 12
"""Digits of a digest that are shown."""


def place(plant: Plant) -> tuple[Setting, ...]:
    """Where the plant of a run is, for its first event; nothing for an installed one, which has a name everywhere."""
    folder = plant.files.folder
    return () if folder.parent == CASES else (Setting(FOLDER, str(folder)),)


def recorded_folder(started: RunStarted) -> str | None:
    """The folder that the run ``started`` in; None for an installed plant."""
    value = _setting(started, FOLDER)
    return None if value is None else str(value)


def recorded_plant_of(started: RunStarted, given: str | None = None) -> Plant:
    """The plant of a run: in the folder ``given`` or by that name, else where the run had it.

    Raises:
        PlantError: there is none, or its configuration is not that of the run; the message names both.
        GraphError: its generated files were altered or disagree.
    """
    where = given or recorded_folder(started) or started.case
    try:
        plant = load_plant(str(Path(where).resolve()) if (Path(where) / SETTINGS).is_file() else where)
    except PlantError as error:
        remedy = "name its folder with --case"
        raise PlantError(
            f"plant {started.case!r} of the run cannot be read from {where!r}: {error}; {remedy}"
        ) from None
    made = _setting(started, "configuration")
    if made is not None and plant.configuration != made:
        raise PlantError(
            f"the plant in {str(plant.files.folder)!r} has configuration {plant.configuration[:_DIGITS]}, and the run "
            f"was made with {started.case!r} in configuration {str(made)[:_DIGITS]}; name its folder with --case"
        )
    return plant


def _setting(started: RunStarted, name: str) -> str | float | bool | None:
    return next((setting.value for setting in started.configuration if setting.name == name), None)
