"""The file of recorded calls: what is written is read again, and a broken line is named."""

from __future__ import annotations

import json
import os
import string
import threading
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from homeostat.llm.calls import FORMAT, Call, CallFileError, append_call, read_calls
from homeostat.llm.model import Failure

KEYS = (
    "format", "agent", "at_s", "model", "served", "system", "prompt", "schema", "answer", "failure", "detail",
    "input_tokens", "output_tokens", "cost_usd", "latency_s",
)  # fmt: skip
CALL = Call(
    agent="action", at_s=1460.0, model="ollama:m", served="m", system="role", prompt="situation",
    schema={"type": "object"}, answer='{"x": 1}', failure=None, detail="", input_tokens=12, output_tokens=7,
    cost_usd=None, latency_s=0.25,
)  # fmt: skip

TEXT = st.text(st.characters(), max_size=30)  # halves of surrogate pairs included: models say them
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
AMOUNTS = st.floats(0.0, allow_infinity=False)
COUNTS = st.integers(0, 10**12)
JSON = st.recursive(
    st.none() | st.booleans() | NUMBERS | TEXT,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=8,
)
ENDS: st.SearchStrategy[tuple[str | None, Failure | None]] = st.tuples(TEXT, st.none()) | st.tuples(
    st.none() | TEXT, st.sampled_from(Failure)
)
CALLS = st.builds(
    lambda end, **rest: Call(answer=end[0], failure=end[1], **rest),
    end=ENDS, agent=TEXT, at_s=NUMBERS, model=TEXT, served=TEXT, system=TEXT, prompt=TEXT,
    schema=st.dictionaries(TEXT, JSON, max_size=3), detail=TEXT, input_tokens=COUNTS, output_tokens=COUNTS,
    cost_usd=st.none() | AMOUNTS, latency_s=AMOUNTS,
)  # fmt: skip


@given(calls=st.lists(CALLS, max_size=4))
def test_what_is_written_is_read_again(tmp_path_factory: pytest.TempPathFactory, calls: list[Call]) -> None:
    path = tmp_path_factory.mktemp("calls") / "calls.jsonl"
    path.touch()
    for call in calls:
        append_call(path, call)
    assert read_calls(path) == tuple(calls)
    content = path.read_bytes()
    assert content.isascii() and content.count(b"\n") == len(calls), "one line each, whatever a text holds"


def test_every_line_has_exactly_the_documented_keys() -> None:
    assert tuple(json.loads(CALL.to_json())) == KEYS
    assert json.loads(CALL.to_json())["format"] == FORMAT == "homeostat-call/1"


