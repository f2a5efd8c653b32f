"""A scripted model: an answer is what its function makes of the question."""

from __future__ import annotations

import asyncio

import pytest

from homeostat.llm.model import Failure, ModelError, Question
from homeostat.llm.retry import RetryingModel
from homeostat.llm.scripted import ScriptedModel
from tests.llm.asking import QUESTION, ask, asked, question
from tests.llm.virtual_time import VirtualTime


def test_the_function_answers() -> None:
    model = ScriptedModel("echo", lambda asked: asked.prompt)
    reply = ask(model, about=question(prompt="hello")).reply
    assert reply is not None and (reply.answer, reply.served, reply.requests) == ("hello", "echo", 1)
    assert (reply.usage.input_tokens, reply.usage.output_tokens, reply.usage.cost_usd) == (0, 0, None)


def test_every_question_is_kept() -> None:
    model = ScriptedModel("echo", lambda asked: asked.prompt)
    for prompt in ("one", "two"):
        ask(model, about=question(prompt=prompt))
    assert [q.prompt for q in model.asked] == ["one", "two"] and model.asked[0] == question(prompt="one")


def test_the_function_may_fail() -> None:
    def refuse(asked: Question) -> str:
        raise ModelError(Failure.REFUSAL)

    model = ScriptedModel("no", refuse)
    assert ask(model).failure is Failure.REFUSAL and model.asked == [QUESTION]


def test_it_may_take_its_time_and_be_cut_off() -> None:
    slow = ScriptedModel("slow", lambda asked: "late", delay_s=0.2)
    outcome = ask(slow)
    assert outcome.reply is not None and outcome.took_s >= 0.2
    slower = RetryingModel(ScriptedModel("slower", lambda asked: "never", delay_s=60.0))
    assert ask(slower, 0.1).failure is Failure.TIMEOUT


def test_several_may_think_at_once() -> None:
    model = ScriptedModel("slow", lambda asked: asked.agent, delay_s=0.2)

    async def all_at_once() -> float:
        return max(o.took_s for o in await asyncio.gather(*(asked(model) for _ in range(20))))

    assert VirtualTime().run(all_at_once()) == pytest.approx(0.2) and len(model.asked) == 20


def test_a_bug_in_the_function_is_seen() -> None:
    with pytest.raises(ZeroDivisionError):
        ask(ScriptedModel("bug", lambda asked: str(1 // 0)))
