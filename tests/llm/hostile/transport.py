"""Misbehaving below the answer: connections and bodies that never end, break off or are far too long."""

from __future__ import annotations

import gzip
import json
import os
import socket
import struct
import time
from http.server import BaseHTTPRequestHandler

from tests.llm.hostile.wire import Request, behaviour, completion, say, send

LONG_S = 3600.0
"""Longer than anybody waits [s]."""


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
    # The library says goodbye before it closes a socket; only what it no longer holds is reset.
    os.close(handler.connection.detach())
    handler.close_connection = True
