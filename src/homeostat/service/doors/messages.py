"""What is said at a door: one line of JSON each way, small and strictly typed."""

from __future__ import annotations

import json
from typing import Any, Final

LARGEST: Final = 1_000_000
"""Longest answer [byte]; questions are no longer than an order."""
STATUS: Final = b'{"ask":"status"}\n'
"""The question how the plant stands."""
ANSWER_S: Final = 10.0
"""Longest wait for an answer, beside the ticks in which the guard hears an order, wall-clock [s]."""
HEARD: Final = 2.0
"""Ticks in which an order is heard for sure: one may have begun already, and another one may be late."""


def within_s(period_s: float) -> float:
    """Longest wait for the answer to an order where ticks are ``period_s`` apart, wall-clock [s]."""
    return ANSWER_S + HEARD * period_s


def answer(**said: Any) -> bytes:
    """An answer as it travels."""
    return json.dumps(said, separators=(",", ":")).encode() + b"\n"


def is_status(line: bytes) -> bool:
    """Whether ``line`` asks how the plant stands; anything else is an order, or nothing."""
    return line.strip() == STATUS.strip()
