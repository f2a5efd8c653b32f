"""Whatever comes of asking goes to the trace and to the file, and no key goes with it."""

from __future__ import annotations

import asyncio
import hashlib
import json
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.journal import MemoryTrace, Setting
from homeostat.journal.beside.archive import MemoryArchive
from homeostat.journal.calls import ModelCalled
from homeostat.llm.calls import Call, read_calls
from homeostat.llm.model import STRUCK_OUT, Failure, ModelError, Reply, Usage
from homeostat.llm.recorded import RecordedModel
from homeostat.llm.replay import ReplayModel
from homeostat.llm.scripted import ScriptedModel
from homeostat.llm.secrets import SHORTEST_KEY
from homeostat.record.directory import RunDirectory
from homeostat.record.texts import ANSWERS, PROMPTS
from tests.llm.asking import ANSWER, QUESTION, Outcome, Says, ask, asked

KEY = "sk-very-secret-0123456789"


def recorded(
    *outcomes: Reply | BaseException, secrets: Sequence[str] = (KEY,), file: Path | None = None
) -> tuple[Outcome, MemoryTrace]:
    """Ask once through a recording model."""
    trace = MemoryTrace()
    outcome = ask(RecordedModel(Says(*outcomes), trace, MemoryArchive(), tuple(secrets), file))
    return outcome, trace


def event(trace: MemoryTrace) -> ModelCalled:
    (found,) = trace.of(ModelCalled)
    return found


def sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def test_an_answer_is_handed_on_and_recorded() -> None:
    outcome, trace = recorded(ANSWER)
    assert outcome.reply == ANSWER
    assert trace.entries[0].at_s == QUESTION.at_s
    told = event(trace)
    assert (told.agent, told.model, told.served) == ("action", "says:what-it-must", "served-model")
    assert told.settings == (Setting("temperature", 0.0), Setting("output", "native")), "what is not set is not told"
    assert (told.failure, told.detail) == ("", "")
    assert (told.input_tokens, told.output_tokens, told.cost_usd, told.wall_requests) == (12, 7, 0.001, 1)
    assert 0.0 <= told.wall_latency_s < 1.0
    assert told.template_sha256 == QUESTION.template_sha256
    assert told.prompt_sha256 == sha256(f"{QUESTION.system}\n\n---\n\n{QUESTION.prompt}\n")
    assert told.answer_sha256 == sha256(ANSWER.answer)


def test_the_hashes_are_the_names_of_files(tmp_path: Path) -> None:
    with RunDirectory(tmp_path / "run") as directory:
        ask(RecordedModel(Says(ANSWER), directory.journal, directory))
        trace = MemoryTrace()
        ask(RecordedModel(Says(ANSWER), trace, directory))
    told, run = event(trace), tmp_path / "run"
    prompt = (run / PROMPTS / f"{told.prompt_sha256}.md").read_text()
    assert prompt.startswith(QUESTION.system) and QUESTION.prompt in prompt
    assert json.loads((run / ANSWERS / f"{told.schema_sha256}.json").read_text()) == QUESTION.schema
    assert (run / ANSWERS / f"{told.answer_sha256}.json").read_text() == ANSWER.answer
    assert b"model-called" in (run / "events.jsonl").read_bytes()


@pytest.mark.parametrize("failure", list(Failure))
def test_a_failure_is_recorded_and_raised(failure: Failure, tmp_path: Path) -> None:
    outcome, trace = recorded(ModelError(failure, retry_after_s=3.0, requests=2), file=tmp_path / "calls")
    assert outcome.failure is failure and outcome.error is not None
    assert (outcome.error.retry_after_s, outcome.error.requests) == (3.0, 2)
    told = event(trace)
    assert (told.failure, told.served, told.answer_sha256) == (failure.name, "", "")
    assert "scripted" in told.detail and told.wall_requests == 2 and told.cost_usd is None
    (call,) = read_calls(tmp_path / "calls")
    assert (call.failure, call.answer, call.detail) == (failure, None, told.detail)


def test_a_failure_is_worded_once() -> None:
    outcome, trace = recorded(ModelError(Failure.TIMEOUT))
    assert event(trace).detail.count(Failure.TIMEOUT.value) <= 1
    assert str(outcome.error).count(Failure.TIMEOUT.value) == 1


