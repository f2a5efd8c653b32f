"""Transcript: what a language model was asked in which state, and what it answered."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from homeostat.llm.model import LanguageModel, Question, Reply
from homeostat.llm.tokens import estimate


@dataclass(frozen=True, slots=True)
class TranscriptEntry:
    """One answer."""

    agent: str
    """Who asked: ``planning``, ``action`` or ``reprompting``."""
    state: str
    """State that the plant was in."""
    answer: str
    """As the model gave it; empty where it gave none."""
    asked_tokens: int = 0
    """Tokens of the question with its schema, estimated."""
    answered_tokens: int = 0
    """Tokens of the answer, estimated."""
    served: str = ""
    """Name of the model that answered, as it was served; empty where there is no answer."""


class TranscribedModel:
    """Implements :class:`homeostat.llm.model.LanguageModel` over another one, and keeps what it said."""

    def __init__(self, model: LanguageModel, state: Callable[[], str]) -> None:
        """``state`` says which state the plant is in."""
        self._model, self._state = model, state
        self.transcript: list[TranscriptEntry] = []
        """Every answer so far."""

    @property
    def name(self) -> str:
        """The other model's."""
        return self._model.name

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        """The other model's."""
        return self._model.settings

    async def ask(self, question: Question, within_s: float) -> Reply:
        """The other model's answer."""
        state, answer, served = self._state(), "", ""
        try:
            reply = await self._model.ask(question, within_s)
            answer, served = reply.answer, reply.served
        finally:
            asked = sum(map(estimate, (question.system, question.prompt, json.dumps(question.schema))))
            self.transcript.append(TranscriptEntry(question.agent, state, answer, asked, estimate(answer), served))
        return reply
