"""A real client against a real server that misbehaves: every misbehaviour is a reply or a failure."""

from __future__ import annotations

import gc
import resource
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import pytest

from homeostat.journal import MemoryTrace
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.journal.calls import ModelCalled
from homeostat.llm.address import parse_address
from homeostat.llm.calls import read_calls
from homeostat.llm.model import Failure, ModelError
from homeostat.llm.network import AddressPolicy
from homeostat.llm.providers import ProviderModel, Sampling
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.retry import MOST_REQUESTS, RetryingModel
from tests.llm.asking import Outcome, ask, question
from tests.llm.hostile.behaviours import BEHAVIOURS
from tests.llm.replying import replying
from tests.llm.servers import hostile

KEY = "sk-very-secret-0123456789-and-long-enough-to-be-cut-somewhere"
SHORT_S, LONG_S = 0.9, 20.0
"""Time for what never answers, and more than a busy host needs for what does, wall-clock [s]."""
MOST_MEMORY = 20e6
"""Bytes that any answer may take on its way."""

ANSWERED = {
    "valid", "rate_limited_twice", "no_schema", "deep_answer", "malformed", "nan", "infinity", "extreme", "overflow",
    "many_digits", "out_of_range", "below_range", "upper_edge", "wrong_types", "extra_fields", "contradictory",
    "echo", "key_echo", "wrong_model", "absurd_usage", "unicode_tricks",
}  # fmt: skip
"""What comes through as an answer, for the agent to judge."""
FAILED = {
    "unauthorised": Failure.UNAUTHORISED, "forbidden": Failure.UNAUTHORISED, "rate_limited": Failure.RATE_LIMITED,
    "server_error": Failure.SERVER_ERROR, "unavailable": Failure.SERVER_ERROR, "hang": Failure.TIMEOUT,
    "slow_drip": Failure.TIMEOUT, "endless": Failure.MALFORMED, "huge": Failure.MALFORMED, "deep": Failure.MALFORMED,
    "gzip_bomb": Failure.MALFORMED, "dropped": Failure.UNREACHABLE, "reset": Failure.UNREACHABLE,
    "empty": Failure.MALFORMED, "empty_content": Failure.EMPTY, "null_content": Failure.EMPTY,
    "no_choices": Failure.MALFORMED, "truncated": Failure.TRUNCATED, "refusal": Failure.REFUSAL,
    "content_filter": Failure.REFUSAL, "not_json": Failure.MALFORMED, "header_bomb": Failure.UNREACHABLE,
}  # fmt: skip
REDIRECTED = {"redirect", "redirect_loop"}
REPEATED = {"server_error", "unavailable", "dropped", "reset", "header_bomb"}
"""What is asked again while there is time; a busy machine has less of it."""
ALIKE = {"unavailable", "reset", "header_bomb"}
"""What is asked again as others of `REPEATED` are."""


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with hostile() as url:
        ask(retrying(f"{url}#valid"), 60.0)  # the client library loads what it needs with its first question
        yield url


def retrying(address: str, policy: AddressPolicy | None = None) -> RetryingModel:
    """A model as the command line makes it."""
    return RetryingModel(ProviderModel(parse_address(address), policy or AddressPolicy(local_only=True), Sampling()))


