"""Ways to get an answer in a schema, of real models and of servers that reject one way after the other."""

from __future__ import annotations

import asyncio
import json
import threading
import urllib.request
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from homeostat.agents.language.answers import Unusable, action_type, planning_type, read
from homeostat.llm.address import ModelAddress, parse_address
from homeostat.llm.model import Failure, LanguageModel, ModelError
from homeostat.llm.network import AddressPolicy
from homeostat.llm.providers import NATIVE, PROMPTED, TOOL, ProviderModel, Sampling
from homeostat.llm.retry import RetryingModel
from tests.agents.language.answering import STATES, TAGS
from tests.agents.language.situations import questions
from tests.llm.asking import QUESTION, SCHEMA, ask, question
from tests.llm.model_contract import ModelContract
from tests.llm.replying import Server, replying
from tests.llm.servers import hostile, random_model

LOCAL = AddressPolicy(local_only=True)
ANSWER = '{"reasoning": "less", "value": 0.02}'


def completion(message: dict[str, Any], **more: Any) -> bytes:
    """A response of an OpenAI-compatible server."""
    choice = {"index": 0, "finish_reason": "stop", "message": {"role": "assistant", "content": None} | message}
    usage = {"prompt_tokens": 1000, "completion_tokens": 100, "total_tokens": 1100}
    return json.dumps(
        {"id": "c1", "object": "chat.completion", "created": 1, "model": "m", "choices": [choice], "usage": usage}
        | more
    ).encode()


def way(request: dict[str, Any]) -> str:
    """How a request asks for JSON."""
    return TOOL if request.get("tools") else NATIVE if request.get("response_format") else PROMPTED


SAYS = {NATIVE: b"response_format", TOOL: b"tool_choice", PROMPTED: b"a JSON schema"}
"""What a server does not know where it rejects a way."""


def rejecting(*rejected: str, status: int = 400) -> Callable[[dict[str, Any]], tuple[int, bytes]]:
    """A server that does not know some of the ways."""

    def respond(request: dict[str, Any]) -> tuple[int, bytes]:
        if way(request) in rejected:
            return status, b'{"error": {"message": "%s is not supported"}}' % SAYS[way(request)]
        if way(request) == TOOL:
            called = {"name": request["tools"][0]["function"]["name"], "arguments": ANSWER}
            return 200, completion({"tool_calls": [{"id": "1", "type": "function", "function": called}]})
        return 200, completion({"content": ANSWER})

    return respond


def model(server: Server, sampling: Sampling | None = None, name: str = "m") -> ProviderModel:
    return ProviderModel(parse_address(f"{server.url}/v1#{name}"), LOCAL, sampling or Sampling())


def ways(server: Server) -> list[str]:
    return [way(json.loads(body)) for body in server.bodies]


@pytest.mark.parametrize(
    ("rejected", "expected"),
    [((), [NATIVE]), ((NATIVE,), [NATIVE, TOOL]), ((NATIVE, TOOL), [NATIVE, TOOL, PROMPTED])],
)
@pytest.mark.parametrize("status", [400, 422])
def test_where_one_way_is_rejected_the_next_is_tried(
    rejected: tuple[str, ...], expected: list[str], status: int
) -> None:
    with replying(respond=rejecting(*rejected, status=status)) as server:
        asked = model(server)
        reply = ask(asked).reply
        assert reply is not None and json.loads(reply.answer) == json.loads(ANSWER)
        assert ways(server) == expected and reply.requests == len(expected)
        assert asked.settings["output"] == expected[-1]
        again = ask(asked).reply
        assert again is not None and again.requests == 1, "what was rejected once is not tried again"


def test_where_every_way_is_rejected_it_fails() -> None:
    with replying(respond=rejecting(NATIVE, TOOL, PROMPTED)) as server:
        asked = model(server)
        outcome = ask(asked)
        assert outcome.failure is Failure.REJECTED and ways(server) == [NATIVE, TOOL, PROMPTED]
        assert outcome.error is not None and outcome.error.requests == 3
        assert ask(asked).failure is Failure.REJECTED and len(server.bodies) == 6, "the way of asking was not to blame"


OTHERWISE = [
    (402, {"message": "no credits left, tools or not"}, Failure.UNAUTHORISED),
    (429, {"message": "check your plan", "code": "insufficient_quota"}, Failure.UNAUTHORISED),
    (400, {"message": "maximum context length is 8192 tokens, 300 in the functions"}, Failure.REJECTED),
    (400, {"message": "the tools are too long", "code": "context_length_exceeded"}, Failure.REJECTED),
    (404, {"message": "there is no model 'tool-schema'", "code": "model_not_found"}, Failure.REJECTED),
    (400, {"message": "there is no such model", "code": "model_not_found"}, Failure.REJECTED),
    (400, {"message": "temperature must be 1"}, Failure.REJECTED),
    (413, {"message": "too large"}, Failure.REJECTED),
]


