"""Models behind an HTTP interface, in the cloud or beside the plant, and what their failures stand for."""

import asyncio
import json
import math
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Final

import httpx2
from anthropic import AsyncAnthropic
from openai import AsyncOpenAI
from pydantic_ai import direct
from pydantic_ai import exceptions as library
from pydantic_ai.exceptions import UsageExtractionFailedWarning
from pydantic_ai.messages import ModelRequest, ModelResponse, SystemPromptPart, TextPart, ToolCallPart, UserPromptPart
from pydantic_ai.models import Model, ModelRequestParameters
from pydantic_ai.models.anthropic import AnthropicModel
from pydantic_ai.models.openai import OpenAIChatModel
from pydantic_ai.output import OutputObjectDefinition
from pydantic_ai.providers.anthropic import AnthropicProvider
from pydantic_ai.providers.ollama import OllamaProvider
from pydantic_ai.providers.openai import OpenAIProvider
from pydantic_ai.settings import ModelSettings
from pydantic_ai.tools import ToolDefinition

from homeostat.llm.address import ANTHROPIC, OLLAMA, ModelAddress
from homeostat.llm.model import ANSWERED, Failure, ModelError, Question, Reply, Usage
from homeostat.llm.network import AddressPolicy, GuardedTransport
from homeostat.llm.secrets import Secrets

_KINDS: tuple[tuple[type[Exception], Failure], ...] = (
    (library.ModelRequestTimeout, Failure.TIMEOUT),
    (library.ModelTimeoutError, Failure.TIMEOUT),
    (library.ModelRateLimitError, Failure.RATE_LIMITED),
    (library.ModelQuotaExceededError, Failure.UNAUTHORISED),
    (library.ModelAuthenticationError, Failure.UNAUTHORISED),
    (library.ModelUnavailableError, Failure.SERVER_ERROR),
    (library.ModelServerError, Failure.SERVER_ERROR),
    (library.ModelConnectionError, Failure.UNREACHABLE),
    (library.ModelRequestRejectedError, Failure.REJECTED),
    (library.ContentFilterError, Failure.REFUSAL),
    (library.OutputTokenLimitExceeded, Failure.TRUNCATED),
    (library.UnexpectedModelBehavior, Failure.MALFORMED),
    (asyncio.TimeoutError, Failure.TIMEOUT),
)
"""The first that fits counts, so a special case stands before the general one."""
_WAY: Final = re.compile(
    r"response_?format|json.?(object|mode)|schema|structured|guided|grammar|output_(format|config)|tool|functions?\b",
    re.IGNORECASE,
)
"""What a server says where it does not know a way of asking for JSON."""
_OTHERWISE: Final = (
    *(library.ModelContextWindowExceededError, library.ModelNotFoundError, library.ModelAuthenticationError),
    *(library.ModelQuotaExceededError, library.ModelRateLimitError, library.ModelUnavailableError),
)
"""What no other way of asking for JSON would cure, whatever words it is said in."""


class WayRejected(ModelError):
    """The server rejects the way in which JSON was asked for; another way may do."""


def failure_of(error: Exception, secret: str) -> ModelError:
    """The failure that ``error`` stands for, ``secret`` struck out; what no rule knows could not be read."""
    cause: BaseException | None = error
    while cause is not None:  # client libraries wrap what the transport raised
        if isinstance(cause, ModelError):
            return cause
        cause = cause.__cause__
    detail = _one_line(error, secret)
    wait_s = error.retry_after if isinstance(error, library.ModelAPIError) else None
    if _is_about_the_way(error):
        return WayRejected(Failure.REJECTED, detail, wait_s)
    for kind, failure in _KINDS:
        if isinstance(error, kind):
            return ModelError(failure, detail, wait_s)
    if isinstance(error, library.ModelHTTPError):
        known = Failure.SERVER_ERROR if error.status_code >= 500 else Failure.REJECTED
        return ModelError(known, detail, wait_s)
    return ModelError(Failure.MALFORMED, detail)


def _is_about_the_way(error: Exception) -> bool:
    """Whether a server says, by status and in words, that it does not know how it was asked for JSON."""
    if isinstance(error, _OTHERWISE) or not isinstance(error, library.ModelHTTPError):
        return False
    return error.status_code in (400, 422) and _WAY.search(str(error.body)) is not None


def _one_line(error: Exception, secret: str) -> str:
    """The whole error. It is not cut here: half a key could not be recognised by those who know the other keys."""
    return Secrets([secret]).strike(" ".join(f"{type(error).__name__}: {error}".split()))


NATIVE, TOOL, PROMPTED = "native", "tool", "prompted"
"""Ways to get an answer that fits a schema, the strictest first."""
NO_KEY: Final = "none"
"""What is sent where the environment has no key: servers beside the plant want something there."""
MOST_TOKENS: Final = 2400
"""Longest answer that is asked for [tokens]."""


@dataclass(frozen=True, slots=True)
class Sampling:
    """How a model is asked to choose its words."""

    temperature: float | None = 0.0
    """Temperature [1]; None leaves it to the server."""
    seed: int | None = None
    """Seed of the server's sampling, where it has one; None for none."""