@pytest.fixture(autouse=True)
def key(monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment of somebody who has a key."""
    monkeypatch.setenv("HOMEOSTAT_LLM_KEY", KEY)


def asked(server: str, behaviour: str, within_s: float = LONG_S) -> Outcome:
    outcome = ask(retrying(f"{server}#{behaviour}"), within_s)
    assert (outcome.reply is None) is not (outcome.error is None)
    return outcome


def test_every_misbehaviour_is_expected_here() -> None:
    assert set(BEHAVIOURS) == ANSWERED | set(FAILED) | REDIRECTED


@pytest.mark.parametrize("behaviour", sorted(ANSWERED))
def test_what_comes_through_is_for_the_agent_to_judge(server: str, behaviour: str) -> None:
    reply = asked(server, behaviour).reply
    assert reply is not None and reply.answer.strip() and len(reply.answer) < 1_000_000
    assert 0 <= reply.usage.input_tokens <= 10**9 and 0 <= reply.usage.output_tokens <= 10**9
    assert reply.usage.cost_usd is None, "no list has a price of this server's"


@pytest.mark.parametrize(
    "behaviour", [pytest.param(each, marks=pytest.mark.wide if each in ALIKE else []) for each in sorted(FAILED)]
)
def test_what_does_not_is_a_failure_with_its_reason(server: str, behaviour: str) -> None:
    outcome = asked(server, behaviour, SHORT_S if FAILED[behaviour] is Failure.TIMEOUT else LONG_S)
    assert outcome.failure is FAILED[behaviour] and outcome.error is not None
    message = str(outcome.error)
    assert "\n" not in message and len(message) < 400
    assert all(KEY[k : k + 12] not in message for k in range(len(KEY) - 12)), "not even a piece of the key"
    assert outcome.error.requests in (range(1, MOST_REQUESTS + 1) if behaviour in REPEATED else [1])


def test_headers_that_are_in_the_environment_go_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """They may be the secrets of another service, and may not stand in for the key."""
    for name in ("OPENAI_CUSTOM_HEADERS", "ANTHROPIC_CUSTOM_HEADERS"):
        monkeypatch.setenv(name, "X-Gateway-Token: corporate-secret\nAuthorization: Bearer another")
    with replying() as server:
        ask(retrying(f"{server.url}/v1#m"), LONG_S)
    assert server.received
    for received in server.received:
        assert received["authorization"] == f"Bearer {KEY}"
        assert not [name for name, value in received.items() if "corporate" in value or "another" in value]


def test_an_error_of_a_megabyte_is_told_by_its_status_and_asked_again() -> None:
    with replying(503, body=1_000_001 * b"x") as server:
        outcome = ask(retrying(f"{server.url}/v1#m"), LONG_S)
    assert outcome.failure is Failure.SERVER_ERROR and outcome.error is not None
    assert outcome.error.requests == MOST_REQUESTS


@pytest.mark.parametrize("behaviour", sorted(REDIRECTED))
@pytest.mark.parametrize("policy", [AddressPolicy(), AddressPolicy(local_only=True)], ids=["anywhere", "local only"])
def test_a_redirection_is_not_followed(server: str, behaviour: str, policy: AddressPolicy) -> None:
    """`example.invalid` cannot be reached: following would be another failure, and asked again."""
    outcome = ask(retrying(f"{server}#{behaviour}", policy), LONG_S)
    assert outcome.failure is Failure.FORBIDDEN and outcome.error is not None
    assert "307" in str(outcome.error) and "redirections are not followed" in str(outcome.error)
    assert outcome.error.requests == 1


@pytest.mark.parametrize("behaviour", ["hang", "slow_drip", "dropped", "server_error", "rate_limited"])
def test_there_is_an_outcome_however_short_the_time_is(server: str, behaviour: str) -> None:
    """That it comes in time is tested in virtual time (``test_retry``), which no busy machine can stretch."""
    asked(server, behaviour, 0.2)


@pytest.mark.parametrize("behaviour", ["huge", "gzip_bomb", "endless", "header_bomb", "deep"])
def test_the_memory_is_kept(server: str, behaviour: str) -> None:
    model = retrying(f"{server}#{behaviour}")
    gc.collect()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    tracemalloc.start()
    try:
        outcome = ask(model, 0.9)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert outcome.error is not None and peak < MOST_MEMORY
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown * 1024 < 4 * MOST_MEMORY, "nor what Python does not see; tracing itself takes some"


def test_the_name_that_the_server_gives_itself_is_told(server: str) -> None:
    reply = asked(server, "wrong_model").reply
    assert reply is not None and reply.served == "a-cheaper-one"
    assert retrying(f"{server}#wrong_model").name.endswith("#wrong_model"), "beside the one that was asked for"


def test_a_limited_server_is_asked_again(server: str) -> None:
    reply = asked(server, "rate_limited_twice").reply
    assert reply is not None and 1 <= reply.requests <= 3


@pytest.mark.parametrize("behaviour", sorted(BEHAVIOURS.keys() - {"hang", "slow_drip"}))
def test_no_key_gets_into_the_record(server: str, behaviour: str, tmp_path: Path) -> None:
    trace, file = MemoryTrace(), tmp_path / "calls.jsonl"
    model = RecordedModel(retrying(f"{server}#{behaviour}"), trace, MemoryArchive(), (KEY,), file)
    outcome = ask(model, 0.4)
    (event,) = trace.of(ModelCalled)
    (call,) = read_calls(file)
    said = [str(outcome.error), event.detail, event.served, call.detail, file.read_text()]
    said += [outcome.reply.answer, outcome.reply.served] if outcome.reply else []
    for text in said:
        assert all(KEY[k : k + 12] not in text for k in range(len(KEY) - 12))
    assert (event.failure == "") is (call.failure is None) is (outcome.reply is not None)


def test_a_server_that_is_not_there(server: str) -> None:
    outcome = ask(retrying("http://127.0.0.1:9/v1#m"), LONG_S)
    assert outcome.failure is Failure.UNREACHABLE


def test_nothing_is_sent_where_it_is_not_allowed() -> None:
    with pytest.raises(ModelError) as refused:
        retrying("https://api.openai.com/v1#gpt-4.1-mini")
    assert refused.value.failure is Failure.FORBIDDEN


def test_a_prompt_of_a_megabyte_is_sent_or_fails(server: str) -> None:
    outcome = ask(retrying(f"{server}#valid"), 10.0, question(prompt="x" * 1_000_000))
    assert outcome.reply is not None


def test_one_model_serves_one_event_loop_after_the_other(server: str) -> None:
    """Nothing is kept open between questions: each of these runs in an event loop of its own."""
    model = retrying(f"{server}#valid")
    assert all(ask(model).reply is not None for _ in range(3))
