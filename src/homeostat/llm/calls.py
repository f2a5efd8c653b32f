"""Recorded calls: one JSON object per line, so that users keep, read and replay what models answered.

Every line has exactly these keys: ``format`` (``homeostat-call/1``), ``agent``, ``at_s`` (process time [s]), ``model``
(asked for), ``served`` (by its own name), ``system``, ``prompt``, ``schema``, ``answer`` (text, null where there is
none), ``failure`` (name of the failure, null where there is none), ``detail``, ``input_tokens``, ``output_tokens``,
``cost_usd`` (null where unknown), ``latency_s``.
"""

import json
import os
import sys
from collections.abc import Callable, Mapping
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
    """Add ``call`` to the file at ``path``; OSError where it cannot be written, or is a pipe that nobody reads now."""
    with open(path, "a", encoding="utf-8", opener=_at_once) as file:
        file.write(f"{call.to_json()}\n")


def _at_once(path: str, flags: int) -> int:
    """Opens a file as `open` does, but does not wait for whoever reads a pipe: who thinks has no time for that."""
    return os.open(path, flags | os.O_NONBLOCK, 0o666)


def read_calls(path: Path) -> tuple[Call, ...]:
    """The calls in the file at ``path``, in order; CallFileError where a line is none, OSError as the file."""
    calls = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="surrogateescape").splitlines(), start=1):
        if not line.strip():
            continue
        try:
            calls.append(_call(json.loads(line)))
        except (ValueError, RecursionError) as error:
            reason = " ".join(str(error).split())[:160]
            raise CallFileError(
                f"{str(path)!r} line {number} is not a recorded call: {reason}; record it again with --record"
            ) from None
    return tuple(calls)


def _call(fields: object) -> Call:
    """The call in what JSON made of a line; ValueError, naming the field and what belongs there, where it is none."""
    if not isinstance(fields, dict):
        raise ValueError("it is not an object")
    if fields.pop("format", None) != FORMAT:
        raise ValueError(f"'format' must be {FORMAT!r}")
    if unknown := fields.keys() - _FIELDS.keys():
        raise ValueError(f"there is no field {min(unknown)!r}")
    for name, (fits, expected) in _FIELDS.items():
        if name not in fields:
            raise ValueError(f"{name!r} is missing; it must be {expected}")
        if not fits(fields[name]):
            raise ValueError(f"{name!r} must be {expected}, and is {repr(fields[name])[:40]}")
    failure = fields.pop("failure")
    if failure is None and fields["answer"] is None:
        raise ValueError("there is neither an answer nor a failure")
    return Call(failure=None if failure is None else Failure[failure], **fields)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_count(value: Any) -> bool:
    return type(value) is int and value >= 0


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= sys.float_info.max  # an integer may be beyond any float


def _is_amount(value: Any) -> bool:
    return _is_number(value) and value >= 0


_FIELDS: Final[Mapping[str, tuple[Callable[[Any], bool], str]]] = {
    **dict.fromkeys(("agent", "model", "served", "system", "prompt", "detail"), (_is_text, "a text")),
    **dict.fromkeys(("input_tokens", "output_tokens"), (_is_count, "a whole number of at least 0")),
    "at_s": (_is_number, "a finite number"),
    "latency_s": (_is_amount, "a finite number of at least 0"),
    "cost_usd": (lambda cost: cost is None or _is_amount(cost), "a finite number of at least 0, or null"),
    "schema": (lambda schema: isinstance(schema, dict), "an object"),
    "answer": (lambda answer: answer is None or _is_text(answer), "a text or null"),
    "failure": (lambda name: name is None or name in list(Failure.__members__), "the name of a failure or null"),
}
"""Field of a line -> whether a value fits, and what is expected there."""