class ProviderModel:
    """Implements :class:`homeostat.llm.model.LanguageModel` over HTTP; nothing is kept open between questions."""

    def __init__(self, address: ModelAddress, policy: AddressPolicy, sampling: Sampling) -> None:
        """Ask the model at ``address``; ModelError where ``policy`` does not allow it or its key is missing."""
        policy.check(address.url)
        key = address.key()
        if address.needs_key and not key:
            raise ModelError(
                Failure.UNAUTHORISED,
                f"{address.text!r} needs a key in the environment: {address.key_variable}",
                requests=0,
            )
        self.name = address.text
        """Name under which it was asked for."""
        self._address, self._policy, self._sampling, self._key = address, policy, sampling, key
        self._modes = [NATIVE, TOOL, PROMPTED]

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        """How it samples, and how it is made to answer in the schema."""
        return {**asdict(self._sampling), "most_tokens": MOST_TOKENS, "output": self._modes[0]}

    async def ask(self, question: Question, within_s: float) -> Reply:
        """The answer to ``question``; where the server rejects one way of asking for JSON, the next is tried."""
        requests, modes = 0, list(self._modes)
        while True:
            requests += 1
            try:
                reply = self._reply(await self._request(question, within_s, modes), requests)
                break
            except ModelError as error:
                if isinstance(error, WayRejected) and len(modes) > 1:
                    modes.pop(0)
                    continue
                error.requests = requests
                if error.failure in ANSWERED:
                    self._modes = modes
                raise
        self._modes = modes  # not before: where nobody answers, it was not the way of asking that was wrong
        return reply

    async def _request(self, question: Question, within_s: float, modes: list[str]) -> ModelResponse:
        settings = ModelSettings(max_tokens=MOST_TOKENS, timeout=within_s, request_timeout=within_s)
        if self._sampling.temperature is not None:
            settings["temperature"] = self._sampling.temperature
        if self._sampling.seed is not None:
            settings["seed"] = self._sampling.seed
        async with httpx2.AsyncClient(
            transport=GuardedTransport(self._policy, self._authorisation()),
            follow_redirects=False,
            trust_env=False,
            timeout=within_s,
        ) as client:
            try:
                model = self._model(client)
                mode = _supported(model, modes)
                system = question.system if mode != PROMPTED else f"{question.system}\n\n{_prompted(question)}"
                messages = [ModelRequest(parts=[SystemPromptPart(system), UserPromptPart(question.prompt)])]
                with _unreadable_usage_is_no_news():
                    return await direct.model_request(
                        model, messages, model_settings=settings, model_request_parameters=_parameters(mode, question)
                    )
            except Exception as error:  # a model is outside the system: whatever it makes a library raise is a failure
                raise failure_of(error, self._key) from None

    def _authorisation(self) -> dict[str, str]:
        key = self._key or NO_KEY
        return {"x-api-key": key} if self._address.provider == ANTHROPIC else {"Authorization": f"Bearer {key}"}

    def _model(self, client: httpx2.AsyncClient) -> Model:
        url, name = self._address.url, self._address.model
        if self._address.provider == ANTHROPIC:
            anthropic = AsyncAnthropic(api_key=self._key or NO_KEY, base_url=url, http_client=client, max_retries=0)
            return AnthropicModel(name, provider=AnthropicProvider(anthropic_client=anthropic))
        openai = AsyncOpenAI(api_key=self._key or NO_KEY, base_url=url, http_client=client, max_retries=0)
        if self._address.provider == OLLAMA:
            return OpenAIChatModel(name, provider=OllamaProvider(openai_client=openai))
        return OpenAIChatModel(name, provider=OpenAIProvider(openai_client=openai))

    def _reply(self, response: ModelResponse, requests: int) -> Reply:
        if response.finish_reason == "content_filter":
            raise ModelError(Failure.REFUSAL, str((response.provider_details or {}).get("refusal", "")))
        if response.finish_reason == "length":
            raise ModelError(Failure.TRUNCATED, f"at {response.usage.output_tokens} tokens")
        called = [part.args_as_json_str() for part in response.parts if isinstance(part, ToolCallPart)]
        texts = [part.content for part in response.parts if isinstance(part, TextPart)]
        answer = called[0] if called else "".join(texts)
        if not answer.strip():
            raise ModelError(Failure.EMPTY)
        usage = Usage(_count(response.usage.input_tokens), _count(response.usage.output_tokens), _cost(response))
        return Reply(answer, response.model_name or "", usage, requests)


def _supported(model: Model, modes: list[str]) -> str:
    """The strictest way that is left in ``modes`` and that the library knows this model to have."""
    if modes[0] == NATIVE and not model.profile.get("supports_json_schema_output", False):
        modes.pop(0)
    return modes[0]


def _parameters(mode: str, question: Question) -> ModelRequestParameters:
    name, schema = f"{question.agent}_answer", dict(question.schema)
    if mode == NATIVE:
        wanted = OutputObjectDefinition(json_schema=schema, name=name, strict=True)
        return ModelRequestParameters(output_mode="native", output_object=wanted)
    if mode == TOOL:
        tool = ToolDefinition(name=name, description="Give the answer.", parameters_json_schema=schema, kind="output")
        return ModelRequestParameters(output_mode="tool", output_tools=[tool], allow_text_output=False)
    return ModelRequestParameters()


def _prompted(question: Question) -> str:
    return f"Answer with one JSON object and nothing else. It satisfies this schema: {json.dumps(question.schema)}"


def _cost(response: ModelResponse) -> float | None:
    """Price by the library's list [USD]; None for a model that is not in it, or where no tokens are known."""
    if not response.usage.input_tokens:
        return None
    try:
        price = float(response.cost().total_price)
    except (LookupError, ValueError, AssertionError, ArithmeticError):
        return None
    return price if math.isfinite(price) and price >= 0.0 else None


@contextmanager
def _unreadable_usage_is_no_news() -> Iterator[None]:
    """Keep from the operator's terminal that a server counts what the price list cannot read; it counts as nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UsageExtractionFailedWarning)
        yield


def _count(tokens: int) -> int:
    """What a server says that it counted, where that is possible at all."""
    return min(max(tokens, 0), 10**9)
