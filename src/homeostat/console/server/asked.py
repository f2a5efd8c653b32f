"""What requests ask for, read strictly; and how they are answered."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from typing import Final

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from homeostat.console.opened import OpenedRun
from homeostat.console.readings import Readings
from homeostat.console.text import to_json

_WIDEST: Final = 4000
"""Most pixels that a trend is drawn on."""
WIDEST_OF_ALL: Final = 20_000
"""Most pixels of all its tags together."""
MOST_TAGS: Final = 20
"""Most tags that are asked for at once."""


class AskedWrong(ValueError):
    """A request asks for what there is not, or sends what cannot be taken; the message says so in one line."""


async def bad_request(request: Request, error: Exception) -> Response:
    """The answer to what cannot be answered."""
    return json_answer({"error": str(error)}, 400)


def json_answer(value: object, status: int = 200) -> Response:
    """``value`` as JSON."""
    return Response(to_json(value), status, media_type="application/json")


def csv_answer(content: str | AsyncIterator[str], name: str) -> Response:
    """``content``, or its pieces as they are made, as a file called ``name``."""
    kind = "text/csv; charset=utf-8"
    if isinstance(content, str):  # half a character, which UTF-8 has none for, is written as its escape
        answer = Response(content.encode(errors="backslashreplace"), media_type=kind)
    else:
        answer = StreamingResponse(content, media_type=kind)
    answer.headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return answer


async def nobody_reads(request: Request, error: Exception) -> Response:
    """The answer to who has gone."""
    return Response(status_code=503)


def measured(request: Request, run: OpenedRun) -> tuple[Readings, tuple[str, ...]]:
    """The readings of ``run``, and the tags that are asked for; AskedWrong where there are none of such."""
    readings, tags = run.readings, tuple(request.query_params.getlist("tag"))
    if readings is None:
        raise AskedWrong("the run has no readings; they are kept when a run ends")
    if not tags:
        raise AskedWrong("no tag is named; give tag=NAME")
    if len(tags) > MOST_TAGS:
        raise AskedWrong(f"{len(tags)} tags are named; ask for {MOST_TAGS} at most")
    if unknown := [tag for tag in tags if tag not in readings.signals]:
        raise AskedWrong(f"no tag {unknown[0][:80]!r} was measured in this run")
    if len(set(tags)) < len(tags):
        raise AskedWrong("a tag is named twice")
    return readings, tags


def span(request: Request, run: OpenedRun) -> tuple[float, float, int]:
    """From when to when [s], and on how many pixels."""
    from_s, to_s = number(request, "from", 0.0), number(request, "to", run.last_s)
    width = number(request, "width", 800.0)
    if not 1.0 <= width <= _WIDEST:
        raise AskedWrong(f"width is {width:g} px; it must be from 1 to {_WIDEST} px")
    return from_s, to_s, int(width)


def number(request: Request, name: str, default: float) -> float:
    """The number that is asked for as ``name``; ``default`` where none is."""
    text = request.query_params.get(name)
    return default if text is None else finite(name, text)


def finite(name: str, text: str) -> float:
    """The number in ``text``; AskedWrong, with ``name``, where it is none."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise AskedWrong(f"{name} is {text[:40]!r}; it must be a finite number")
    return value
