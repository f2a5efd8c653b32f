"""The transformer with random weights over the loopback: it knows nothing, and still every answer fits its schema."""

from __future__ import annotations

import asyncio
import json
import math
import urllib.error
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Annotated, Any, Literal

import httpx2
import numpy as np
import pytest
from openai import AsyncOpenAI
from pydantic import BaseModel, ConfigDict, Field
from pydantic_ai import Agent, NativeOutput, ToolOutput
from pydantic_ai.models.openai import OpenAIChatModel
from pydantic_ai.providers.openai import OpenAIProvider

from tests.llm.random_model.transformer import Reader, Weights
from tests.llm.servers import random_model

COUNT = 20


class Answer(BaseModel):
    """What an agent asks for, about."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)
    reasoning: Annotated[str, Field(max_length=200)]
    route: Literal["action", "planning", "none"]
    flow: Annotated[float, Field(ge=0, le=400, multiple_of=0.5)]
    temperature: Annotated[float, Field(ge=280.5, le=320, multiple_of=0.5)]
    trim: Annotated[float, Field(ge=-5, le=5, multiple_of=0.25)]
    opening: Annotated[float, Field(ge=0, le=1, multiple_of=0.125)]
    pump: Annotated[float, Field(ge=0.5, le=2, multiple_of=0.25)] | None


BOUNDS = {"flow": (0, 400, 0.5), "temperature": (280.5, 320, 0.5), "trim": (-5, 5, 0.25), "opening": (0, 1, 0.125),
          "pump": (0.5, 2, 0.25)}  # fmt: skip


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with random_model(1) as address:
        yield address


def native(schema: object = None, prompt: str = "What now?", **more: Any) -> dict[str, Any]:
    """A request for JSON."""
    wanted = {"name": "answer", "strict": True, "schema": Answer.model_json_schema() if schema is None else schema}
    return plain(prompt, response_format={"type": "json_schema", "json_schema": wanted}, **more)


def tool(**more: Any) -> dict[str, Any]:
    """A request that forces the second of two tools."""
    tools = [
        {"name": "chat", "parameters": {"enum": [1]}},
        {"name": "answer", "parameters": Answer.model_json_schema()},
    ]
    choice = {"type": "function", "function": {"name": "answer"}}
    return plain(tools=[{"type": "function", "function": t} for t in tools], tool_choice=choice, **more)


def plain(prompt: str = "What now?", **more: Any) -> dict[str, Any]:
    """A request for whatever comes."""
    return {"model": "random", "messages": [{"role": "user", "content": prompt}], **more}


def post(url: str, body: object) -> dict[str, Any]:
    """The response to one request."""
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    request = urllib.request.Request(f"{url}/chat/completions", data, {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=120) as reply:
        return dict(json.load(reply))


def content(response: dict[str, Any]) -> str:
    """The answer of a response, however it was asked for; the rest of the response is as it should be."""
    (choice,) = response["choices"]
    usage, message = response["usage"], choice["message"]
    assert response["object"] == "chat.completion" and response["id"] and response["model"] == "random-weights"
    assert usage["prompt_tokens"] > 0 and usage["completion_tokens"] > 0
    assert usage["total_tokens"] == usage["prompt_tokens"] + usage["completion_tokens"]
    if message["content"] is not None:
        assert choice["finish_reason"] == "stop"
        return str(message["content"])
    (call,) = message["tool_calls"]
    assert choice["finish_reason"] == "tool_calls" and call["type"] == "function" and call["id"]
    assert call["function"]["name"] == "answer", "the tool that was forced"
    return str(call["function"]["arguments"])


def fits(text: str) -> bool:
    """Whether ``text`` is an answer, found out twice: by the type, and by hand."""
    Answer.model_validate_json(text)
    value = json.loads(text)
    assert set(value) == {"reasoning", "route", *BOUNDS} and value["route"] in ("action", "planning", "none")
    assert len(value["reasoning"]) <= 200 and text.isprintable(), "a control character is escaped, never written"
    for name, (low, high, step) in BOUNDS.items():
        number = value[name]
        assert (number is None and name == "pump") or (low <= number <= high and math.fmod(number, step) == 0)
    return True


@pytest.mark.parametrize("request_of", [native, tool])
def test_every_answer_fits_its_schema(url: str, request_of: Any) -> None:
    answers = [content(post(url, request_of())) for _ in range(COUNT)]
    assert all(fits(text) for text in answers)
    assert len(set(answers)) == COUNT, "the same question, and never the same answer"
    # Random weights have their tastes: one option of an enum may get nine answers of ten, so only numbers are counted.
    assert len({json.loads(text)["flow"] for text in answers}) > COUNT / 4


@pytest.mark.parametrize("output", [NativeOutput(Answer, strict=True), ToolOutput(Answer, strict=True)])
def test_a_client_library_gets_typed_answers(url: str, output: Any) -> None:
    async def ask() -> list[Answer]:
        async with httpx2.AsyncClient(trust_env=False) as http:
            client = AsyncOpenAI(api_key="none", base_url=url, http_client=http, max_retries=0)
            model = OpenAIChatModel("random", provider=OpenAIProvider(openai_client=client))
            agent = Agent(model, output_type=output, retries=0)
            return [(await agent.run("What now?")).output for _ in range(COUNT)]

    answers = asyncio.run(ask())
    assert len({answer.model_dump_json() for answer in answers}) == COUNT
    assert all(isinstance(answer, Answer) for answer in answers)


def test_the_same_seed_gives_the_same_answers(url: str) -> None:
    with random_model(1) as again, random_model(1) as once_more, random_model(2) as other:
        first, same = ([content(post(u, native())) for _ in range(3)] for u in (again, once_more))
        assert first == same, "the same model, asked for the first, second and third time"
        assert len({*first, *(content(post(other, native())) for _ in range(3))}) == 6, "another model"
    seeded = [content(post(url, native(seed=seed))) for seed in (7, 8, 7)]
    assert seeded[0] == seeded[2] != seeded[1], "the seed of a request counts more than how often it was asked"


def test_the_answer_depends_on_the_prompt(url: str) -> None:
    assert len({content(post(url, native(prompt=text, seed=3))) for text in ("valve", "pump", "?")}) == 3
    assert fits(content(post(url, native(prompt="ü \ud83d\ude00 \x00" * 5000)))), "however long and odd"


@pytest.mark.parametrize("name", ["max_tokens", "max_completion_tokens"])
def test_the_longest_answer_is_bounded(url: str, name: str) -> None:
    response = post(url, native() | {name: 5})
    (choice,) = response["choices"]
    assert choice["finish_reason"] == "length" and response["usage"]["completion_tokens"] == 5
    assert '{"reasoning":"'.startswith(choice["message"]["content"]) and len(choice["message"]["content"]) == 5
    free = post(url, plain() | {name: 30})
    assert len(free["choices"][0]["message"]["content"]) <= 30 and free["usage"]["completion_tokens"] <= 30
    endless = {"type": "object", "properties": {"text": {"type": "string"}}, "required": ["text"]}
    assert post(url, native(endless))["usage"]["completion_tokens"] <= 1024, "also where nobody asked for it"


def test_an_option_may_have_an_umlaut(url: str) -> None:
    """Such bytes are never chosen freely, yet an option must stay possible."""
    assert content(post(url, native({"enum": ["Kühlung « »"]}))) == '"Kühlung « »"'


@pytest.mark.parametrize(
    "body",
    [b"{", b"[]", b'{"model": "random"}', json.dumps(native({"type": "nonsense"})).encode(),
     json.dumps(native({"type": "number", "minimum": 2, "maximum": 1})).encode()],
)  # fmt: skip
def test_what_cannot_be_answered_is_rejected(url: str, body: bytes) -> None:
    """An empty answer would look like a model's, and be counted as one."""
    with pytest.raises(urllib.error.HTTPError) as error:
        post(url, body)
    with error.value as reply:
        assert reply.code == 400 and json.load(reply)["error"]["message"]


def test_questions_may_come_at_once(url: str) -> None:
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: content(post(url, native())), range(16)))
    assert all(fits(text) for text in answers) and len(set(answers)) == 16


def test_its_models_are_listed(url: str) -> None:
    with urllib.request.urlopen(f"{url}/models", timeout=120) as reply:
        assert [model["id"] for model in json.load(reply)["data"]] == ["random-weights"]


def test_reading_one_by_one_is_reading_at_once() -> None:
    """What was kept of earlier tokens gives what reading them all again would, and a later token changes no earlier."""
    weights, text = Weights(3), list(b"The cooling valve is stuck.")
    whole, one_by_one = Reader(weights), Reader(weights)
    at_once = whole.read(text)
    steps = [one_by_one.read([token]) for token in text]
    assert np.allclose(steps[-1], at_once, atol=1e-4)
    assert all(not np.allclose(a, b, atol=1e-2) for a, b in pairwise(steps)), "every token counts"
    halves = Reader(weights)
    halves.read(text[:10])
    assert np.allclose(halves.read(text[10:]), at_once, atol=1e-4)
