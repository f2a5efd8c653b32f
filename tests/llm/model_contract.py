"""What every language model must do. A test class inherits this and says which model it is about."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from homeostat.llm.model import Failure, LanguageModel, Question, Reply
from homeostat.llm.retry import RetryingModel
from tests.llm.asking import ask, question

AGENTS = ("planning", "action", "reprompting")


class ModelContract:
    """Inherit, and provide the fixture ``make``: a fresh model that has an answer to every one of `AGENTS`."""

    def test_it_has_a_name_and_settings_that_a_trace_can_hold(self, make: Callable[[], LanguageModel]) -> None:
        model = make()
        assert model.name and isinstance(model.name, str) and "\n" not in model.name
        for name, value in model.settings.items():
            assert isinstance(name, str) and (value is None or isinstance(value, float | int | str))
            assert not isinstance(value, float) or math.isfinite(value)

    @pytest.mark.parametrize("agent", AGENTS)
    def test_an_answer_is_text_with_its_usage(self, make: Callable[[], LanguageModel], agent: str) -> None:
        reply = ask(make(), about=question(agent=agent)).reply
        assert isinstance(reply, Reply) and isinstance(reply.answer, str) and isinstance(reply.served, str)
        assert reply.requests >= 1 and reply.usage.input_tokens >= 0 and reply.usage.output_tokens >= 0
        cost = reply.usage.cost_usd
        assert cost is None or (math.isfinite(cost) and cost >= 0.0)

    def test_however_often_it_is_asked_there_is_a_reply_or_a_model_error(
        self, make: Callable[[], LanguageModel]
    ) -> None:
        model = make()
        for number in range(12):
            outcome = ask(model, about=question(prompt=f"question {number}"))
            assert outcome.reply is not None or isinstance(outcome.failure, Failure)
            if outcome.error is not None:
                assert str(outcome.error) and "\n" not in str(outcome.error) and outcome.error.requests >= 0

    @pytest.mark.parametrize("text", ["", "\x00", "x" * 100_000, "«»\n# Situation", '{"a": "' * 50])
    def test_no_question_is_too_strange(self, make: Callable[[], LanguageModel], text: str) -> None:
        asked: Question = question(system=text, prompt=text)
        outcome = ask(make(), about=asked)
        assert outcome.reply is not None or isinstance(outcome.failure, Failure)

    def test_the_name_and_the_settings_stay_the_same(self, make: Callable[[], LanguageModel]) -> None:
        model = make()
        before = model.name, dict(model.settings)
        ask(model)
        assert (model.name, dict(model.settings)) == before

    @pytest.mark.parametrize("within_s", [0.01, 0.2])
    def test_with_retries_there_is_an_outcome_however_short_the_time(
        self, make: Callable[[], LanguageModel], within_s: float
    ) -> None:
        outcome = ask(RetryingModel(make()), within_s)
        assert outcome.reply is not None or isinstance(outcome.failure, Failure)
