"""A recorded model says what was said: to the same question the same, to another one the next."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.journal import MemoryTrace
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.journal.calls import ModelCalled
from homeostat.llm.calls import Call
from homeostat.llm.model import APPROVED, Failure, Usage
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.replay import ReplayModel
from tests.llm.asking import QUESTION, ask, question


def call(answer: str | None, prompt: str = "before", agent: str = "action", failure: Failure | None = None) -> Call:
    """A recorded call."""
    return Call(
        agent=agent, at_s=1.0, model="ollama:m", served="m-served", system=QUESTION.system, prompt=prompt,
        schema=QUESTION.schema, answer=answer, failure=failure, detail="it was so" if failure else "",
        input_tokens=12, output_tokens=7, cost_usd=0.01, latency_s=0.5,
    )  # fmt: skip


def answers(model: ReplayModel, *prompts: str, agent: str = "action") -> list[str | Failure | None]:
    """What ``model`` says to one prompt after the other."""
    found: list[str | Failure | None] = []
    for prompt in prompts:
        outcome = ask(model, about=question(prompt=prompt, agent=agent))
        found.append(outcome.reply.answer if outcome.reply else outcome.failure)
    return found


def test_what_was_recorded_is_said_again_with_all_that_is_known_about_it() -> None:
    reply = ask(ReplayModel("replay:f", [call("a")])).reply
    assert reply is not None and (reply.answer, reply.served, reply.usage) == ("a", "m-served", Usage(12, 7, 0.01))


def test_it_has_the_name_of_its_file_and_samples_nothing() -> None:
    model = ReplayModel("replay:f", [])
    assert model.name == "replay:f" and model.settings == {}


def test_the_same_question_gets_its_own_answer() -> None:
    model = ReplayModel("f", [call("one", "p1"), call("two", "p2"), call("three", "p3")])
    assert answers(model, "p3", "p1", "p2") == ["three", "one", "two"]


def test_a_question_asked_twice_gets_its_answers_in_order() -> None:
    model = ReplayModel("f", [call("first", "p"), call("other", "q"), call("second", "p")])
    assert answers(model, "p", "p", "q") == ["first", "second", "other"]


def test_what_was_said_before_anything_was_approved_is_no_answer_to_whether_there_is_something_cheaper() -> None:
    """An old recording has no such questions: what it says next is about what came later, and is kept for that."""
    further = f"State normal.\n{APPROVED}normal > reduced_load, costs 2 EUR; the best so far costs 1 EUR."
    model = ReplayModel("f", [call("first"), call("later")])
    assert answers(model, "new", further, "newer") == ["first", Failure.EXHAUSTED, "later"]
    model = ReplayModel("f", [call("first"), call("cheaper", further), call("later")])
    assert answers(model, "new", "newer", further + " For 3 s.") == ["first", "later", "cheaper"]


def test_another_question_gets_the_next_answer_to_the_same_agent() -> None:
    model = ReplayModel("f", [call("plan", agent="planning"), call("one"), call("two"), call("path", agent="planning")])
    assert answers(model, "new", "newer") == ["one", "two"]
    assert answers(model, "new", "newer", agent="planning") == ["plan", "path"]


def test_another_system_is_another_question() -> None:
    model = ReplayModel("f", [call("next", "q"), call("exact", QUESTION.prompt)])
    outcome = ask(model, about=question(system="another role"))
    assert outcome.reply is not None and outcome.reply.answer == "next"


def test_another_agent_s_question_is_not_answered_by_the_same_words() -> None:
    model = ReplayModel("f", [call("plan", QUESTION.prompt, agent="planning")])
    assert ask(model).failure is Failure.EXHAUSTED


@pytest.mark.parametrize("failure", list(Failure))
def test_a_failure_fails_again(failure: Failure) -> None:
    outcome = ask(ReplayModel("f", [call(None, failure=failure)]))
    assert outcome.failure is failure and "it was so" in str(outcome.error)


def test_where_nothing_is_left_it_says_so() -> None:
    model = ReplayModel("replay:calls.jsonl", [call("one")])
    assert answers(model, "p", "p") == ["one", Failure.EXHAUSTED]
    outcome = ask(model)
    assert outcome.error is not None and outcome.error.requests == 0
    assert "'action'" in str(outcome.error) and "replay:calls.jsonl" in str(outcome.error)


RECORDS = st.lists(
    st.builds(call, st.text(max_size=3), st.sampled_from("pqr"), st.sampled_from(["action", "planning"])), max_size=8
)


@given(RECORDS, st.lists(st.tuples(st.sampled_from("pqrs"), st.sampled_from(["action", "planning"])), max_size=10))
def test_every_answer_is_given_once_and_none_is_made_up(calls: list[Call], asked: list[tuple[str, str]]) -> None:
    model = ReplayModel("f", calls)
    left = list(calls)
    for prompt, agent in asked:
        outcome = ask(model, about=question(prompt=prompt, agent=agent))
        of_agent = [c for c in left if c.agent == agent]
        exact = [c for c in of_agent if c.prompt == prompt]
        if outcome.reply is None:
            assert outcome.failure is Failure.EXHAUSTED and not of_agent
        else:
            expected = (exact or of_agent)[0]
            assert outcome.reply.answer == expected.answer
            left.remove(expected)


def test_a_replayed_failure_is_worded_as_it_was() -> None:
    """Recording a replay does not make its failures longer each time."""
    trace = MemoryTrace()
    recorded = call(None, failure=Failure.TIMEOUT)
    for _ in range(3):
        model = RecordedModel(ReplayModel("f", [recorded]), trace, MemoryArchive())
        ask(model)
        told = trace.of(ModelCalled)[-1]
        recorded = Call(**{n: getattr(recorded, n) for n in recorded.__slots__} | {"detail": told.detail})
        assert told.detail == "no answer in time: it was so"
