"""The way to a provider and back: addresses that a browser goes to, and what it is told there."""

from __future__ import annotations

import asyncio
import html
from collections.abc import Callable
from typing import Final, TypeVar, final

from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.routing import Route

from homeostat.console.people.accounts import Person
from homeostat.console.people.orders import PROVEN, Ordered
from homeostat.console.people.people import People
from homeostat.console.server.admission import cookie, kept_by, session_of
from homeostat.console.server.asked import AskedWrong, json_answer
from homeostat.console.sign_on.sign_on import About, NotSignedOn, SignOn, about

_COOKIE: Final = "homeostat-sign-on"
_LONGEST: Final = 4000
AT_ONCE: Final = 4
"""Most answers of the provider that are waited for at once: nobody has signed in yet, and orders need threads, too."""
T = TypeVar("T")
_ENDED: Final = "It is not known who you are: it was not completed, or took too long. Go back, and try again."
_TEXTS: Final = {
    "ended": _ENDED,
    "provider": "The provider's answer cannot be used; the reason is where the console was started.",
    "role": "You have none of the groups that may use this console.",
    "name": "Your name cannot be used here; the reason is where the console was started.",
    "other": "Somebody else is signed in at the console.",
    "shown": "It is known that it is you. Close this window, and go on in the console's.",
}
_PAGE: Final = (
    '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>Homeostat console</title><meta name="viewport" '
    'content="width=device-width, initial-scale=1"><link rel="icon" href="data:,"><link rel="stylesheet" '
    'href="/console.css"></head><body><main class="single"><h1>Homeostat console</h1><p class="big">{}</p></main>'
    "</body></html>"
)


@final
class Gate:
    """Where people go to the provider from, and come back."""

    def __init__(self, people: People, sign_on: SignOn, secure: bool) -> None:
        """``secure``: whether what is sent is encrypted."""
        self._people, self._sign_on, self._secure = people, sign_on, secure
        self._waiting = asyncio.Semaphore(AT_ONCE)

    def routes(self) -> list[Route]:
        """What is answered here."""
        answers = {"/oidc/sign-in": self.sign_in, "/oidc/prove": self.prove, "/oidc/callback": self.back,
                   "/api/proof": self.proof}  # fmt: skip
        return [Route(path, answer, methods=["GET"]) for path, answer in answers.items()]

    async def sign_in(self, request: Request) -> Response:
        """To the provider, to sign in."""
        return await self._sent(request, About())

    async def prove(self, request: Request) -> Response:
        """To the provider, to show who somebody is for one order of theirs."""
        asked = self._about(request)
        return _page("ended", 401) if asked is None else await self._sent(request, asked)

    async def proof(self, request: Request) -> Response:
        """Whether somebody has shown who they are for an order of theirs."""
        asked = self._about(request)
        return json_answer({"proven": asked is not None and self._sign_on.shown(asked) is not None})

    async def back(self, request: Request) -> Response:
        """Back from the provider."""
        asked, where, cookie_name = request.query_params, _address(request), cookie(request, self._secure, _COOKIE)
        state, code = (asked.get(name, "")[:_LONGEST] for name in ("state", "code"))
        try:
            kept = request.cookies.get(cookie_name, "")
            person, shown_for = await self._heard(self._sign_on.end, kept, state, code, asked.get("iss"))
            if shown_for.id:
                answer = self._shown(person, shown_for)
            else:
                answer = RedirectResponse("/", 303)
                token = self._people.begin(person, f"by {self._sign_on.settings.title} from {where}")[0]
                kept_by(answer, request, token, self._secure)
        except NotSignedOn as refused:
            self._people.log(f"nobody has come in by {self._sign_on.settings.title} from {where}: {refused}")
            answer = _page(refused.word, 403)
        answer.delete_cookie(cookie_name, path="/", secure=self._secure, httponly=True, samesite="lax")
        return answer

    async def _heard(self, ask: Callable[..., T], *about: object) -> T:
        """What the provider says when ``ask`` is called with ``about``, in a thread once there is one for it."""
        async with self._waiting:
            return await run_in_threadpool(ask, *about)

    def _shown(self, person: Person, shown_for: About) -> Response:
        session = self._people.showing(shown_for.session)
        if session is None:
            raise NotSignedOn("ended", "the session is over")
        self._sign_on.show(session, person, shown_for)
        return _page("shown", 200)

    async def _sent(self, request: Request, asked: About) -> Response:
        try:
            address, kept = await self._heard(self._sign_on.begin, asked)
        except NotSignedOn as refused:
            self._people.log(f"nobody can be sent to {self._sign_on.settings.title}: {refused}")
            return _page(refused.word, 502)
        answer = RedirectResponse(address, 303)
        name = cookie(request, self._secure, _COOKIE)
        answer.set_cookie(name, kept, path="/", secure=self._secure, httponly=True, samesite="lax")
        return answer

    def _about(self, request: Request) -> About | None:
        """The order that is asked about; None without a session, AskedWrong where it is no order."""
        session, asked = session_of(request), request.query_params
        if session is None:
            return None
        try:
            ordered = Ordered.model_validate({n: asked.get(n, "") for n in ("id", "verb", "subject", "digest")})
        except ValidationError as error:
            raise AskedWrong("no such order") from error
        if ordered.verb not in PROVEN:
            raise AskedWrong(f"{ordered.verb.value!r} is ordered without it")
        return about(session, ordered)


def _page(word: str, status: int) -> Response:
    return HTMLResponse(_PAGE.format(html.escape(_TEXTS[word])), status)


def _address(request: Request) -> str:
    return "" if request.client is None else request.client.host
