"""Reading a campaign's file."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from homeostat.campaign.study.error import CampaignError
from homeostat.campaign.study.plan import Plan, ProposerPlan, ScenarioPlan
from homeostat.domain.tag import near_matches

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
        wrong = [(_place(e["loc"], content), e) for e in error.errors(include_url=False)]
        places = [(place, [e for _, e in found]) for place, found in groupby(wrong, key=lambda pair: pair[0])]
        place, first = places[0]
        more = f"; and {len(places) - 1} more" if len(places) > 1 else ""
        raise CampaignError(f"{str(path)!r}: {place}: {_told(first)}{more}") from None


def _place(location: Sequence[int | str], content: Any) -> str:
    """Where it is, as somebody who reads the file would say; without the types that were tried there."""
    words: list[str] = []
    for part in location:
        if isinstance(part, int) and isinstance(content, list) and part < len(content):
            words[-1:] = [f"{words[-1].removesuffix('s')} {part + 1}" if words else str(part + 1)]
            content = content[part]
        elif isinstance(part, str) and isinstance(content, dict):
            words.append(part)
            content = content.get(part)
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
