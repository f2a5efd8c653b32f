"""Misbehaving around the answer: other addresses, other models, impossible counts, tricks with characters."""

from __future__ import annotations

import json
from http.server import BaseHTTPRequestHandler

from tests.llm.hostile.filler import filled, least
from tests.llm.hostile.wire import Request, behaviour, completion, say, schema_of, send


@behaviour
def redirect(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Sends the question somewhere else."""
    send(handler, 307, b"", Location="http://example.invalid/v1/chat/completions")


@behaviour
def redirect_loop(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Sends the question round in circles."""
    send(handler, 307, b"", Location=handler.path)


@behaviour
def wrong_model(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Answers, but is somebody else."""
    say(handler, json.dumps(least(schema_of(request))), model="a-cheaper-one")


@behaviour
def absurd_usage(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Claims to have read a negative number of tokens."""
    response = completion(json.dumps(least(schema_of(request))))
    response["usage"] = {"prompt_tokens": -5, "completion_tokens": 10**30, "total_tokens": 0}
    send(handler, 200, json.dumps(response).encode())


@behaviour
def unicode_tricks(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Half characters, turned text, characters without width."""
    answer = filled(schema_of(request), lambda number: number.get("minimum", 0))
    answer["reasoning"] = "\ud800\u202e\u200b\x00\x1b[2J\U000e0041" * 10
    say(handler, json.dumps(answer))


@behaviour
def header_bomb(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Headers of 10 MB."""
    handler.send_response(200)
    for number in range(1000):
        handler.send_header(f"X-Bomb-{number}", "x" * 10_000)
    handler.send_header("Content-Length", "0")
    handler.end_headers()