@pytest.mark.parametrize(("status", "error", "failure"), OTHERWISE, ids=lambda value: str(value)[:40])
def test_what_another_way_cannot_cure_is_asked_once_and_changes_nothing(
    status: int, error: dict[str, str], failure: Failure
) -> None:
    with replying(status, json.dumps({"error": error}).encode()) as server:
        asked = model(server)
        outcome = ask(RetryingModel(asked))
        assert outcome.failure is failure and error["message"] in str(outcome.error)
        assert ways(server) == [NATIVE] and asked.settings["output"] == NATIVE


def test_a_way_is_given_up_only_where_the_next_one_answers() -> None:
    """The server fails while the next way is tried: nobody knows yet whether that one is better."""
    for status, body in ((500, b"{}"), (402, b"{}"), (200, b"not JSON")):
        reject = rejecting(NATIVE)
        with replying(respond=lambda r: reject(r) if way(r) == NATIVE else (status, body)) as server:  # noqa: B023
            asked = model(server)
            assert ask(asked).failure is not None and ways(server) == [NATIVE, TOOL]
            assert asked.settings["output"] == (TOOL if status == 200 else NATIVE)


def test_being_called_off_on_the_way_gives_up_nothing() -> None:
    reject, on_the_way, go_on = rejecting(NATIVE), threading.Event(), threading.Event()

    def respond(request: dict[str, Any]) -> tuple[int, bytes]:
        if way(request) == TOOL:
            on_the_way.set()
            go_on.wait(60.0)
        return reject(request)

    async def called_off(model: LanguageModel) -> None:
        asking = asyncio.create_task(model.ask(QUESTION, 60.0))
        await asyncio.to_thread(on_the_way.wait, 60.0)
        asking.cancel()
        with pytest.raises(asyncio.CancelledError):
            await asking

    with replying(respond=respond) as server:
        asked = model(server)
        asyncio.run(called_off(RetryingModel(asked)))
        assert ways(server) == [NATIVE, TOOL] and asked.settings["output"] == NATIVE
        go_on.set()


def test_the_schema_is_in_every_way_of_asking() -> None:
    with replying(respond=rejecting(NATIVE, TOOL)) as server:
        ask(model(server))
    native, tool, prompted = (json.loads(body) for body in server.bodies)
    assert native["response_format"]["json_schema"]["schema"] == SCHEMA
    assert native["response_format"]["json_schema"]["strict"] is True
    assert tool["tools"][0]["function"]["parameters"] == SCHEMA and tool["tool_choice"] != "auto"
    assert json.dumps(SCHEMA) in prompted["messages"][0]["content"]
    for request in (native, tool, prompted):
        system, user = request["messages"]
        assert QUESTION.system in system["content"] and user["content"] == QUESTION.prompt
        assert (system["role"], user["role"]) == ("system", "user")


@pytest.mark.parametrize(("sampling", "temperature", "seed"), [
    (Sampling(), 0.0, None), (Sampling(0.7, 11), 0.7, 11), (Sampling(None, None), None, None),
])  # fmt: skip
def test_sampling_is_asked_for_as_it_is_recorded(sampling: Sampling, temperature: float, seed: int) -> None:
    with replying(respond=rejecting()) as server:
        asked = model(server, sampling)
        ask(asked)
    request = json.loads(server.bodies[0])
    assert request.get("temperature") == temperature == asked.settings["temperature"]
    assert request.get("seed") == seed == asked.settings["seed"]
    most = request.get("max_tokens") or request.get("max_completion_tokens")
    assert most == asked.settings["most_tokens"], "an answer has an end"


def test_a_key_is_sent_to_the_server_and_nowhere_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOMEOSTAT_LLM_KEY", "sk-for-this-server")
    monkeypatch.setenv("OPENAI_API_KEY", "sk-of-somebody-else")
    monkeypatch.setenv("OPENAI_ORG_ID", "org-secret")
    monkeypatch.setenv("OPENAI_PROJECT_ID", "project-secret")
    monkeypatch.setenv("OPENAI_BASE_URL", "http://example.invalid/v1")
    with replying(respond=rejecting()) as server:
        assert ask(model(server)).reply is not None
    (headers,) = server.received
    assert headers["authorization"] == "Bearer sk-for-this-server"
    assert not [value for value in headers.values() if "somebody" in value or "-secret" in value]
    assert headers["user-agent"] == "homeostat"


@pytest.mark.parametrize("key", ["sk-for-this-server\n", "  sk-for-this-server\r\n"])
def test_a_key_from_a_file_is_sent_without_its_line_break(monkeypatch: pytest.MonkeyPatch, key: str) -> None:
    monkeypatch.setenv("HOMEOSTAT_LLM_KEY", key)
    with replying(respond=rejecting()) as server:
        assert ask(model(server)).reply is not None
    assert server.received[0]["authorization"] == "Bearer sk-for-this-server"


def test_proxies_of_the_environment_are_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("http_proxy", "HTTP_PROXY", "ALL_PROXY", "https_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:9")
    with replying(respond=rejecting()) as server:
        assert ask(model(server)).reply is not None


