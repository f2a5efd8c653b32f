"""Answers to what a person asks: what if, of a twin; and what is said, of a language model. Nothing is ever written."""

from __future__ import annotations

from typing import final

from pydantic import BaseModel, ConfigDict, Field
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from homeostat.console.card.retold import NotRetold, Reteller
from homeostat.console.opened import OpenedRun
from homeostat.console.people.accounts import Access
from homeostat.console.server.admission import session_of
from homeostat.console.server.asked import json_answer, number
from homeostat.console.server.desk import body
from homeostat.console.server.lanes import Lanes
from homeostat.console.trial.trials import Busy, NotTried, Trials
from homeostat.console.view import seen
from homeostat.llm.model import LanguageModel


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    at_s: float = Field(ge=0.0, allow_inf_nan=False, strict=False)
    state: str = Field(min_length=1, max_length=200)
    values: dict[str, float | None] = Field(max_length=100)


class _Retelling(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    at_s: float = Field(ge=0.0, allow_inf_nan=False, strict=False)
    language: str = Field(pattern=r"^[A-Za-z]{2,8}(-[A-Za-z0-9]{2,8})*$", max_length=40)


@final
class Asking:
    """What is asked about one run."""

    def __init__(self, run: OpenedRun, lanes: Lanes, model: LanguageModel | None) -> None:
        """``run`` is what is asked about, in ``lanes``; ``model`` puts its card in other words, where there is one."""
        self._run, self._lanes, self._trials = run, lanes, Trials(run)
        self._reteller = None if model is None else Reteller(model)

    def routes(self) -> list[Route]:
        """What is answered here."""
        return [
            Route("/api/options", self.options, methods=["GET"]),
            Route("/api/trial", self.trial, methods=["POST"]),
            *([] if self._reteller is None else [Route("/api/retold", self.retold, methods=["POST"])]),
        ]

    async def options(self, request: Request) -> Response:
        """What may be asked at one moment."""
        return json_answer(await self._lanes.make(request, self._trials.options, number(request, "at", 0.0)))

    async def trial(self, request: Request) -> Response:
        """What the twin says."""
        if (refused := only_looks(request)) is not None:
            return refused
        asked = await body(request, _Asked)
        try:
            found = await run_in_threadpool(self._trials.ask, asked.at_s, asked.state, asked.values)
        except NotTried as error:
            return json_answer({"error": str(error)}, 429 if isinstance(error, Busy) else 400)
        return Response(found, media_type="application/json")

    async def retold(self, request: Request) -> Response:
        """The card in a model's words."""
        assert self._reteller is not None
        if (refused := only_looks(request)) is not None:
            return refused
        asked = await body(request, _Retelling)
        told = (await self._lanes.make(request, seen, self._run, asked.at_s)).told
        try:
            return json_answer(await self._reteller.retell(told, asked.language, asked.at_s))
        except NotRetold as error:
            return json_answer({"error": str(error)}, 502)


def only_looks(request: Request) -> Response | None:
    """The answer to a viewer, who only looks; None for everybody else."""
    session = session_of(request)
    if session is None or session.person.access is not Access.VIEWER:
        return None
    return json_answer({"error": f"{session.person.name!r} is a viewer and asks nothing"}, 403)
