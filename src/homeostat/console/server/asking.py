"""Answers to what if: rolled out on a twin, never written."""

from __future__ import annotations

from typing import final

from pydantic import BaseModel, ConfigDict, Field
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from homeostat.console.people.accounts import Access
from homeostat.console.server.admission import session_of
from homeostat.console.server.asked import json_answer, number
from homeostat.console.server.desk import body
from homeostat.console.trial.trials import Busy, NotTried, Trials


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    at_s: float = Field(ge=0.0, allow_inf_nan=False, strict=False)
    state: str = Field(min_length=1, max_length=200)
    values: dict[str, float | None] = Field(max_length=100)


@final
class Asking:
    """What is asked of the twin of one run."""

    def __init__(self, trials: Trials) -> None:
        """``trials`` answer."""
        self._trials = trials

    def routes(self) -> list[Route]:
        """What is answered here."""
        return [
            Route("/api/options", self.options, methods=["GET"]),
            Route("/api/trial", self.trial, methods=["POST"]),
        ]

    async def options(self, request: Request) -> Response:
        """What may be asked at one moment."""
        return json_answer(await run_in_threadpool(self._trials.options, number(request, "at", 0.0)))

    async def trial(self, request: Request) -> Response:
        """What the twin says."""
        session = session_of(request)
        if session is not None and session.account.access is Access.VIEWER:
            return json_answer({"error": f"{session.account.name!r} is a viewer and asks the twin nothing"}, 403)
        asked = await body(request, _Asked)
        try:
            found = await run_in_threadpool(self._trials.ask, asked.at_s, asked.state, asked.values)
        except NotTried as error:
            return json_answer({"error": str(error)}, 429 if isinstance(error, Busy) else 400)
        return Response(found, media_type="application/json")
