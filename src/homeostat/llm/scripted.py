"""A model that follows a script: what a function makes of a question is its answer."""

import asyncio
from collections.abc import Callable, Mapping

from homeostat.llm.model import Question, Reply, Usage


class ScriptedModel:
    """Implements :class:`homeostat.llm.model.LanguageModel` with a function, for tests and demonstrations."""

    def __init__(self, name: str, answer: Callable[[Question], str], delay_s: float = 0.0) -> None:
        """``answer`` may raise ModelError; ``delay_s``: time that it takes to think [s]."""
        self._answer, self._delay_s = answer, delay_s
        self.name = name
        """As it was given."""
        self.settings: Mapping[str, float | int | str | None] = {}
        """None: a script does not sample."""
        self.asked: list[Question] = []
        """Every question so far."""

    async def ask(self, question: Question, within_s: float) -> Reply:
        """What the function makes of ``question``."""
        self.asked.append(question)
        if self._delay_s:
            await asyncio.sleep(self._delay_s)
        return Reply(self._answer(question), self.name, Usage(0, 0, None))
