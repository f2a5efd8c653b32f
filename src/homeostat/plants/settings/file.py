"""Reading ``case.toml``: every mistake is one line with the place, the value, what is allowed and the near match."""

import tomllib
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from homeostat.knowledge.build.timing import timing_of
from homeostat.plants.error import PlantError
from homeostat.plants.files.folder import SETTINGS, PlantFiles
from homeostat.plants.settings.settings import Settings
from homeostat.stl.spelling import near_matches

_LONGEST: Final = 80
_SPELLING: Final = {
    "model": "'module:class' or 'module:flowsheet', for example 'homeostat.plants.cstr.process:REACTOR'",
    "system": "an IRI with '#', for example 'urn:homeostat:cstr#system'",
}
"""Key -> how its text is written."""
_MEANT: Final = {
    "initial": "state what smoothing may get wrong of each state of the model, as { B1_V = 0.2 }; once something "
    "stands there, 'homeostat plant show' with '--table model' lists the states"
}
"""Key that nothing follows for -> what to do where it is missing."""


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
        content = tomllib.loads(files.content(SETTINGS).decode("utf-8"))
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
        return tuple(f"{where}: {_told(each)}" for each in found)  # an unknown key may cure the others


def _told(error: ErrorDetails) -> str:
    place = error["loc"]
    match error["type"]:
        case "extra_forbidden":
            name, known = str(place[-1]), _keys(place[:-1])
            key = f"{_words(place[:-1])}there is no key {_short(name)}"
            return f"{key}{near_matches(name, known)}; there are {', '.join(known)}"
        case "missing":
            remedy = f"; {_MEANT[str(place[-1])]}" if place[-1] in _MEANT else ""
            return f"{_words(place[:-1])}{place[-1]!r} is missing{remedy}"
        case "string_pattern_mismatch":
            like = _SPELLING.get(str(place[-1]), "a name without blanks")
            return f"{_words(place)}{_short(error['input'])} is not written as {like}"
        case "too_short":
            least, given = error["ctx"]["min_length"], error["ctx"]["actual_length"]
            return f"{_words(place)}at least {least} items are needed, and there are {given}; add what is meant"
        case "value_error":
            return f"{_words(place)}{error['msg'].removeprefix('Value error, ')}"
    return f"{_words(place)}{error['msg']} (given: {_short(error['input'])})"


def _keys(place: tuple[int | str, ...]) -> tuple[str, ...]:
    """What the table at ``place`` may hold."""
    table: type[BaseModel] = Settings
    for part in place:
        if isinstance(part, str) and part in table.model_fields:  # else a name in a table of tables
            annotation: Any = table.model_fields[part].annotation
            inner = getattr(annotation, "__args__", (annotation,))[-1]
            table = inner if isinstance(inner, type) and issubclass(inner, BaseModel) else table
    return tuple(table.model_fields)


def _words(place: tuple[int | str, ...]) -> str:
    """A place as somebody who reads the file would say it, with a colon."""
    parts = [f"number {part + 1}" if isinstance(part, int) else _plain(part) for part in place if part != "[key]"]
    return f"{', '.join(parts)}: " if parts else ""


def _plain(text: str) -> str:
    return text if text.isidentifier() and len(text) <= _LONGEST else _short(text)


def _short(value: object) -> str:
    try:
        text = ascii(value)
    except ValueError:  # a whole number with more digits than may be printed
        text = "a number of thousands of digits"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."
