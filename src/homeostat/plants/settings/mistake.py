"""One mistake of ``case.toml`` in words: where it is, what stands there, what is expected and how that is written."""

from typing import Any, Final

from pydantic import BaseModel
from pydantic_core import ErrorDetails

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
_KINDS: Final = {
    "list_type": "a list in square brackets",
    "dict_type": "a table of names with their values",
    "model_type": "a table",
    "string_type": "a text in quotation marks",
    "float_type": "a number",
    "int_type": "a whole number",
    "bool_type": "true or false",
}
"""Type of pydantic's error -> what is expected, in the words of TOML."""
_LIKE: Final = {
    "errors": "{name} = [0.2, 0.5], the noise of the instrument and the error of the model, both in the tag's unit",
    "window": "window = [0.0, 100.0], the lower and the upper end of the axis",
    "figure": "[[figure]] in double brackets, one for each panel",
    "initial": "initial = { B1_V = 0.2 }, what smoothing may get wrong of each state",
    "balances": "[twin.balances.{name}] with a table of its own",
    "start": "'{name}.sp' = 0.2; a tag with a dot stands in quotation marks",
}
"""Key, or table of names -> how it is written, with {name} for the name."""


def told(error: ErrorDetails) -> str:
    """The mistake, from its keys on."""
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
            like = f", as in {written}" if (written := _like(error)) else ""
            return f"{_words(place)}at least {least} items are needed, and there are {given}{like}; add what is meant"
        case "value_error":
            return f"{_words(place)}{error['msg'].removeprefix('Value error, ')}"
    return f"{_words(place)}{_expected(error)} (given: {_short(error['input'])})"


def _expected(error: ErrorDetails) -> str:
    """What is wrong with a value, with what it must be and how that is written."""
    if error["type"] == "too_long":
        most, given = error["ctx"]["max_length"], error["ctx"]["actual_length"]
        said = f"at most {most} items may stand there, and there are {given}"
    elif error["type"] in _KINDS:
        said = f"it must be {_KINDS[error['type']]}"
    else:
        return error["msg"]
    like = _like(error)
    return f"{said}, as in {like}" if like else said


def _like(error: ErrorDetails) -> str:
    """How the value may have been meant; empty where that cannot be guessed."""
    place, value = error["loc"], error["input"]
    for key in reversed(place[-2:]):
        if key in _LIKE:
            return _LIKE[str(key)].replace("{name}", "TAG" if key == place[-1] else _plain(str(place[-1])))
    name = str(place[-1])
    match error["type"], value:
        case "list_type", str():
            return f"{name} = [{_quoted(value)}]"
        case "list_type", bool() | int() | float():
            return f"{name} = [{_short(value)}]"
        case "string_type", int() | float():
            return f"{name} = {_quoted(_short(value))}"
        case (("float_type" | "int_type"), str()) if value.replace(".", "", 1).isdecimal():
            return f"{name} = {_short(value)[1:-1]}, without quotation marks"
    return ""


def _quoted(text: str) -> str:
    return f'"{_short(text)[1:-1]}"' if text.isprintable() else _short(text)


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
