"""The model behind an OpenAI-compatible interface."""

from __future__ import annotations

import itertools
import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tests.llm.random_model.decoding import SchemaRefused, Text, answer
from tests.llm.random_model.transformer import Weights

NAME = "random-weights"
MOST = 1024


class Server(ThreadingHTTPServer):
    """Serves one model; every call gets another seed unless it brings its own."""

    daemon_threads = True

    def __init__(self, port: int, seed: int) -> None:
        super().__init__(("127.0.0.1", port), Handler)
        self.weights = Weights(seed)
        self.seed = seed
        self.calls = itertools.count()
        self.one_at_a_time = threading.Lock()


class Handler(BaseHTTPRequestHandler):
    """`/v1/chat/completions` and `/v1/models`."""

    protocol_version = "HTTP/1.1"
    # Headers and body are two writes; on a connection that is kept open the second would wait 40 ms for the client.
    disable_nagle_algorithm = True
    server: Server

    def do_GET(self) -> None:
        if self.path == "/v1/models":
            self._send(200, {"object": "list", "data": [{"id": NAME, "object": "model", "owned_by": "nobody"}]})
        else:
            self._send(404, {"error": {"message": f"no {self.path}"}})

    def do_POST(self) -> None:
        data = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        if self.path != "/v1/chat/completions":
            self._send(404, {"error": {"message": f"no {self.path}"}})
            return
        try:
            self._send(200, self._completed(json.loads(data)))
        except (SchemaRefused, ValueError, KeyError, TypeError, AttributeError) as error:
            self._send(400, {"error": {"message": f"{type(error).__name__}: {error}"}})

    def _completed(self, body: dict[str, Any]) -> dict[str, Any]:
        prompt = "\n".join(str(message.get("content")) for message in body["messages"])
        tool = _forced(body)
        schema = (
            tool["parameters"] if tool else (body.get("response_format") or {}).get("json_schema", {}).get("schema")
        )
        most = min(body.get("max_completion_tokens") or body.get("max_tokens") or MOST, MOST)
        seed = body.get("seed")
        if seed is None:
            seed = self.server.seed * 1_000_003 + next(self.server.calls)
        # The likeliest words of random weights are the same few for ever, so temperature 0 is read as 1.
        temperature = body.get("temperature") or 1.0
        with self.server.one_at_a_time:
            text = answer(self.server.weights, prompt, schema, most, seed, temperature)
        return _completion(text, tool["name"] if tool else None, len(prompt.encode()))

    def log_message(self, format: str, *args: Any) -> None:
        pass

    def _send(self, status: int, content: object) -> None:
        data = json.dumps(content).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)


def _forced(body: dict[str, Any]) -> dict[str, Any] | None:
    """The tool that must be called: the one that is named, or the first."""
    choice = body.get("tool_choice")
    named = choice["function"]["name"] if isinstance(choice, dict) else None
    tools = [t["function"] for t in body.get("tools") or [] if named in (None, t["function"]["name"])]
    return tools[0] if tools and choice != "none" else None


def _completion(text: Text, tool: str | None, read: int) -> dict[str, Any]:
    message: dict[str, Any] = {"role": "assistant", "content": text.content}
    reason = "stop" if text.ended else "length"
    if tool is not None:
        called = {"id": "call_0", "type": "function", "function": {"name": tool, "arguments": text.content}}
        message, reason = (
            {"role": "assistant", "content": None, "tool_calls": [called]},
            "tool_calls" if text.ended else reason,
        )
    return {
        "id": "chatcmpl-random", "object": "chat.completion", "created": int(time.time()), "model": NAME,
        "choices": [{"index": 0, "finish_reason": reason, "message": message}],
        "usage": {"prompt_tokens": read, "completion_tokens": text.tokens, "total_tokens": read + text.tokens},
    }  # fmt: skip
