"""Models that answer from recorded calls: in their order, or each only to a question that it fits."""

from collections.abc import Mapping, Sequence

from homeostat.llm.calls import Call
from homeostat.llm.model import APPROVED, Failure, ModelError, Question, Reply, Usage


class ReplayModel:
    """Implements :class:`homeostat.llm.model.LanguageModel`: says again what was recorded.

    A question that was recorded word for word gets its own answer; any other gets the next answer to the same agent
    that was not given yet. What was said before anything of the model's own was approved is no answer to a question
    that tells it so: a model that was not asked for something cheaper has none, and its next answers are about what
    came later. A recorded failure fails again.
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
        has = _has_something(question.prompt)
        asked = [c for c in self._left if c.agent == question.agent and _has_something(c.prompt) == has]
        exact = [c for c in asked if c.system == question.system and c.prompt == question.prompt]
        for call in (*exact, *asked):
            self._left.remove(call)
            return call
        raise ModelError(Failure.EXHAUSTED, f"{self.name} has no further answer to {question.agent!r}", requests=0)


def _has_something(prompt: str) -> bool:
    """Whether a question tells the model that something of its own is approved."""
    return any(line.startswith(APPROVED) for line in prompt.splitlines())


def said_again(call: Call) -> Reply:
    """What ``call`` recorded; ModelError where it failed."""
    if call.failure is not None or call.answer is None:
        failure = call.failure or Failure.EMPTY
        # The detail in a file is the whole line, which begins with the words of the failure; they are said once.
        raise ModelError(failure, call.detail.removeprefix(failure.value).removeprefix(": "))
    return Reply(call.answer, call.served, Usage(call.input_tokens, call.output_tokens, call.cost_usd))


SUPPLIED = "published-loop"
"""Served by whoever recorded the calls and not by the model: what its loop did without asking."""


class SituatedReplay:
    """Implements :class:`homeostat.llm.model.LanguageModel`: says again what was said to a question of the same kind.

    What is recorded of a question may be less than the question: of its system and its prompt, the lines that tell it
    from others, or how these begin. A call fits a question of the same agent where every recorded line begins one of
    the question's lines. The first call that fits and was not said yet is said, and no other one ever: unlike
    :class:`homeostat.llm.replay.ReplayModel`, which answers in order whatever is asked, this model does not say in one
    state what was said in another one where it is asked more or less often than whoever was recorded.
    """

    def __init__(self, name: str, calls: Sequence[Call]) -> None:
        """``name`` says where the calls come from."""
        self.name = name
        """Where the calls come from."""
        self.settings: Mapping[str, float | int | str | None] = {}
        """None: what was said is said again."""
        self._left = list(calls)

    async def ask(self, question: Question, within_s: float) -> Reply:
        """The first recorded answer that fits; ModelError where that call failed or none that fits is left."""
        for call in self._left:
            if fits(call, question):
                self._left.remove(call)
                return said_again(call)
        detail = f"{self.name} has no answer left that was given to {question.agent!r} here"
        raise ModelError(Failure.EXHAUSTED, detail, requests=0)


def fits(call: Call, question: Question) -> bool:
    """Whether what is recorded of the question that ``call`` answered begins lines of ``question``.

    >>> asked = Question("planning", 7.0, "You plan.", "Level 0.2 m.\\nState idle (at rest) at 7 s.", {}, "")
    >>> call = Call("planning", 0.0, "m", "m", "", "State idle (", {}, "{}", None, "", 0, 0, None, 0.0)
    >>> fits(call, asked)
    True
    """
    told = (call.system, question.system), (call.prompt, question.prompt)
    return call.agent == question.agent and all(_begins(excerpt, text) for excerpt, text in told)


def _begins(excerpt: str, text: str) -> bool:
    """Whether every line of ``excerpt`` begins a line of ``text``."""
    lines = text.splitlines()
    return all(any(line.startswith(begin) for line in lines) for begin in excerpt.splitlines())
