"""What requests ask for, read strictly; and how they are answered."""

from __future__ import annotations

import math
from typing import Final

from starlette.requests import Request
from starlette.responses import Response

from homeostat.console.opened import OpenedRun
from homeostat.console.text import to_json

_WIDEST: Final = 4000
"""Most pixels that a trend is drawn on."""


class AskedWrong(ValueError):
    """A request asks for what there is not, or sends what cannot be taken; the message says so in one line."""


async def bad_request(request: Request, error: Exception) -> Response:
    """The answer to what cannot be answered."""
    return json_answer({"error": str(error)}, 400)


def json_answer(value: object, status: int = 200) -> Response:
    """``value`` as JSON."""
    return Response(to_json(value), status, media_type="application/json")


def csv_answer(content: str, name: str) -> Response:
    """``content`` as a file called ``name``."""
    answer = Response(content, media_type="text/csv; charset=utf-8")
    answer.headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return answer


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
