"""The server's answers: a page, what it shows as JSON, and a stream of moments (server-sent events)."""

from __future__ import annotations

import threading
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from starlette.applications import Starlette
from starlette.datastructures import MutableHeaders
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from homeostat.console.card.evidence import Evidence, readings_trend
from homeostat.console.opened import OpenedRun
from homeostat.console.people.orders import Give, Orders
from homeostat.console.people.people import People
from homeostat.console.server.admission import Admission, lasts
from homeostat.console.server.asked import (
    WIDEST_OF_ALL,
    AskedWrong,
    bad_request,
    finite,
    json_answer,
    measured,
    nobody_reads,
    number,
    span,
)
from homeostat.console.server.asking import Asking
from homeostat.console.server.desk import Desk
from homeostat.console.server.events import Events
from homeostat.console.server.lanes import Gone, Lanes
from homeostat.console.server.pace import Paces
from homeostat.console.server.stream import FASTEST, SLOWEST, Moments
from homeostat.console.view import Shown, seen, shown
from homeostat.llm.model import LanguageModel

if TYPE_CHECKING:  # it loads a library that is needed only where there is one
    from homeostat.console.sign_on.sign_on import SignOn

HOSTS: Final = ("127.0.0.1", "localhost")
"""Names under which the page may be asked for: another one is another page's, which had its name resolved to here."""
_PAGE: Final = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/console.js": ("console.js", "text/javascript; charset=utf-8"),
    "/console.css": ("console.css", "text/css; charset=utf-8"),
}
"""Everything of the page: nothing else is ever read from the disk by a name that a request gives."""
_HEADERS: Final = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; "
    "require-trusted-types-for 'script'",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
_SECURE: Final = {"Strict-Transport-Security": "max-age=31536000"}


@dataclass(frozen=True, slots=True)
class Serving:
    """Whom a page is served to."""

    people: People | None = None
    """Who may look and order; where there are none, whoever is on this machine looks, and nobody orders."""
    give: Give | None = None
    """Gives an order to the guard; None where there is nobody to order anything."""
    hosts: tuple[str, ...] = HOSTS
    """Names under which the page may be asked for."""
    secure: bool = False
    """Whether what is sent is encrypted."""
    model: LanguageModel | None = None
    """Says the card in other words; None where there is none."""
    beside: OpenedRun | None = None
    """Another run that is shown beside it; None for none."""
    sign_on: SignOn | None = None
    """A provider that knows people, too; None for none."""


def application(run: OpenedRun, serving: Serving = Serving()) -> Starlette:
    """The answers to everything that may be asked of ``run``; nothing is written but what ``serving`` lets order."""
    ending = threading.Event()
    lanes = Lanes()
    extras = serving.beside is not None, "" if serving.model is None else serving.model.name
    answers = _Answers(run, lanes, Moments(run, ending), extras)
    orders = None if serving.give is None else Orders(run, serving.give)
    desk = Desk(serving.people, orders, serving.secure, serving.sign_on)
    routes = [Route(path, _file(*content), methods=["GET"]) for path, content in _PAGE.items()]
    routes += [
        Route("/api/run", answers.run, methods=["GET"]),
        Route("/api/moment", answers.moment, methods=["GET"]),
        Route("/api/trend", answers.trend, methods=["GET"]),
        Route("/api/feature", answers.feature, methods=["GET"]),
        Route("/api/stream", answers.stream, methods=["GET"]),
        *Events(run, lanes).routes(),
        *_beside(serving.beside, lanes, ending),
        *Asking(run, lanes, serving.model).routes(),
        *Paces(run).routes(),
        *desk.routes(),
        *_gate(serving),
    ]
    guards = [
        Middleware(_Headers, serving.secure),
        Middleware(TrustedHostMiddleware, [*serving.hosts]),
        Middleware(Admission, serving.people, serving.secure),
    ]
    handlers = {AskedWrong: bad_request, Gone: nobody_reads}
    app = Starlette(routes=routes, middleware=guards, exception_handlers=handlers)
    app.state.ending = ending
    return app


def _beside(other: OpenedRun | None, lanes: Lanes, ending: threading.Event) -> list[Route]:
    """What is asked of the run beside."""
    if other is None:
        return []
    answers = _Answers(other, lanes, Moments(other, ending))
    found = {"run": answers.run, "moment": answers.moment, "trend": answers.trend}
    return [Route(f"/api/other/{name}", answer, methods=["GET"]) for name, answer in found.items()]


def _gate(serving: Serving) -> list[Route]:
    """The way to a provider and back, where there is one."""
    if serving.people is None or serving.sign_on is None:
        return []
    from homeostat.console.server.sign_on import Gate

    return Gate(serving.people, serving.sign_on, serving.secure).routes()


class _Headers:
    """Adds to every answer what a browser is to refuse."""

    def __init__(self, app: ASGIApp, secure: bool) -> None:
        self._app, self._headers = app, _HEADERS | (_SECURE if secure else {})

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(self._headers)
            await send(message)

        await self._app(scope, receive, with_headers)


def _file(name: str, kind: str) -> Callable[[Request], Awaitable[Response]]:
    content = files(__package__).joinpath("static", name).read_bytes()

    async def answer(request: Request) -> Response:
        return Response(content, media_type=kind)

    return answer


class _Answers:
    """What is asked of one run."""

    def __init__(self, run: OpenedRun, lanes: Lanes, moments: Moments, extras: tuple[bool, str] = (False, "")) -> None:
        """``extras``: whether there is a run beside, and the name of a model that says the card in other words."""
        self._run, self._lanes, self._moments, self._extras = run, lanes, moments, extras
        self._evidence: Evidence | None = None

    async def run(self, request: Request) -> Response:
        beside, model = self._extras

        def told() -> Shown:
            self._run.refresh()
            return shown(self._run)

        return json_answer(replace(await self._lanes.make(request, told), beside=beside, model=model))

    async def moment(self, request: Request) -> Response:
        at_s = number(request, "at", self._run.last_s)
        return await self._lanes.make(request, lambda: json_answer(seen(self._run, at_s)))

    async def trend(self, request: Request) -> Response:
        readings, tags = measured(request, self._run)
        from_s, to_s, width = span(request, self._run)
        asked = readings, tags, from_s, to_s, min(width, WIDEST_OF_ALL // len(tags))
        return await self._lanes.make(request, lambda: json_answer(readings_trend(*asked)))

    async def feature(self, request: Request) -> Response:
        name = request.query_params.get("name", "")
        readings = self._run.readings
        if readings is not None and (self._evidence is None or self._evidence.last_s != readings.last_s):
            self._evidence = Evidence(self._run.plant, readings)
        asked, evidence = span(request, self._run), self._evidence
        found = None if evidence is None else await self._lanes.make(request, evidence.feature, name, *asked)
        if found is None:
            raise AskedWrong(f"no feature {name[:80]!r} can be drawn for this run")
        return json_answer(found)

    async def stream(self, request: Request) -> Response:
        at_s = number(request, "at", 0.0)
        if last := request.headers.get("last-event-id"):
            at_s = finite("Last-Event-ID", last)
        speed = number(request, "speed", 1.0)
        if not SLOWEST <= speed <= FASTEST:
            raise AskedWrong(f"speed is {speed:g}; it must be from {SLOWEST:g} to {FASTEST:g}")
        return StreamingResponse(self._moments.play(at_s, speed, lasts(request)), media_type="text/event-stream")
