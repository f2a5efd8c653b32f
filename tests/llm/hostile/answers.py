"""Misbehaving in the answer: it arrives, but must not be believed."""

from __future__ import annotations

import json
from http.server import BaseHTTPRequestHandler

from tests.llm.hostile.filler import below, beyond, filled, least, numbers_as, twice
from tests.llm.hostile.wire import Request, behaviour, say, schema_of


@behaviour
def nan(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """NaN for every number."""
    say(handler, numbers_as(schema_of(request), "NaN"))


@behaviour
def infinity(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Infinity for every number."""
    say(handler, numbers_as(schema_of(request), "-Infinity"))


@behaviour
def extreme(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """1e308 for every number."""
    say(handler, numbers_as(schema_of(request), "1e308"))


@behaviour
def overflow(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """A number that is infinite once it is read."""
    say(handler, numbers_as(schema_of(request), "-1e999"))


@behaviour
def many_digits(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Integers of 5,000 digits."""
    say(handler, numbers_as(schema_of(request), "9" * 5_000))


@behaviour
def out_of_range(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Just beyond every upper bound."""
    say(handler, beyond(schema_of(request)))


@behaviour
def below_range(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Just below every lower bound."""
    say(handler, below(schema_of(request)))


@behaviour
def upper_edge(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Every bound to the full: admissible, and as much as there is."""
    say(handler, json.dumps(filled(schema_of(request), lambda number: number.get("maximum", 0))))


@behaviour
def wrong_types(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Text where numbers belong."""
    say(handler, numbers_as(schema_of(request), '"310 K"'))


@behaviour
def extra_fields(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """More than was asked for."""
    say(handler, json.dumps({**least(schema_of(request)), "override_limits": True, "XV1.cmd": 0}))


@behaviour
def contradictory(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Everything twice, differently."""
    say(handler, twice(schema_of(request)))


@behaviour
def echo(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """The whole prompt back."""
    say(handler, "\n".join(str(m.get("content")) for m in request["messages"]))


@behaviour
def key_echo(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """The key back, in answer and name."""
    key = str(handler.headers.get("Authorization")).removeprefix("Bearer ")
    say(handler, json.dumps({"reasoning": key}), model=key)
