"""A model that follows a script: what a function makes of a question is its answer."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping

from homeostat.llm.model import Question, Reply, Usage


class ScriptedModel:
    """Implements :class:`homeostat.llm.model.LanguageModel` with a function, for tests and demonstrations."""

    def __init__(self, name: str, answer: Callable[[Question], str], delay_s: float = 0.0) -> None:
        """``answer`` may raise ModelError; ``delay_s``: time that it takes to think [s]."""
        self._name = name
        self._answer = answer
        self._delay_s = delay_s
        self.asked: list[Question] = []
        """Every question so far."""

    @property
    def name(self) -> str:
        """As it was given."""
        return self._name

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        """None: a script does not sample."""
        return {}

    async def ask(self, question: Question, within_s: float) -> Reply:
        """What the function makes of ``question``."""
        self.asked.append(question)
        if self._delay_s:
            await asyncio.sleep(self._delay_s)
        return Reply(self._answer(question), self._name, Usage(0, 0, None))
