"""Ways to misbehave, by the name of the model that is asked for."""

from __future__ import annotations

import gzip
import json
import socket
import struct
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler
from typing import Any

from tests.llm.hostile.filler import beyond, filled, least, numbers_as, twice

Request = dict[str, Any]
Behaviour = Callable[[BaseHTTPRequestHandler, Request], None]
BEHAVIOURS: dict[str, Behaviour] = {}
"""Name of the model -> what its server does."""
LONG_S = 3600.0


def behaviour(function: Behaviour) -> Behaviour:
    BEHAVIOURS[function.__name__] = function
    return function


def schema_of(request: Request) -> dict[str, Any]:
    """The schema that was asked for, however it was."""
    found: dict[str, Any] = next((t["function"]["parameters"] for t in request.get("tools", [])), {})
    return found or (request.get("response_format") or {}).get("json_schema", {}).get("schema", {})


def send(handler: BaseHTTPRequestHandler, status: int, data: bytes, **headers: str) -> None:
    handler.send_response(status)
    for name, value in {"Content-Type": "application/json", "Content-Length": str(len(data))}.items():
        handler.send_header(name, headers.pop(name.replace("-", "_"), value))
    for name, value in headers.items():
        handler.send_header(name.replace("_", "-"), value)
    handler.end_headers()
    handler.wfile.write(data)


def completion(content: str | None, reason: str = "stop", model: str = "hostile", **more: Any) -> dict[str, Any]:
    """A response object."""
    message = {"role": "assistant", "content": content, **more}
    return {
        "id": "chatcmpl-1", "object": "chat.completion", "created": 1, "model": model,
        "choices": [{"index": 0, "finish_reason": reason, "message": message}],
        "usage": {"prompt_tokens": 10, "completion_tokens": 10, "total_tokens": 20},
    }  # fmt: skip


def say(handler: BaseHTTPRequestHandler, content: str | None, **more: Any) -> None:
    send(handler, 200, json.dumps(completion(content, **more)).encode())


def fail(handler: BaseHTTPRequestHandler, status: int, message: str, **headers: str) -> None:
    send(handler, status, json.dumps({"error": {"message": message}}).encode(), **headers)


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


@behaviour
def hang(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Never answers."""
    time.sleep(LONG_S)


@behaviour
def slow_drip(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """One blank every fifth of a second, for ever."""
    _start_endless(handler)
    while True:
        handler.wfile.write(b"1\r\n \r\n")
        time.sleep(0.2)


@behaviour
def endless(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """A body that never ends, as fast as it is read."""
    _start_endless(handler)
    while True:
        handler.wfile.write(b"1000\r\n" + b" " * 4096 + b"\r\n")


def _start_endless(handler: BaseHTTPRequestHandler) -> None:
    handler.send_response(200)
    handler.send_header("Content-Type", "application/json")
    handler.send_header("Transfer-Encoding", "chunked")
    handler.end_headers()


@behaviour
def huge(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """An answer of 200 MB."""
    head, tail = json.dumps(completion("@")).encode().split(b"@")
    handler.send_response(200)
    handler.send_header("Content-Type", "application/json")
    handler.send_header("Content-Length", str(len(head) + len(tail) + 200 * 1_000_000))
    handler.end_headers()
    handler.wfile.write(head)
    for _ in range(200):
        handler.wfile.write(b"x" * 1_000_000)
    handler.wfile.write(tail)


@behaviour
def deep(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """A body nested 100,000 deep."""
    send(handler, 200, b"[" * 100_000 + b"]" * 100_000)


@behaviour
def deep_answer(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """An answer nested 9,000 deep."""
    say(handler, "[" * 9_000 + "]" * 9_000)


@behaviour
def gzip_bomb(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """A gigabyte of zeros, packed."""
    packed = gzip.compress(bytes(10_000_000)) * 100
    send(handler, 200, packed, Content_Encoding="gzip")


@behaviour
def dropped(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Closes the connection in the middle of the body."""
    handler.send_response(200)
    handler.send_header("Content-Length", "1000")
    handler.end_headers()
    handler.wfile.write(b'{"id": "chat')
    handler.close_connection = True


@behaviour
def reset(handler: BaseHTTPRequestHandler, request: Request) -> None:
    """Resets the connection without a word."""
    handler.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    handler.close_connection = True


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
    """Just beyond every bound."""
    say(handler, beyond(schema_of(request)))


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