def test_a_call_in_the_file_is_what_was_asked_and_answered(tmp_path: Path) -> None:
    file = tmp_path / "calls.jsonl"
    for _ in range(2):
        recorded(ANSWER, file=file)
    call = read_calls(file)[1]
    assert call == Call(
        agent="action", at_s=1460.0, model="says:what-it-must", served="served-model", system=QUESTION.system,
        prompt=QUESTION.prompt, schema=dict(QUESTION.schema), answer=ANSWER.answer, failure=None, detail="",
        input_tokens=12, output_tokens=7, cost_usd=0.001, latency_s=call.latency_s,
    )  # fmt: skip


def test_being_called_off_is_a_timeout_in_the_record_and_nothing_else(tmp_path: Path) -> None:
    trace, file = MemoryTrace(), tmp_path / "calls"
    model = RecordedModel(Says(ANSWER, delay_s=math.inf), trace, MemoryArchive(), (), file)

    async def call_off() -> None:
        task = asyncio.create_task(asked(model, 60.0))
        await asyncio.sleep(0.05)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task

    begin = time.monotonic()
    asyncio.run(call_off())
    assert event(trace).failure == "TIMEOUT"
    assert 0.04 < event(trace).wall_latency_s < time.monotonic() - begin
    assert read_calls(file)[0].failure is Failure.TIMEOUT


@pytest.mark.parametrize(
    "bug",
    [
        RuntimeError("oops"), KeyError("choices"), AssertionError(), RecursionError("deep"), SystemExit(0),
        asyncio.CancelledError("of its own"),
    ],
)  # fmt: skip
def test_a_bug_of_a_model_is_a_failure_of_the_model(bug: BaseException) -> None:
    outcome, trace = recorded(bug)
    assert outcome.failure is Failure.MALFORMED
    assert event(trace).failure == "MALFORMED" and type(bug).__name__ in event(trace).detail


def test_a_bug_is_told_in_one_short_line() -> None:
    outcome, trace = recorded(RuntimeError("one\ntwo\r\n" + "x" * 5000))
    assert len(event(trace).detail) < 300 and len(str(outcome.error)) < 300


def test_a_bug_is_told_without_line_breaks() -> None:
    _, trace = recorded(RuntimeError("one\ntwo\r\nthree"))
    assert not set("\n\r") & set(event(trace).detail)


def test_a_request_to_stop_the_program_is_not_swallowed() -> None:
    with pytest.raises(KeyboardInterrupt):
        recorded(KeyboardInterrupt())


# --- keys -------------------------------------------------------------------------------------------------------

AFFIXES = st.text(max_size=20)
KEYS = (
    st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
    .map(str.strip)
    .filter(lambda key: len(key) >= SHORTEST_KEY)
)


@given(KEYS, AFFIXES, AFFIXES)
def test_a_key_that_a_server_repeats_is_struck_out_everywhere(
    tmp_path_factory: pytest.TempPathFactory, key: str, before: str, after: str
) -> None:
    file = tmp_path_factory.mktemp("keys") / "calls.jsonl"
    echoing = f"{before}{key}{after}"
    if key in STRUCK_OUT or key in f"{before}{STRUCK_OUT}{after}":
        return  # what stands for keys has the key's letters
    reply = Reply(json.dumps({"reasoning": echoing}, ensure_ascii=False), echoing, Usage(1, 1, None))
    plain = key == json.dumps(key, ensure_ascii=False)[1:-1]
    outcome, trace = recorded(reply, secrets=[key], file=file)
    assert outcome.reply is not None
    for text in (outcome.reply.served, event(trace).served, read_calls(file)[0].served):
        assert key not in text
    if plain:  # the answer is JSON text, in which some characters are spelled otherwise
        assert key not in outcome.reply.answer and key not in str(read_calls(file)[0].answer)
    outcome, trace = recorded(RuntimeError(echoing), secrets=[key], file=file)
    assert key not in str(outcome.error) and key not in event(trace).detail


def test_the_journal_and_the_files_hold_no_key(tmp_path: Path) -> None:
    reply = Reply(json.dumps({"reasoning": KEY, "value": 1}), KEY, Usage(1, 1, None))
    with RunDirectory(tmp_path / "run") as directory:
        for outcome in (reply, RuntimeError(KEY), RuntimeError("x" * 190 + KEY)):
            ask(RecordedModel(Says(outcome), directory.journal, directory, (KEY,), tmp_path / "calls"))
    for path in tmp_path.rglob("*"):
        if path.is_file():
            assert KEY.encode() not in path.read_bytes(), path.name
            assert KEY[:12].encode() not in path.read_bytes(), "nor half a key, cut off at the end of a line"


