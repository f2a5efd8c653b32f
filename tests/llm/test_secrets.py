"""Secrets: a key goes nowhere, however it is spelled, hidden or cut."""

from __future__ import annotations

import asyncio
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.agents.language.scripts import reasonable
from homeostat.agents.roles import AskingProtocol
from homeostat.domain.advice import Advice
from homeostat.domain.quotation import quoted
from homeostat.journal import MemoryTrace
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.journal.calls import ModelCalled
from homeostat.journal.encode import canonical, encode
from homeostat.llm.model import STRUCK_OUT, Failure, ModelError, Question, Reply, Usage
from homeostat.llm.providers import failure_of
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.secrets import SHORTEST_KEY, Secrets
from homeostat.plants.wired.assembly import Language, Workbench
from homeostat.twin.twin import Twin
from tests.agents.language.situations import simulation, situation
from tests.agents.stuck_valve import grounding
from tests.llm.asking import QUESTION, Says, ask, question
from tests.twin.followed import reactor

KEY = "sk-proj/0123456789AbCd"
ESCAPED = "".join(f"\\u{ord(c):04x}" for c in KEY)
WIDE = "".join(chr(ord(c) + 0xFEE0) for c in KEY)
SPELLINGS = [KEY, ESCAPED, WIDE, KEY.replace("/", "\\/"), "\u200b".join(KEY), f"{ESCAPED[:30]}{KEY[5:]}",
             "".join(f"\\u{ord(c):04X}" for c in WIDE)]  # fmt: skip


def told(text: str) -> list[str]:
    """What a text may become on its way through the loop: parsed, quoted, or both."""
    forms = [text, quoted(text, 10_000)]
    try:
        decoded = json.dumps(json.loads(text), ensure_ascii=False)
    except ValueError:
        return forms
    return [*forms, decoded, quoted(decoded, 10_000)]


@pytest.mark.parametrize("spelled", SPELLINGS, ids=ascii)
def test_a_key_is_struck_out_however_it_is_spelled(spelled: str) -> None:
    twice = f'{{"hint": "it is {spelled}, twice {spelled}"}}'
    for text in (spelled, f'{{"{spelled}": 1}}', twice, f"```json {spelled}"):
        struck = Secrets([f" {KEY}\n"]).strike(text)
        assert STRUCK_OUT in struck and not any(KEY in form for form in told(struck))


@pytest.mark.parametrize("key", ['pa"ss\\word', "it's-a-key", "a\\\\b/c-d"])
def test_a_key_with_signs_that_are_escaped_is_struck_out(key: str) -> None:
    for text in (json.dumps({"a": key}), json.dumps(json.dumps(key)), repr({"message": key}), repr(json.dumps(key))):
        struck = Secrets([key]).strike(text)
        assert STRUCK_OUT in struck and not any(key in form for form in told(struck))


@given(st.text(max_size=200))
def test_a_text_without_a_key_stays_as_it_is(text: str) -> None:
    assert Secrets([KEY, "x" * (SHORTEST_KEY - 1)]).strike(text) == text


def recorded(outcome: Reply | BaseException, asked: Question = QUESTION) -> tuple[str, ModelCalled]:
    class Answering(Says):
        async def ask(self, question: Question, within_s: float) -> Reply:
            if isinstance(outcome, BaseException):
                raise outcome
            return outcome

    trace = MemoryTrace()
    found = ask(RecordedModel(Answering(), trace, MemoryArchive(), (KEY,)), about=asked)
    (event,) = trace.of(ModelCalled)
    line = canonical(encode(event)) + (found.reply.answer if found.reply else str(found.error))
    return line, event


class Refusing(ModelError):
    """A failure in the words of a server."""

    def __init__(self, detail: str) -> None:
        super().__init__(Failure.REFUSAL, detail)


@pytest.mark.parametrize("spelled", SPELLINGS, ids=ascii)
@pytest.mark.parametrize("before", [0, 150, 225, 238])
def test_half_a_key_is_not_left_where_a_reason_is_cut(spelled: str, before: int) -> None:
    for outcome in (Refusing("x" * before + spelled), ValueError("x" * before + spelled)):
        line, event = recorded(outcome)
        assert KEY[:8] not in line and KEY[-8:] not in line and len(event.detail) < 400


def test_a_key_that_only_quoting_puts_together_is_not_told() -> None:
    outcome = Reply("{}", KEY.replace("-", "---"), Usage(1, 1, None))
    line, event = recorded(outcome)
    assert KEY not in line and event.served == STRUCK_OUT


@pytest.mark.parametrize("before", range(150, 210, 10))
def test_a_failure_is_not_cut_before_every_key_is_known(before: int) -> None:
    other = "another-key-0123456789-0123456789"
    said = failure_of(ValueError("x" * before + f"{ESCAPED} {other}"), KEY).detail
    assert KEY[:8] not in said and ESCAPED[:12] not in said and said.endswith(other)


@pytest.mark.parametrize("before", range(260, 310, 5))
def test_half_a_key_is_not_left_where_a_prompt_cuts_a_note(monkeypatch: pytest.MonkeyPatch, before: int) -> None:
    monkeypatch.setenv("HOMEOSTAT_LLM_KEY", KEY)
    fault, plant = "cool_stuck_closed", reactor()
    model = ScriptedModel("scripted:reasonable", reasonable)
    language = Language(model, (f"{'x' * before}{KEY}",))
    twin = Twin(plant.model, plant.description, plant.twin, seed=1)
    sides = grounding(), simulation(fault), MemoryTrace(), MemoryArchive()
    proposer = Workbench(plant, twin, *sides, AskingProtocol.ROUTE, language).speaking()
    asyncio.run(proposer.planning.plan(situation(fault), Advice()))
    assert "x" * 200 in model.asked[0].prompt and KEY[:4] not in model.asked[0].prompt


def test_a_key_in_a_note_is_not_asked_about() -> None:
    trace = MemoryTrace()
    seen: list[Question] = []

    class Listening(Says):
        async def ask(self, question: Question, within_s: float) -> Reply:
            seen.append(question)
            return await super().ask(question, within_s)

    model = Listening(Reply("{}", "m", Usage(1, 1, None)))
    ask(RecordedModel(model, trace, MemoryArchive(), (KEY,)), about=question(prompt=f"note: {KEY}", system=KEY))
    assert seen[0].prompt == f"note: {STRUCK_OUT}" and seen[0].system == STRUCK_OUT
