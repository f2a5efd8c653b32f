"""Reading a campaign's file."""

from __future__ import annotations

import tomllib
from pathlib import Path

from pydantic import ValidationError

from homeostat.campaign.study.error import CampaignError
from homeostat.campaign.study.plan import Plan


def read_plan(path: Path) -> Plan:
    """The plan in ``path``; CampaignError with place, value and remedy in one line, OSError where it is unreadable."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CampaignError(f"{str(path)!r} is no TOML: {error}") from None
    try:
        return Plan.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"]) or "the file"
        given = first["input"]
        shown = f" (given: {given!r})" if isinstance(given, str | int | float) else ""
        more = f"; and {error.error_count() - 1} more" if error.error_count() > 1 else ""
        raise CampaignError(f"{str(path)!r}: {place}: {first['msg']}{shown}{more}") from None
