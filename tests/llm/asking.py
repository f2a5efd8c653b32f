"""A question, and models in process whose answers a test decides."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass, replace

from homeostat.llm.model import Failure, LanguageModel, ModelError, Question, Reply, Usage

SCHEMA: Mapping[str, object] = {
    "type": "object",
    "properties": {"reasoning": {"type": "string", "maxLength": 40}, "value": {"type": "number"}},
    "required": ["reasoning", "value"],
    "additionalProperties": False,
}
QUESTION = Question("action", 1460.0, "You choose the feed.", "It gets hot.", SCHEMA, "0" * 64)
ANSWER = Reply('{"reasoning": "less", "value": 0.02}', "served-model", Usage(12, 7, 0.001))


def question(**changes: object) -> Question:
    """The question with some fields changed."""
    return replace(QUESTION, **changes)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Asked:
    """One call of a scripted model."""

    at_s: float
    """Time of the event loop [s]."""
    within_s: float
    """Time that it was given [s]."""


class Says:
    """Implements `homeostat.llm.model.LanguageModel`: one outcome after the other, the last one for ever."""

    def __init__(self, *outcomes: Reply | BaseException, delay_s: float = 0.0) -> None:
        """``delay_s``: time that each outcome takes [s]; infinite for a model that never comes back."""
        self._outcomes = outcomes
        self._delay_s = delay_s
        self.calls: list[Asked] = []

    @property
    def name(self) -> str:
        return "says:what-it-must"

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        return {"temperature": 0.0, "seed": None, "output": "native"}

    async def ask(self, question: Question, within_s: float) -> Reply:
        self.calls.append(Asked(asyncio.get_running_loop().time(), within_s))
        outcome = self._outcomes[min(len(self.calls), len(self._outcomes)) - 1]
        await (asyncio.Event().wait() if self._delay_s == float("inf") else asyncio.sleep(self._delay_s))
        if isinstance(outcome, ModelError):  # a fresh one each time, as a real model would raise
            raise ModelError(outcome.failure, "scripted", outcome.retry_after_s, outcome.requests)
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome


@dataclass(frozen=True)
class Outcome:
    """What came of asking, and how long it took."""

    reply: Reply | None
    error: ModelError | None
    took_s: float

    @property
    def failure(self) -> Failure | None:
        return None if self.error is None else self.error.failure


async def asked(model: LanguageModel, within_s: float = 5.0, about: Question = QUESTION) -> Outcome:
    """Ask ``model``; a `ModelError` is an outcome, anything else is raised."""
    now = asyncio.get_running_loop().time
    begin = now()
    try:
        reply = await model.ask(about, within_s)
    except ModelError as error:
        return Outcome(None, error, now() - begin)
    return Outcome(reply, None, now() - begin)


def ask(model: LanguageModel, within_s: float = 5.0, about: Question = QUESTION) -> Outcome:
    """The same from outside of any event loop."""
    return asyncio.run(asked(model, within_s, about))
