"""The pace of a simulated run that goes on here: looked at, paused and chosen. A real plant has none."""

from __future__ import annotations

import logging
from typing import Final, final

from pydantic import BaseModel, ConfigDict, Field
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from homeostat.console.opened import OpenedRun
from homeostat.console.server.asked import json_answer
from homeostat.console.server.asking import only_looks
from homeostat.console.server.desk import body
from homeostat.recovery.exchange.pacing import FASTEST, SLOWEST

_ATTACHED: Final = "a plant that is attached goes on by itself; nobody can pause it, or choose its speed"
_ELSEWHERE: Final = (
    "only a simulated run that goes on with this page has a pace ('homeostat run CASE --console'); in mode approve a "
    "person decides in real time"
)
_OVER: Final = "the run is over, and has no pace any more"
_PAUSED: Final = "the run is paused at its page; it goes on from there, and Ctrl-C ends it"
_LOG: Final = logging.getLogger("homeostat.console")


class _Asked(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    paused: bool | None = None
    speed: float | None = Field(default=None, ge=SLOWEST, le=FASTEST, allow_inf_nan=False)


@final
class Paces:
    """The pace of one run."""

    def __init__(self, run: OpenedRun) -> None:
        """``run`` may have none."""
        self._run = run

    def routes(self) -> list[Route]:
        """What is answered here."""
        return [Route("/api/pace", self.look, methods=["GET"]), Route("/api/pace", self.change, methods=["POST"])]

    async def look(self, request: Request) -> Response:
        """The pace now, null where there is none: a page that looks at an earlier moment follows no stream."""
        return json_answer(self._run.pace)

    async def change(self, request: Request) -> Response:
        """Pause the run, let it go on, or choose its speed."""
        if (refused := only_looks(request)) is not None:
            return refused
        asked, pacing = await body(request, _Asked), self._run.pacing
        pace = None if pacing is None else pacing.now
        if pacing is None or pace is None:
            none = _ELSEWHERE if pacing is None else _OVER
            return json_answer({"error": _ATTACHED if self._run.attached else none}, 409)
        if asked.speed is not None:
            pacing.choose(asked.speed)
        if asked.paused is not None and asked.paused != pace.paused:
            _LOG.warning(_PAUSED if asked.paused else "the run goes on")
            pacing.pause() if asked.paused else pacing.go_on()
        return json_answer(pacing.now)
