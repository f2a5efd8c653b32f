"""Where people sign in and order: the answers to what is not only looked at."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING, Final, TypeVar, final

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import Route

from homeostat.console.people.accounts import Account, Person
from homeostat.console.people.orders import PROVEN, NotGiven, Objection, Ordered, Orders
from homeostat.console.people.people import People, Unproven
from homeostat.console.people.sessions import Session
from homeostat.console.server.admission import cookie, kept_by, session_of
from homeostat.console.server.asked import AskedWrong, json_answer

if TYPE_CHECKING:  # it loads a library that is needed only where there is one
    from homeostat.console.sign_on.sign_on import SignOn

M = TypeVar("M", bound=BaseModel)
LARGEST: Final = 10_000
"""Most bytes of what is sent."""
SENT_WITHIN_S: Final = 10.0
"""Longest time in which all of it has to come, wall-clock [s]."""
_STATUS: Final = {"role": 403, "changed": 409, "busy": 409}


class _SigningIn(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    name: str = Field(min_length=1, max_length=200)
    password: str = Field(min_length=1, max_length=500)
    code: str = Field(default="", max_length=40)


@final
class Desk:
    """One console's desk."""

    def __init__(
        self, people: People | None, orders: Orders | None, secure: bool, sign_on: SignOn | None = None
    ) -> None:
        """``secure``: whether what is sent is encrypted. Nobody orders where there are no people or no ``orders``.

        ``sign_on`` knows people, too, where there is one.
        """
        self._people, self._orders, self._secure, self._sign_on = people, orders, secure, sign_on
        self._entering = asyncio.Lock()  # the other check of a password at once is of who is signed in

    def routes(self) -> list[Route]:
        """What is answered here."""
        found = [Route("/api/me", self.me, methods=["GET"])]
        if self._people is not None:
            found += [
                Route("/api/session", self.sign_in, methods=["POST"]),
                Route("/api/session", self.sign_out, methods=["DELETE"]),
            ]
        if self._people is not None and self._orders is not None:
            found.append(Route("/api/order", self.order, methods=["POST"]))
        return found

    async def me(self, request: Request) -> Response:
        """Who is at the page, and what the page must show when it orders."""
        return json_answer(self._told(session_of(request)))

    async def sign_in(self, request: Request) -> Response:
        """Begin a session."""
        assert self._people is not None
        given = await body(request, _SigningIn)
        try:
            proof = given.name, given.password, _address(request), given.code
            async with self._entering:
                token, session = await run_in_threadpool(self._people.sign_in, *proof)
        except Unproven as unproven:
            return _unproven(unproven)
        answer = json_answer(self._told(session))
        kept_by(answer, request, token, self._secure)
        return answer

    async def sign_out(self, request: Request) -> Response:
        """End the session."""
        assert self._people is not None
        name = cookie(request, self._secure)
        self._people.sign_out(request.cookies.get(name))
        answer = json_answer(self._told(None))
        answer.delete_cookie(name, path="/", secure=self._secure, httponly=True, samesite="strict")
        return answer

    async def order(self, request: Request) -> Response:
        """Pass an order on, once it is known whose it is."""
        session, people, orders = session_of(request), self._people, self._orders
        assert session is not None and people is not None and orders is not None
        ordered = await body(request, Ordered)
        try:
            person = session.person
            await run_in_threadpool(orders.check, ordered, person)
            if ordered.verb in PROVEN and not isinstance(person, Account) and self._sign_on is not None:
                person = self._sign_on.confirm(session, ordered)
            elif ordered.verb in PROVEN:
                person = await run_in_threadpool(people.confirm, session, ordered.password, _address(request))
            return json_answer(await run_in_threadpool(orders.give, ordered, person))
        except Unproven as unproven:
            return _unproven(unproven)
        except Objection as objection:
            return await run_in_threadpool(_objected, orders, ordered, session.person, objection)
        except NotGiven as lost:
            return json_answer({"error": str(lost), "unknown": True}, 502)

    def _told(self, session: Session | None) -> dict[str, object]:
        person = None if session is None else session.person
        return {
            "people": self._people is not None,
            "codes": self._people is not None and self._people.have_codes,
            "orders": self._orders is not None,
            "name": None if person is None else person.name,
            "access": None if person is None else person.access.value,
            "sign_on": None if self._sign_on is None else self._sign_on.settings.title,
            "by_sign_on": person is not None and not isinstance(person, Account),
            "token": None if session is None else session.csrf,
        }


def _objected(orders: Orders, ordered: Ordered, person: Person, objection: Objection) -> Response:
    """The answer to an order that is not passed on, which may be because it was carried out, and that answer lost."""
    try:
        earlier = orders.earlier(ordered, person)
    except Objection as another:
        objection, earlier = another, None
    if earlier is not None:
        return json_answer(earlier)
    return json_answer({"error": str(objection)}, _STATUS[objection.fault])


def _unproven(unproven: Unproven) -> Response:
    answer = json_answer({"error": str(unproven)}, 429 if unproven.wait_s > 0.0 else 403)
    if unproven.wait_s > 0.0:
        answer.headers["Retry-After"] = str(math.ceil(unproven.wait_s))
    return answer


async def body(request: Request, kind: type[M]) -> M:
    """What was sent, as ``kind``; AskedWrong where it is none, or too long."""
    content = b""
    try:
        async with asyncio.timeout(SENT_WITHIN_S):
            async for part in request.stream():
                content += part
                if len(content) > LARGEST:
                    raise AskedWrong(f"more than {LARGEST} byte were sent")
    except TimeoutError:
        raise AskedWrong(f"what was sent was not whole within {SENT_WITHIN_S:g} s") from None
    except ClientDisconnect:  # nobody is there any more who would read the answer
        raise AskedWrong("what was sent has ended too early") from None
    try:
        return kind.model_validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise AskedWrong(f"{place}: {first['msg']}" if place else str(first["msg"])) from None


def _address(request: Request) -> str:
    return "" if request.client is None else request.client.host
