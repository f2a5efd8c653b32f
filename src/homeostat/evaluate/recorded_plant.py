"""The plant that a run was made with, found again: by its folder, or its name where it is installed, and its digest."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from homeostat.journal import RunStarted, Setting
from homeostat.plants.error import CaseError
from homeostat.plants.folder import CASES, SETTINGS
from homeostat.plants.plant import Case, load_case

FOLDER: Final = "plant folder"
"""Name of the setting that has the folder of a plant that is not installed, as an absolute path."""
_DIGITS: Final = 12
"""Digits of a digest that are shown."""


def place(case: Case) -> tuple[Setting, ...]:
    """Where the plant of a run is, for its first event; nothing for an installed one, which has a name everywhere."""
    folder = case.files.folder
    return () if folder.parent == CASES else (Setting(FOLDER, str(folder)),)


def recorded_folder(started: RunStarted) -> str | None:
    """The folder that the run ``started`` in; None for an installed plant."""
    value = _setting(started, FOLDER)
    return None if value is None else str(value)


def recorded_case(started: RunStarted, given: str | None = None) -> Case:
    """The plant of a run: in the folder ``given`` or by that name, else where the run had it.

    Raises:
        CaseError: there is none, or its configuration is not that of the run; the message names both.
        GraphError: its generated files were altered or disagree.
    """
    where = given or recorded_folder(started) or started.case
    try:
        case = load_case(str(Path(where).resolve()) if (Path(where) / SETTINGS).is_file() else where)
    except CaseError as error:
        remedy = "name its folder with --case"
        raise CaseError(f"plant {started.case!r} of the run cannot be read from {where!r}: {error}; {remedy}") from None
    made = _setting(started, "configuration")
    if made is not None and case.configuration != made:
        raise CaseError(
            f"the plant in {str(case.files.folder)!r} has configuration {case.configuration[:_DIGITS]}, and the run "
            f"was made with {started.case!r} in configuration {str(made)[:_DIGITS]}; name its folder with --case"
        )
    return case


def _setting(started: RunStarted, name: str) -> str | float | bool | None:
    return next((setting.value for setting in started.configuration if setting.name == name), None)
