"""Misbehaving by status: what a server answers instead of an answer, and the one that behaves."""

from __future__ import annotations

import json
from http.server import BaseHTTPRequestHandler

from tests.llm.hostile.filler import least
from tests.llm.hostile.wire import Request, behaviour, fail, say, schema_of


@behaviour
def valid(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Answers: the least that satisfies the schema."""
    say(handler, json.dumps(least(schema_of(request))))


@behaviour
def unauthorised(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """401, and repeats the key."""
    fail(handler, 401, f"Incorrect API key provided: {handler.headers.get('Authorization')}")


@behaviour
def forbidden(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """403."""
    fail(handler, 403, "not for you")


@behaviour
def rate_limited(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """429, come back in an hour."""
    fail(handler, 429, "slow down", Retry_After="3600")


_limited = [0]


@behaviour
def rate_limited_twice(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """429 twice, then an answer."""
    _limited[0] += 1
    if _limited[0] % 3:
        fail(handler, 429, "slow down", Retry_After="0")
    else:
        valid(handler, request)


@behaviour
def server_error(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """500."""
    fail(handler, 500, "oops")


@behaviour
def unavailable(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """503."""
    fail(handler, 503, "overloaded")


@behaviour
def no_schema(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """400 for every way of asking for JSON but the prompt, and an answer then."""
    if "response_format" in request or "tools" in request:
        fail(handler, 400, "structured output is not supported")
    else:
        say(handler, "I would rather chat.")
