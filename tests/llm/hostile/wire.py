"""What every misbehaviour is written with: the list of them, what was asked, and how something is sent."""

from __future__ import annotations

import json
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler
from typing import Any

Request = dict[str, Any]
Behaviour = Callable[[BaseHTTPRequestHandler, Request], None]
REGISTERED: dict[str, Behaviour] = {}
"""Every behaviour that was defined, by its name."""


def behaviour(function: Behaviour) -> Behaviour:
    """Register ``function`` under its name; its docstring says what it does."""
    REGISTERED[function.__name__] = function
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