def test_what_is_too_short_for_a_key_spoils_no_text() -> None:
    outcome, _ = recorded(ANSWER, secrets=["less", "0.02", "", "none"])
    assert outcome.reply == ANSWER


def test_a_key_that_is_spelled_otherwise_is_struck_out_of_what_an_operator_reads() -> None:
    wide = "".join(chr(ord(c) + 0xFEE0) for c in KEY)
    outcome, trace = recorded(replace(ANSWER, served=wide))
    assert event(trace).served == STRUCK_OUT and outcome.reply is not None and outcome.reply.served == STRUCK_OUT


@pytest.mark.parametrize("secret", [f"{KEY}\n", f" {KEY}\r\n", f"\t{KEY} "])
def test_white_space_around_a_key_is_no_part_of_it(secret: str) -> None:
    outcome, _ = recorded(replace(ANSWER, answer=f'"{KEY}"'), secrets=[secret])
    assert outcome.reply is not None and outcome.reply.answer == f'"{STRUCK_OUT}"'


def test_one_key_inside_another_leaves_no_rest() -> None:
    longer = f"{KEY}-and-more-of-it"
    reply = replace(ANSWER, answer=f'"{longer}"')
    for secrets in ((KEY, longer), (longer, KEY)):
        outcome, _ = recorded(reply, secrets=secrets)
        assert outcome.reply is not None and KEY not in outcome.reply.answer


# --- texts that are hard to write -------------------------------------------------------------------------------
@given(st.text(st.characters(), max_size=20), st.text(st.characters(), max_size=20))
def test_half_characters_do_no_harm(tmp_path_factory: pytest.TempPathFactory, answer: str, served: str) -> None:
    folder = tmp_path_factory.mktemp("halves")
    with RunDirectory(folder / "run") as directory:
        reply = Reply(f"{answer}\ud800", f"{served}\udcff", Usage(0, 0, None))
        outcome = ask(RecordedModel(Says(reply), directory.journal, directory, (KEY,), folder / "calls"))
    assert outcome.reply is not None and outcome.reply.answer == f"{answer}\ud800"
    assert ReplayModel("file", read_calls(folder / "calls")) is not None
    assert read_calls(folder / "calls")[0].answer == f"{answer}\ud800"


def test_half_characters_in_an_error_do_no_harm(tmp_path: Path) -> None:
    outcome, trace = recorded(RuntimeError("\ud83d at \udcff"), file=tmp_path / "calls")
    assert outcome.failure is Failure.MALFORMED and event(trace).detail
    assert len(read_calls(tmp_path / "calls")) == 1


@pytest.mark.parametrize("served", ["gpt\x1b[2J\x1b[1;1Hreleased", "gpt\nfallback", "gpt\r\x07"])
def test_the_name_that_a_server_gives_itself_is_one_printable_line(served: str) -> None:
    """It is shown to the operator, whose terminal would obey it."""
    outcome, trace = recorded(replace(ANSWER, served=served))
    assert event(trace).served.isprintable()
    assert outcome.reply is not None and outcome.reply.served == event(trace).served


@pytest.mark.parametrize("bug", [RuntimeError("\x1b[2Jreleased"), ModelError(Failure.REJECTED, "no\x1b[2J\nreleased")])
def test_the_reason_of_a_failure_is_one_printable_line(bug: Exception) -> None:
    trace = MemoryTrace()

    def fail(_: object) -> str:
        raise bug

    outcome = ask(RecordedModel(ScriptedModel("fails", fail), trace, MemoryArchive()))
    assert event(trace).detail.isprintable() and str(outcome.error) == event(trace).detail


# --- a file that cannot be written ------------------------------------------------------------------------------


def test_a_full_disk_ends_the_recording_and_nothing_else(caplog: pytest.LogCaptureFixture) -> None:
    trace = MemoryTrace()
    model = RecordedModel(Says(ANSWER), trace, MemoryArchive(), (KEY,), Path("/dev/full"))
    assert [ask(model).reply for _ in range(3)] == [ANSWER] * 3 and len(trace.of(ModelCalled)) == 3
    (warning,) = caplog.messages
    assert warning.startswith("'/dev/full' cannot be written: ") and "incomplete" in warning
