"""What an agent needs from a language model: one question, one answer in JSON, within a time."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol


class Failure(StrEnum):
    """Why there is no answer."""

    TIMEOUT = "no answer in time"
    REFUSAL = "the model refused"
    TRUNCATED = "the answer was cut off"
    MALFORMED = "the response could not be read"
    EMPTY = "the answer was empty"
    UNAUTHORISED = "the key was not accepted, or its account is exhausted"
    RATE_LIMITED = "too many requests"
    REJECTED = "the server rejected the request"
    SERVER_ERROR = "the server failed"
    UNREACHABLE = "the connection could not be made or was lost"
    FORBIDDEN = "the address is not allowed"
    EXHAUSTED = "there is no more recorded answer"


STRUCK_OUT = "[key]"
"""Stands where a key stood."""
APPROVED = "Approved of yours: "
"""Begins the line that tells a model what is approved of its own: it is asked for something that costs less."""
REPEATABLE = frozenset({Failure.RATE_LIMITED, Failure.SERVER_ERROR, Failure.UNREACHABLE})
"""Failures that may be gone a moment later."""
ANSWERED = frozenset({Failure.TRUNCATED, Failure.MALFORMED, Failure.EMPTY})
"""Failures in which the model did say something, so that telling it what was wrong may help."""


class ModelError(Exception):
    """There is no answer; the message says why in one line."""

    def __init__(
        self, failure: Failure, detail: str = "", retry_after_s: float | None = None, requests: int = 1
    ) -> None:
        """``retry_after_s``: how long the server asked to wait [s]; ``requests``: how many were sent."""
        super().__init__(f"{failure.value}: {detail}" if detail else failure.value)
        self.failure = failure
        self.detail = detail
        self.retry_after_s = retry_after_s
        self.requests = requests


@dataclass(frozen=True, slots=True)
class Question:
    """What a model is asked."""

    agent: str
    """Who asks: ``planning``, ``action`` or ``reprompting``."""
    at_s: float
    """Process time [s]."""
    system: str
    """The role and the rules."""
    prompt: str
    """The situation."""
    schema: Mapping[str, object]
    """JSON schema that the answer must satisfy."""
    template_sha256: str
    """Hash of the prompt files that system and prompt were made from."""


@dataclass(frozen=True, slots=True)
class Usage:
    """What an answer took."""

    input_tokens: int
    """Tokens read, by the server's count."""
    output_tokens: int
    """Tokens written, by the server's count."""
    cost_usd: float | None
    """Price by the provider's list [USD]; None where no list price is known."""


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer."""

    answer: str
    """JSON text; whether it satisfies the schema is for the agent to see."""
    served: str
    """Name of the model that answered, as the server gives it."""
    usage: Usage
    """What it took."""
    requests: int = 1
    """Requests that were sent, those that failed included."""


class LanguageModel(Protocol):
    """Somebody who answers questions."""

    @property
    def name(self) -> str:
        """Name under which it was asked for: ``openai:gpt-4.1-mini``."""

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        """How it samples: temperature, seed, and what else shapes its answers."""

    async def ask(self, question: Question, within_s: float) -> Reply:
        """The answer to ``question`` within ``within_s`` wall-clock seconds; ModelError where there is none."""
