"""A model that answers from recorded calls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from homeostat.llm.calls import Call
from homeostat.llm.model import Failure, ModelError, Question, Reply, Usage


class ReplayModel:
    """Implements :class:`homeostat.llm.model.LanguageModel`: says again what was recorded.

    A question that was recorded word for word gets its own answer; any other gets the next answer to the same agent
    that was not given yet. A recorded failure fails again.
    """

    def __init__(self, name: str, calls: Sequence[Call]) -> None:
        """``name`` says where the calls come from."""
        self.name = name
        """Where the calls come from."""
        self.settings: Mapping[str, float | int | str | None] = {}
        """None: what was said is said again."""
        self._left = list(calls)

    async def ask(self, question: Question, within_s: float) -> Reply:
        """The recorded answer; ModelError where that call failed or no answer to this agent is left."""
        return said_again(self._next(question))

    def _next(self, question: Question) -> Call:
        asked = [c for c in self._left if c.agent == question.agent]
        exact = [c for c in asked if c.system == question.system and c.prompt == question.prompt]
        for call in (*exact, *asked):
            self._left.remove(call)
            return call
        raise ModelError(Failure.EXHAUSTED, f"{self.name} has no further answer to {question.agent!r}", requests=0)


def said_again(call: Call) -> Reply:
    """What ``call`` recorded; ModelError where it failed."""
    if call.failure is not None or call.answer is None:
        failure = call.failure or Failure.EMPTY
        # The detail in a file is the whole line, which begins with the words of the failure; they are said once.
        raise ModelError(failure, call.detail.removeprefix(failure.value).removeprefix(": "))
    return Reply(call.answer, call.served, Usage(call.input_tokens, call.output_tokens, call.cost_usd))
