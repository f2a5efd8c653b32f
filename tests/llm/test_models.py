"""Every model that needs no server against the contract."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from homeostat.journal import MemoryTrace
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.llm.calls import Call
from homeostat.llm.model import Failure, LanguageModel, ModelError, Question
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.replay import ReplayModel, SituatedReplay
from homeostat.llm.retry import RetryingModel
from homeostat.llm.scripted import ScriptedModel
from tests.llm.asking import ANSWER, QUESTION, Says
from tests.llm.model_contract import AGENTS, ModelContract


def calls() -> list[Call]:
    """Two recorded answers for every agent, one of them a failure."""
    return [
        Call(
            agent=agent, at_s=1.0, model="m", served="m", system=QUESTION.system, prompt=QUESTION.prompt, schema={},
            answer=None if failure else "{}", failure=failure, detail="", input_tokens=1, output_tokens=1,
            cost_usd=None, latency_s=0.1,
        )
        for agent in AGENTS
        for failure in (None, Failure.TRUNCATED)
    ]  # fmt: skip


def moody(question: Question) -> str:
    """Answers most of the time."""
    if question.prompt.endswith(("3", "7")):
        raise ModelError(Failure.SERVER_ERROR)
    return "{}"


class TestScriptedModel(ModelContract):
    @pytest.fixture
    def make(self) -> Callable[[], LanguageModel]:
        return lambda: ScriptedModel("scripted:moody", moody)


class TestSlowScriptedModel(ModelContract):
    @pytest.fixture
    def make(self) -> Callable[[], LanguageModel]:
        return lambda: ScriptedModel("scripted:slow", moody, delay_s=0.02)


class TestReplayModel(ModelContract):
    @pytest.fixture
    def make(self) -> Callable[[], LanguageModel]:
        return lambda: ReplayModel("replay:calls.jsonl", calls())


class TestSituatedReplay(ModelContract):
    @pytest.fixture
    def make(self) -> Callable[[], LanguageModel]:
        return lambda: SituatedReplay("situated:calls.jsonl", calls())


class TestRetryingModel(ModelContract):
    @pytest.fixture
    def make(self) -> Callable[[], LanguageModel]:
        return lambda: RetryingModel(Says(ANSWER, ModelError(Failure.REFUSAL), TimeoutError()))


class TestRecordedModel(ModelContract):
    @pytest.fixture
    def make(self, tmp_path_factory: pytest.TempPathFactory) -> Callable[[], LanguageModel]:
        file = tmp_path_factory.mktemp("recorded") / "calls.jsonl"
        inner = Says(ANSWER, ModelError(Failure.REFUSAL), RuntimeError("a bug"), ANSWER)
        return lambda: RecordedModel(inner, MemoryTrace(), MemoryArchive(), ("secret-key",), file)


class TestEverythingAtOnce(ModelContract):
    """As a run wires it: a recorded, patient model that follows recorded calls."""

    @pytest.fixture
    def make(self) -> Callable[[], LanguageModel]:
        return lambda: RecordedModel(RetryingModel(ReplayModel("replay:f", calls())), MemoryTrace(), MemoryArchive())
