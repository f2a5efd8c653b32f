"""A model that says an answer only where it was given: what is recorded of a question must begin its lines."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.llm.calls import Call
from homeostat.llm.model import Failure, Usage
from homeostat.llm.replay import SituatedReplay, fits
from tests.llm.asking import QUESTION, ask, question


def call(answer: str | None, prompt: str, agent: str = "action", failure: Failure | None = None) -> Call:
    """A recorded call of which only ``prompt`` is known."""
    return Call(
        agent=agent, at_s=1.0, model="m", served="m-served", system="", prompt=prompt, schema={}, answer=answer,
        failure=failure, detail="it was so" if failure else "", input_tokens=12, output_tokens=7, cost_usd=0.01,
        latency_s=0.5,
    )  # fmt: skip


def answers(model: SituatedReplay, *prompts: str, agent: str = "action") -> list[str | Failure | None]:
    """What ``model`` says to one prompt after the other."""
    outcomes = [ask(model, about=question(prompt=prompt, agent=agent)) for prompt in prompts]
    return [outcome.reply.answer if outcome.reply else outcome.failure for outcome in outcomes]


def test_an_answer_is_said_where_it_was_given_however_often_and_in_whatever_order_one_asks() -> None:
    model = SituatedReplay("f", [call("a1", "State a ("), call("a2", "State a ("), call("b", "State b (")])
    here, there = "Level 1 m.\nState a (filling) at 3 s.", "State b (emptying) at 9 s.\nLevel 1 m."
    assert answers(model, there, there, here, here, here) == ["b", Failure.EXHAUSTED, "a1", "a2", Failure.EXHAUSTED]


def test_every_recorded_line_must_begin_a_line_of_the_question() -> None:
    model = SituatedReplay("f", [call("x", "State a (\n# Commands in state b (")])
    only, inside = "State a (filling)", "State a (filling)\nNot # Commands in state b (filling)"
    assert answers(model, only, inside) == [Failure.EXHAUSTED] * 2
    assert answers(model, "# Commands in state b (b)\nState a (filling)") == ["x"]


def test_a_call_of_which_nothing_is_known_fits_every_question_to_its_agent() -> None:
    model = SituatedReplay("f", [call("x", ""), call("y", "", agent="planning")])
    assert answers(model, "anything", agent="planning") == ["y"]
    assert answers(model, "anything", "anything") == ["x", Failure.EXHAUSTED]


def test_what_is_known_of_the_role_must_fit_too() -> None:
    one = Call(**{name: getattr(call("x", ""), name) for name in Call.__slots__} | {"system": "You choose"})
    assert fits(one, question(system="You choose the feed.")) and not fits(one, question(system="You plan."))


def test_a_question_recorded_as_a_whole_fits_itself() -> None:
    assert fits(call("x", QUESTION.prompt), QUESTION)


def test_what_is_known_about_an_answer_is_said_with_it() -> None:
    reply = ask(SituatedReplay("f", [call("x", "")])).reply
    assert reply is not None and (reply.answer, reply.served, reply.usage) == ("x", "m-served", Usage(12, 7, 0.01))


@pytest.mark.parametrize("failure", list(Failure))
def test_a_failure_fails_again(failure: Failure) -> None:
    outcome = ask(SituatedReplay("f", [call(None, "", failure=failure)]))
    assert outcome.failure is failure and "it was so" in str(outcome.error)


def test_where_nothing_fits_it_says_so_and_sends_nothing() -> None:
    outcome = ask(SituatedReplay("leak-3.jsonl", [call("x", "elsewhere")]))
    assert outcome.error is not None and outcome.failure is Failure.EXHAUSTED and outcome.error.requests == 0
    assert "'action'" in str(outcome.error) and "leak-3.jsonl" in str(outcome.error)


@given(st.lists(st.sampled_from("abc")), st.lists(st.sampled_from("abcd"), max_size=8))
def test_nothing_is_said_twice_or_elsewhere(recorded: list[str], asked: list[str]) -> None:
    model = SituatedReplay("f", [call(f"{k} {state}", f"State {state} (") for k, state in enumerate(recorded)])
    left = [f"{k} {state}" for k, state in enumerate(recorded)]
    for state in asked:
        expected = next((said for said in left if said.endswith(state)), None)
        assert answers(model, f"State {state} (as ever)") == [expected or Failure.EXHAUSTED]
        if expected:
            left.remove(expected)
