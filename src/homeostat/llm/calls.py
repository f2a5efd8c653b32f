"""Recorded calls: one JSON object per line, so that users keep, read and replay what models answered.

Every line has exactly these keys: ``format`` (``homeostat-call/1``), ``agent``, ``at_s`` (process time [s]), ``model``
(asked for), ``served`` (by its own name), ``system``, ``prompt``, ``schema``, ``answer`` (text, null where there is
none), ``failure`` (name of the failure, null where there is none), ``detail``, ``input_tokens``, ``output_tokens``,
``cost_usd`` (null where unknown), ``latency_s``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from homeostat.llm.model import Failure

FORMAT: Final = "homeostat-call/1"


class CallFileError(ValueError):
    """A file of recorded calls cannot be read; the message names the file, the line and what is wrong."""


@dataclass(frozen=True, slots=True)
class Call:
    """One question with its answer or failure."""

    agent: str
    """Who asked."""
    at_s: float
    """Process time [s]."""
    model: str
    """Model that was asked for."""
    served: str
    """Model that answered; empty where none did."""
    system: str
    """The role and the rules."""
    prompt: str
    """The situation."""
    schema: Mapping[str, object]
    """JSON schema that was asked for."""
    answer: str | None
    """The answer; None where there is none."""
    failure: Failure | None
    """Why there is no answer; None where there is one."""
    detail: str
    """The failure in one line."""
    input_tokens: int
    """Tokens read."""
    output_tokens: int
    """Tokens written."""
    cost_usd: float | None
    """Price [USD]; None where unknown."""
    latency_s: float
    """Wall-clock time from the question to its end [s]."""

    def to_json(self) -> str:
        """One line, without its end."""
        fields: dict[str, object] = {"format": FORMAT}
        fields |= {name: getattr(self, name) for name in self.__slots__}
        fields["failure"] = None if self.failure is None else self.failure.name
        return json.dumps(fields, ensure_ascii=True, allow_nan=False)


def append_call(path: Path, call: Call) -> None:
    """Add ``call`` to the file at ``path``; OSError where it cannot be written."""
    with path.open("a", encoding="utf-8") as file:
        file.write(f"{call.to_json()}\n")


def read_calls(path: Path) -> tuple[Call, ...]:
    """The calls in the file at ``path``, in order.

    Raises CallFileError where a line is not a call, OSError where the file cannot be read.
    """
    calls = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="surrogateescape").splitlines(), start=1):
        if not line.strip():
            continue
        try:
            calls.append(_call(json.loads(line)))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            reason = " ".join(f"{error!r}".split())[:120]
            raise CallFileError(
                f"{str(path)!r} line {number} is not a recorded call: {reason}; record it again with --record"
            ) from None
    return tuple(calls)


def _call(fields: dict[str, Any]) -> Call:
    if fields.pop("format") != FORMAT:
        raise ValueError(f"format is not {FORMAT!r}")
    failure = fields.pop("failure")
    call = Call(failure=None if failure is None else Failure[failure], **fields)
    if call.failure is None and not isinstance(call.answer, str):
        raise ValueError("there is neither an answer nor a failure")
    return call
