"""Who is let in: everything but the page itself needs a session, and whatever changes something comes from the page."""

from __future__ import annotations

import hmac
from collections.abc import Callable
from typing import Final

from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from homeostat.console.people.people import People
from homeostat.console.people.sessions import Session
from homeostat.console.server.door import Door
from homeostat.console.text import to_json

_COOKIE: Final = "homeostat"
TOKEN: Final = "x-homeostat-token"
"""Header in which a page shows that it is the page."""
_OPEN: Final = frozenset({"/api/me", "/api/session"})
"""What is answered without a session."""
_DIGITS: Final = 5


def cookie(request: Request, secure: bool, name: str = _COOKIE) -> str:
    """Name of the cookie that is ``name`` to the console; with TLS a browser is told to keep it to this host.

    Browsers send cookies to every port of a host, so that two consoles on one would end each other's sessions. The
    port in the name is the one that the browser knows, which a tunnel may have changed.
    """
    port = request.headers.get("host", "").rpartition(":")[2]
    named = f"{name}-{port}" if port.isascii() and port.isdigit() and len(port) <= _DIGITS else name
    return f"__Host-{named}" if secure else named


def kept_by(response: Response, request: Request, token: str, secure: bool) -> None:
    """Have the browser keep ``token``, out of reach of any script and of other sites, until it is closed."""
    response.set_cookie(cookie(request, secure), token, path="/", secure=secure, httponly=True, samesite="strict")


def session_of(request: Request) -> Session | None:
    """The session of ``request``, as it was let in."""
    found: Session | None = request.scope.get("homeostat.session")
    return found


def lasts(request: Request) -> Callable[[], bool]:
    """Says whether who has sent ``request`` would still be let in; what is sent for hours asks again and again."""
    found: Callable[[], bool] = request.scope["homeostat.lasts"]
    return found


class Admission:
    """Lets in whom ``people`` know; where there are none, everybody looks and nobody orders."""

    def __init__(self, app: ASGIApp, people: People | None, secure: bool) -> None:
        self._app, self._people, self._secure = app, people, secure

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request in, or answer it here."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request = Request(scope)
        people = self._people
        token = request.cookies.get(cookie(request, self._secure))
        session = None if people is None else people.session(token)
        refused = _foreign(request) if people is None else self._objection(request, session)
        if refused is not None:
            text, status = refused
            await Response(to_json({"error": text}), status, media_type="application/json")(scope, receive, send)
            return
        scope["homeostat.session"] = session
        scope["homeostat.lasts"] = lambda: people is None or people.session(token, use=False) is not None
        door: Door | None = getattr(scope["app"].state, "door", None)
        if door is not None and request.client is not None and (people is None or session is not None):
            door.know((request.client.host, request.client.port), "" if session is None else session.person.name)
        await self._app(scope, receive, send)

    def _objection(self, request: Request, session: Session | None) -> tuple[str, int] | None:
        path = request.url.path
        if path.startswith("/api/") and path not in _OPEN and session is None:
            return "sign in first", 401
        if request.method in ("GET", "HEAD"):
            return None
        foreign = _foreign(request)
        if foreign is not None:
            return foreign
        given = request.headers.get(TOKEN, "")
        signing_in = path == "/api/session" and request.method == "POST"
        if not signing_in and (session is None or not hmac.compare_digest(given.encode(), session.csrf.encode())):
            return "this does not come from the page that was signed in; load it again", 403
        return None


def _foreign(request: Request) -> tuple[str, int] | None:
    """Why what would do something is not taken, whoever asks: it does not come from the page."""
    if request.method in ("GET", "HEAD"):
        return None
    if request.headers.get("origin") != f"{request.url.scheme}://{request.headers.get('host', '')}":
        return "this comes from another page, and is not taken", 403
    if request.headers.get("content-type", "").partition(";")[0] != "application/json":
        return "only JSON is taken", 415
    return None
