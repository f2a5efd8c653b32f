"""Models that are not ours: whatever they give back, the loop gets a reply or a model error, and a record of it."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping

import pytest

from homeostat.journal import MemoryTrace, Setting
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.journal.calls import ModelCalled
from homeostat.journal.encode import canonical, encode
from homeostat.llm.model import STRUCK_OUT, Failure, ModelError, Question, Reply, Usage
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.retry import RetryingModel
from homeostat.llm.scripted import ScriptedModel
from tests.llm.asking import ANSWER, Says, ask

KEY = "sk-proj/0123456789AbCd"


class Stranger:
    """A model of somebody else, with whatever it has in place of settings and replies."""

    def __init__(self, reply: object = ANSWER, settings: object = None) -> None:
        self._reply = reply
        self._settings = settings

    @property
    def name(self) -> str:
        return "stranger"

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        if isinstance(self._settings, Exception):
            raise self._settings
        return self._settings  # type: ignore[return-value]

    async def ask(self, question: Question, within_s: float) -> Reply:
        if isinstance(self._reply, Exception):
            raise self._reply
        return self._reply  # type: ignore[return-value]


def event(trace: MemoryTrace) -> ModelCalled:
    """The one event, which a journal can hold."""
    (found,) = trace.of(ModelCalled)
    assert canonical(encode(found))
    return found


NONSENSE = [
    None, "text", 7, Reply(None, "m", Usage(1, 1, None)), Reply("{}", None, Usage(1, 1, None)),  # type: ignore[arg-type]
    Reply("{}", "m", Usage(1, 1, "")), Reply("{}", "m", Usage(1, 1, True)), Reply("{}", "m", Usage(1.5, 1, None)),  # type: ignore[arg-type]
    Reply("{}", "m", Usage(10**30, 1, None)), Reply("{}", "m", Usage(1, 1, 10.0**300)),
    Reply("{}", "m", Usage(1, 1, None), -1), ModelError(Failure.MALFORMED, None, None, None),  # type: ignore[arg-type]
    Reply("{}", "m", Usage(1, 1, float("nan"))), Reply("{}", "m", Usage(-1, 1, None)), Reply("{}", "m", None),  # type: ignore[arg-type]
]  # fmt: skip


@pytest.mark.parametrize("reply", NONSENSE, ids=repr)
def test_what_is_no_reply_is_a_failure_like_any_other(reply: object) -> None:
    trace = MemoryTrace()
    outcome = ask(RecordedModel(Stranger(reply, {}), trace, MemoryArchive()))
    assert outcome.failure is Failure.MALFORMED and "\n" not in str(outcome.error)
    assert event(trace).failure == "MALFORMED" and event(trace).wall_requests == 1


SETTINGS: list[tuple[object, tuple[Setting, ...]]] = [
    ({"a": math.inf, "b": math.nan, "c": None}, (Setting("a", "inf"), Setting("b", "nan"))),
    ({"a": [1, 2]}, (Setting("a", "[1, 2]"),)),
    ({1: {"x": 2}}, (Setting("1", "{'x': 2}"),)),
    ({"a": 10.0**300, "b": 10**30}, (Setting("a", "1e+300"), Setting("b", "1" + "0" * 30))),
    ({"a": "two\nlines\x1b", "key": KEY}, (Setting("a", "two lines"), Setting("key", STRUCK_OUT))),
    ({"a": 10**5000}, ()),
    (None, ()),
    (RuntimeError("no settings"), ()),
]


@pytest.mark.parametrize(
    ("given", "told"), SETTINGS, ids=lambda value: repr(value)[:40] if value != SETTINGS[5][0] else "long"
)
def test_settings_are_told_as_a_trace_can_hold_them(given: object, told: tuple[Setting, ...]) -> None:
    trace = MemoryTrace()
    outcome = ask(RecordedModel(Stranger(settings=given), trace, MemoryArchive(), (KEY,)))
    assert outcome.reply == ANSWER and event(trace).settings == told


@pytest.mark.parametrize(
    "model", [ScriptedModel("slow", lambda asked: "late", delay_s=60.0), Says(ANSWER, delay_s=math.inf)]
)
def test_no_model_takes_more_time_than_it_has(model: ScriptedModel | Says) -> None:
    trace = MemoryTrace()
    outcome = ask(RecordedModel(model, trace, MemoryArchive()), 0.2)
    assert outcome.failure is Failure.TIMEOUT and event(trace).failure == "TIMEOUT"


def test_a_model_that_keeps_the_time_itself_says_how_it_used_it() -> None:
    class Losing(Stranger):
        asked = 0

        async def ask(self, question: Question, within_s: float) -> Reply:
            self.asked += 1
            if self.asked == 1:
                raise ModelError(Failure.UNREACHABLE)
            await asyncio.Event().wait()
            raise AssertionError

    trace = MemoryTrace()
    assert (
        ask(RecordedModel(RetryingModel(Losing(settings={})), trace, MemoryArchive()), 1.0).failure is Failure.TIMEOUT
    )
    assert event(trace).wall_requests == 2
