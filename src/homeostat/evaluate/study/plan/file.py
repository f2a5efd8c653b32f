"""Reading a campaign's file."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from homeostat.evaluate.study.error import CampaignError
from homeostat.evaluate.study.plan.plan import Plan, ProposerPlan, ScenarioPlan
from homeostat.stl.spelling import near_matches

LONGEST = 80
"""Most characters of a value that a message shows."""
_TABLES: Final[Mapping[str, type[BaseModel]]] = {"scenarios": ScenarioPlan, "proposers": ProposerPlan}


def read_plan(path: Path) -> Plan:
    """The plan in ``path``; CampaignError with place, value and remedy in one line, OSError where it is unreadable."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:  # TOMLDecodeError, UnicodeDecodeError, a number of 5000 digits
        raise CampaignError(f"{str(path)!r} is no TOML: {error}") from None
    try:
        return Plan.model_validate(content)
    except ValidationError as error:
        found: dict[tuple[int | str, ...], list[ErrorDetails]] = {}
        for one in error.errors(include_url=False):
            found.setdefault(_place(one["loc"], content), []).append(one)
        # Where a value may be of several types, what is wrong inside one of them says more than that it is no other.
        places = [p for p in found if not any(p == other[: len(p)] for other in found if other != p)]
        more = f"; and {len(places) - 1} more" if len(places) > 1 else ""
        raise CampaignError(f"{str(path)!r}: {_words(places[0])}: {_told(found[places[0]])}{more}") from None


def _place(location: Sequence[int | str], content: Any) -> tuple[int | str, ...]:
    """Where it is in ``content``; without the types that were tried there."""
    place: list[int | str] = []
    for part in location:
        if isinstance(part, int) and isinstance(content, list) and part < len(content):
            content = content[part]
        elif isinstance(part, str) and isinstance(content, dict):
            content = content.get(part)
        else:
            continue
        place.append(part)
    return tuple(place)


def _words(place: Sequence[int | str]) -> str:
    """A place as somebody who reads the file would say it."""
    words: list[str] = []
    for part in place:
        if isinstance(part, int):
            words[-1] = f"{words[-1].removesuffix('s')} {part + 1}"
        else:
            words.append(part)
    return ", ".join(words) or "the file"


def _told(errors: Sequence[ErrorDetails]) -> str:
    """What is wrong at one place, where a value may be of several types."""
    first = errors[0]
    if first["type"] == "extra_forbidden":
        return _unknown_key(first["loc"])
    given = repr(first["input"]) if isinstance(first["input"], str | int | float) else ""
    shown = f" (given: {given if len(given) <= LONGEST else given[:LONGEST] + '...'})" if given else ""
    return ", or ".join(dict.fromkeys(e["msg"].removeprefix("Value error, ") for e in errors)) + shown


def _unknown_key(location: Sequence[int | str]) -> str:
    table = _TABLES.get(str(location[0]), Plan) if len(location) > 1 else Plan
    known = table.model_fields
    return f"there is no such key{near_matches(str(location[-1]), known)}; there are {', '.join(known)}"