@pytest.mark.parametrize("number", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize("field", ["at_s", "cost_usd", "latency_s"])
def test_what_is_no_number_in_json_is_not_written(tmp_path: Path, field: str, number: float) -> None:
    path = tmp_path / "calls.jsonl"
    append_call(path, CALL)
    changed = Call(**{name: getattr(CALL, name) for name in CALL.__slots__} | {field: number})
    with pytest.raises(ValueError, match="JSON"):
        append_call(path, changed)
    assert read_calls(path) == (CALL,), "and the file is as it was"


def test_empty_lines_count_but_say_nothing(tmp_path: Path) -> None:
    path = tmp_path / "calls.jsonl"
    path.write_text(f"\n{CALL.to_json()}\n   \n\n{CALL.to_json()}\n\nbroken\n")
    with pytest.raises(CallFileError, match="line 7"):
        read_calls(path)
    path.write_text(f"\n{CALL.to_json()}\n   \n\n{CALL.to_json()}\n")
    assert read_calls(path) == (CALL, CALL)


@pytest.mark.parametrize("missing", ["calls.jsonl", "folder"])
def test_a_file_that_cannot_be_read_is_an_os_error(tmp_path: Path, missing: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError, match=missing):
        read_calls(tmp_path / missing)


def line(**changes: Any) -> str:
    """A line with some values changed."""
    return json.dumps(json.loads(CALL.to_json()) | changes)


def without(key: str) -> str:
    fields = json.loads(CALL.to_json())
    del fields[key]
    return json.dumps(fields)


BROKEN = {
    "words": "not JSON", "half a line": CALL.to_json()[:60], "two in one": CALL.to_json() * 2, "a list": "[]",
    "a number": "1", "a text": '"format"', "nothing": "null", "true": "true", "an empty object": "{}",
    "a list of pairs": '[["format", "homeostat-call/1"]]', "another format": line(format="homeostat-call/2"),
    "no format": line(format=None), "more": line(price=1), "no failure of ours": line(failure="TIRED", answer=None),
    "words of a failure": line(failure="no answer in time", answer=None), "a list of failures": line(failure=[]),
    "neither answer nor failure": line(answer=None), "an answer that is no text": line(answer={"x": 1}),
    "an answer that is a number": line(answer=5),
    "many digits": line(at_s=0).replace('"at_s": 0', f'"at_s": {"9" * 5000}'),
    "control characters": CALL.to_json().replace("role", "\x01"), "no braces": CALL.to_json()[1:-1],
    **{f"without {key}": without(key) for key in KEYS},
}  # fmt: skip


def message_of(path: Path) -> str:
    with pytest.raises(CallFileError) as error:
        read_calls(path)
    return str(error.value)


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
def test_a_broken_line_is_named_in_one_line(tmp_path: Path, text: str) -> None:
    path = tmp_path / "calls.jsonl"
    path.write_text(f"{CALL.to_json()}\n{text}\n{CALL.to_json()}\n")
    message = message_of(path)
    assert repr(str(path)) in message and "line 2 " in message and "--record" in message
    assert "\n" not in message and len(message) < len(str(path)) + 300


DEEP = "[" * 100_000


@pytest.mark.parametrize("text", [DEEP, '{"format": ' * 100_000, CALL.to_json().replace('{"type": "object"}', DEEP)])
def test_a_line_that_is_nested_too_deep_is_a_broken_one(tmp_path: Path, text: str) -> None:
    (tmp_path / "calls.jsonl").write_text(text)
    assert "line 1 " in message_of(tmp_path / "calls.jsonl")


MISTYPED = [
    ("agent", 5), ("at_s", "noon"), ("at_s", None), ("model", None), ("served", ["m"]), ("system", 1), ("prompt", {}),
    ("schema", "object"), ("detail", None), ("input_tokens", "many"), ("input_tokens", 1.5), ("output_tokens", None),
    ("cost_usd", "cheap"), ("cost_usd", float("nan")), ("at_s", float("inf")), ("latency_s", "slow"),
    ("cost_usd", -0.01), ("cost_usd", 10**400), ("cost_usd", True), ("latency_s", -1.0), ("latency_s", None),
    ("input_tokens", -1), ("output_tokens", True), ("schema", []), ("answer", ["x"]), ("failure", 3),
]  # fmt: skip


@pytest.mark.parametrize(("field", "value"), MISTYPED, ids=[f"{field}={value!r:.20}" for field, value in MISTYPED])
def test_a_value_of_another_type_is_a_broken_line(tmp_path: Path, field: str, value: object) -> None:
    (tmp_path / "calls.jsonl").write_text(line(**{field: value}))
    message = message_of(tmp_path / "calls.jsonl")
    assert f"line 1 is not a recorded call: {field!r} must be " in message and len(message) < len(str(tmp_path)) + 300


def test_bytes_that_are_no_text_are_a_broken_line(tmp_path: Path) -> None:
    path = tmp_path / "calls.jsonl"
    path.write_bytes(b"\xff\xfe\x00{\n")
    assert "line 1 " in message_of(path)


def test_bytes_that_are_no_text_inside_a_text_are_kept_apart(tmp_path: Path) -> None:
    """A file that went through another encoding is still read: the answer is what is judged, not the file."""
    path = tmp_path / "calls.jsonl"
    path.write_bytes(CALL.to_json().replace("situation", "gr\\u00fc\xdf").encode("latin-1"))
    (call,) = read_calls(path)
    assert call.prompt.startswith("grü")


@given(st.integers(0, len(CALL.to_json())), st.text(string.printable + "\x00é\u2028", max_size=4), st.integers(0, 6))
def test_a_damaged_line_is_read_or_named(
    tmp_path_factory: pytest.TempPathFactory, at: int, inserted: str, removed: int
) -> None:
    text = CALL.to_json()
    path = tmp_path_factory.mktemp("damaged") / "calls.jsonl"
    path.write_text(text[:at] + inserted + text[at + removed :], encoding="utf-8")
    try:
        calls = read_calls(path)
    except CallFileError as error:
        assert repr(str(path)) in str(error) and "\n" not in str(error)
    else:
        assert len(calls) <= 1


def test_a_pipe_that_nobody_reads_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    ended = threading.Event()

    def add() -> None:
        with pytest.raises(OSError, match="No such device"):
            append_call(tmp_path / "pipe", CALL)
        ended.set()

    threading.Thread(target=add, daemon=True).start()
    assert ended.wait(10.0)
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    try:
        append_call(tmp_path / "pipe", CALL)
        assert os.read(reader, 65_536).decode() == f"{CALL.to_json()}\n"
    finally:
        os.close(reader)
