"""What is said at a door: one line of JSON each way, small and strictly typed."""

from __future__ import annotations

import json
from typing import Any, Final

LARGEST: Final = 1_000_000
"""Longest answer [byte]; questions are no longer than an order."""
STATUS: Final = b'{"ask":"status"}\n'
"""The question how the plant stands."""
ANSWER_S: Final = 10.0
"""Longest wait for the guard's answer to an order, wall-clock [s]."""


def answer(**said: Any) -> bytes:
    """An answer as it travels."""
    return json.dumps(said, separators=(",", ":")).encode() + b"\n"


def is_status(line: bytes) -> bool:
    """Whether ``line`` asks how the plant stands; anything else is an order, or nothing."""
    return line.strip() == STATUS.strip()