def test_ollama_and_anthropic_are_asked_in_their_own_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ANTHROPIC_API_KEY", "sk-ant-0123456789")
    with replying(respond=rejecting()) as server:
        address = ModelAddress("ollama:qwen3:8b", "ollama", "qwen3:8b", f"{server.url}/v1", "OLLAMA_API_KEY")
        reply = ask(ProviderModel(address, LOCAL, Sampling())).reply
        assert reply is not None and json.loads(reply.answer) == json.loads(ANSWER)

    def respond(request: dict[str, Any]) -> tuple[int, bytes]:
        block: dict[str, Any] = {"type": "text", "text": ANSWER}
        if request.get("tools"):
            block = {"type": "tool_use", "id": "t1", "name": request["tools"][0]["name"], "input": json.loads(ANSWER)}
        usage = {"input_tokens": 1000, "output_tokens": 100}
        return 200, json.dumps(
            {"id": "m1", "type": "message", "role": "assistant", "model": "claude-x", "content": [block],
             "stop_reason": "end_turn", "stop_sequence": None, "usage": usage}
        ).encode()  # fmt: skip

    with replying(respond=respond) as server:
        address = ModelAddress("anthropic:claude-x", "anthropic", "claude-x", server.url, "ANTHROPIC_API_KEY")
        reply = ask(ProviderModel(address, LOCAL, Sampling())).reply
        assert reply is not None and json.loads(reply.answer) == json.loads(ANSWER)
        assert (reply.served, reply.usage.input_tokens, reply.usage.output_tokens) == ("claude-x", 1000, 100)
        headers = server.received[0]
        assert "sk-ant-0123456789" in headers.get("authorization", "") + headers.get("x-api-key", "")


@pytest.mark.parametrize("address", ["openai:gpt-4.1-mini", "anthropic:claude-x"])
def test_a_model_that_needs_a_key_is_refused_without(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    where = parse_address(address)
    monkeypatch.delenv(where.key_variable, raising=False)
    for _ in range(2):
        with pytest.raises(ModelError, match=where.key_variable) as refused:
            ProviderModel(where, AddressPolicy(), Sampling())
        assert refused.value.failure is Failure.UNAUTHORISED and refused.value.requests == 0
        monkeypatch.setenv(where.key_variable, " \n")


# --- a real model -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def server() -> Iterator[str]:
    with hostile() as url:
        ask(ProviderModel(parse_address(f"{url}#valid"), LOCAL, Sampling()), 60.0, question())
        yield url


@pytest.fixture(scope="module")
def random_weights() -> Iterator[str]:
    with random_model(seed=5) as url:
        yield url


def forwarding(url: str) -> Callable[[dict[str, Any]], tuple[int, bytes]]:
    """A server that has tools but no schemas, before one that has both."""

    def respond(request: dict[str, Any]) -> tuple[int, bytes]:
        if way(request) == NATIVE:
            return 400, b'{"error": {"message": "response_format is not supported"}}'
        sent = urllib.request.Request(
            f"{url}/chat/completions", json.dumps(request).encode(), {"Content-Type": "application/json"}
        )
        with urllib.request.urlopen(sent, timeout=60.0) as response:
            return 200, response.read()

    return respond


@pytest.mark.parametrize("output", [NATIVE, TOOL])
def test_a_model_that_decodes_along_the_schema_gives_answers_of_the_type(random_weights: str, output: str) -> None:
    planning, action = questions("cool_stuck_closed")[:2]
    options: Any = planning.schema["properties"]["path"]["enum"]  # type: ignore[index]
    doubt: Any = planning.schema["properties"]["doubt"]["anyOf"][0]  # type: ignore[index]
    doubted = doubt["properties"]["about"]["enum"]
    choices = next(s for s in STATES if s.name == "reduced_load").open_setpoints
    with replying(respond=forwarding(random_weights)) as server:
        url = random_weights if output == NATIVE else f"{server.url}/v1"
        asked = ProviderModel(parse_address(f"{url}#random-weights"), LOCAL, Sampling(1.0))
        for _ in range(3):
            for about, kind in ((planning, planning_type(options[:-1], doubted)), (action, action_type(choices, TAGS))):
                outcome = ask(RetryingModel(asked), 20.0, about)
                reply = outcome.reply
                if reply is None and "cut off" in str(outcome.error):
                    continue  # this server ends after 1024 tokens, and random weights may babble on
                assert reply is not None, outcome
                assert reply.served == "random-weights" and reply.usage.input_tokens > 1000
                assert not isinstance(read(kind, reply.answer), Unusable), reply.answer
        assert asked.settings["output"] == output


class TestProviderModel(ModelContract):
    """Over a connection it is a model like any other."""

    @pytest.fixture
    def make(self, server: str) -> Callable[[], LanguageModel]:
        return lambda: ProviderModel(parse_address(f"{server}#valid"), LOCAL, Sampling())
