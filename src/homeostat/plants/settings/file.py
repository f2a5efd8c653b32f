"""Reading ``case.toml``: every mistake is one line with the place, the value, what is allowed and the near match."""

import tomllib

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from homeostat.knowledge.build.timing import timing_of
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS, PlantFiles
from homeostat.plants.settings.lines import line_of
from homeostat.plants.settings.mistake import told
from homeostat.plants.settings.settings import Settings


def read_settings(files: PlantFiles) -> Settings:
    """The settings of the plant; PlantError with the first mistake and the number of the others.

    A key that there is not comes before everything else: misspelt, it is why another one is missing.
    """
    found = _validated(files)
    if isinstance(found, Settings):
        return found
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    raise PlantError(f"{found[0]}{more}")


def settings_mistakes(files: PlantFiles) -> tuple[str, ...]:
    """Every mistake in the settings by themselves, one line each, in the order of :func:`read_settings`."""
    found = _validated(files)
    return () if isinstance(found, Settings) else found


def _validated(files: PlantFiles) -> Settings | tuple[str, ...]:
    """The settings, or what is wrong with them."""
    where = f"{files.folder.name}/{SETTINGS}"
    try:
        text = files.content(SETTINGS).decode("utf-8")
        content = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # TOMLDecodeError, UnicodeDecodeError, a number of 5000 digits
        return (f"{where} is no TOML: {error}",)
    if "patience" in content:
        if "intervention" in content:
            return (f"{where}: [patience] and [intervention] are two names of one table; keep one of them",)
        content["intervention"] = content.pop("patience")
    try:
        return Settings.model_validate(content, context=timing_of(files.folder))
    except ValidationError as error:
        found = sorted(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
        return tuple(f"{where}{_line(text, each)}: {told(each)}" for each in found)  # an unknown key may cure others


def _line(text: str, error: ErrorDetails) -> str:
    """Which line it is, as a place has it; nothing for what is missing from the whole file."""
    line = line_of(text, error["loc"])
    return "" if line is None else f" line {line}"
