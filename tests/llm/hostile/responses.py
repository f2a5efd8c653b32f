"""Misbehaving in the response object: nothing in it, half of it, or none of it."""

from __future__ import annotations

import json
from http.server import BaseHTTPRequestHandler

from tests.llm.hostile.filler import least
from tests.llm.hostile.wire import Request, behaviour, completion, say, schema_of, send


@behaviour
def empty(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """200 and nothing."""
    send(handler, 200, b"")


@behaviour
def empty_content(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """An empty answer."""
    say(handler, "")


@behaviour
def null_content(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """No answer where one should be."""
    say(handler, None)


@behaviour
def no_choices(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """A response without any answer."""
    send(handler, 200, json.dumps({**completion(""), "choices": []}).encode())


@behaviour
def truncated(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Half an answer."""
    text = json.dumps(least(schema_of(request)))
    say(handler, text[: len(text) // 2], reason="length")


@behaviour
def refusal(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """The model will not."""
    say(handler, None, refusal="I cannot help with that.")


@behaviour
def content_filter(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """The provider will not."""
    say(handler, "", reason="content_filter")


@behaviour
def not_json(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """A page for people."""
    send(handler, 200, b"<html><body>Welcome</body></html>", Content_Type="text/html")


@behaviour
def malformed(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """An answer that is almost JSON."""
    say(handler, json.dumps(least(schema_of(request))).replace(":", "=", 1))
