"""Journals that somebody else wrote: nothing in them commands a terminal, and nothing in them ends in a traceback."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from homeostat.cli.main import main
from homeostat.domain.quotation import printable
from homeostat.journal.verify.verify import verify
from tests.journal.forgery import lines_of, rewrite, write_manifest

RUN = Path(__file__).parent / "data" / "format-1"
HOSTILE = "x\x1b[2J\x1b]0;owned\x07\r\n    931 s  released  \u202eevil\u2066\x9b1m\x7f\u2028\u3164"
Edit = Callable[[list[dict[str, Any]]], None]


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(RUN, tmp_path / "run"))


def shown(*arguments: str) -> tuple[int, str, str]:
    """What the command prints, in this process: status, output, errors."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = main(arguments)
    return status, out.getvalue(), err.getvalue()


def is_harmless(text: str) -> bool:
    """Whether every line of ``text`` is made of visible characters, and none is forged."""
    return all(line.isprintable() for line in text.split("\n")) and "\n    931 s  released  " not in text


def everywhere(value: Any) -> Any:
    """``value`` with every free text in it replaced by a hostile one."""
    if isinstance(value, dict):
        return {k: v if k == "@type" else everywhere(v) for k, v in value.items()}
    if isinstance(value, list):
        return [everywhere(item) for item in value]
    return HOSTILE if isinstance(value, str) else value


@pytest.mark.parametrize("number", [1, *range(7, 14), 20, 37])
def test_a_hostile_line_commands_no_terminal(copy: Path, number: int) -> None:
    lines = lines_of(copy)
    line = lines[number - 1]
    kept = {name: line[name] for name in ("seq", "prev", "at_s", "event")}
    plant = {"case": line["case"]} if "case" in line else {}
    lines[number - 1] = {**everywhere(line), **kept, **plant}
    rewrite(copy, lines)
    for command in (("replay",), ("trace", "verify")):
        _, out, err = shown(*command, str(copy))
        assert is_harmless(out) and is_harmless(err) and err.count("\n") <= 1


@pytest.mark.parametrize("name", ["reason", "detail", "outcome", "state", "proposer", "event", "case"])
def test_a_hostile_word_commands_no_terminal(copy: Path, name: str) -> None:
    lines = lines_of(copy)
    for line in lines:
        if name in line:
            line[name] = HOSTILE
    rewrite(copy, lines, outcome=HOSTILE)
    for command in (("replay",), ("trace", "verify"), ("replay", "--json")):
        _, out, err = shown(*command, str(copy))
        lines_said = 2 if name == "case" else 1  # that nobody knows the plant, and what is wrong with the run
        assert is_harmless(out) and is_harmless(err) and err.count("\n") <= lines_said


def test_a_hostile_result_and_a_hostile_manifest_command_no_terminal(copy: Path) -> None:
    result = json.loads((copy / "result.json").read_bytes())
    (copy / "result.json").write_text(json.dumps({**everywhere(result), "outcome": "recovered"}))
    manifest = json.loads((copy / "manifest.json").read_bytes())
    manifest["files"] = [f for f in manifest["files"] if f["name"] != "result.json"]
    write_manifest(copy / "manifest.json", manifest)
    for command in (("replay",), ("replay", "--json"), ("trace", "verify")):
        _, out, err = shown(*command, str(copy))
        assert is_harmless(out) and is_harmless(err) and err.count("\n") <= 1
    manifest["files"].append({"name": HOSTILE, "size_bytes": 1, "sha256": HOSTILE})
    write_manifest(copy / "manifest.json", manifest)
    status, out, err = shown("trace", "verify", str(copy))
    assert status == 1 and is_harmless(out) and out.count("\n") == 1 and not err


@given(st.text())
@example(HOSTILE)
def test_printable_text_is_one_line_and_stays_what_it_is(text: str) -> None:
    once = printable(text)
    assert once.isprintable() and printable(once) == once
    if text.isascii() and text.isprintable():
        assert once == text


def judged(directory: Path) -> None:
    """Verification answers in one line, whatever is there."""
    report = verify(directory, {"ab" * 32})
    assert report.complete or report.problem
    status, out, err = shown("trace", "verify", str(directory))
    assert status in (0, 1, 3) and out.endswith("\n") and not err


SMALL = settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])


@SMALL
@given(content=st.binary(max_size=400), of=st.sampled_from(["events.jsonl", "manifest.json", "result.json"]))
def test_any_bytes_get_an_answer_in_one_line(tmp_path: Path, content: bytes, of: str) -> None:
    run = tmp_path / "run"
    shutil.rmtree(run, ignore_errors=True)
    shutil.copytree(RUN, run)
    (run / of).write_bytes(content)
    judged(run)
    status, _, err = shown("replay", str(run))
    assert status in (0, 1, 2) and err.count("\n") <= 1


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@SMALL
@given(data=st.data())
def test_any_manifest_gets_an_answer_in_one_line(tmp_path: Path, data: st.DataObject) -> None:
    run = tmp_path / "run"
    if not run.exists():
        shutil.copytree(RUN, run)
    manifest = json.loads((RUN / "manifest.json").read_bytes())
    for name in data.draw(st.lists(st.sampled_from([*manifest, "key", "signature", "configuration"]), max_size=3)):
        manifest[name] = data.draw(JSON)
    if data.draw(st.booleans()) and isinstance(manifest["files"], list) and manifest["files"]:
        manifest["files"][0] = {"name": data.draw(JSON), "size_bytes": data.draw(JSON), "sha256": data.draw(JSON)}
    write_manifest(run / "manifest.json", manifest)
    judged(run)


@pytest.mark.slow
@SMALL
@given(data=st.data())
def test_any_events_get_an_answer_and_end_in_no_traceback(tmp_path: Path, data: st.DataObject) -> None:
    run = tmp_path / "run"
    shutil.rmtree(run, ignore_errors=True)
    shutil.copytree(RUN, run)
    lines = lines_of(run)
    for _ in range(data.draw(st.integers(1, 3))):
        line = data.draw(st.sampled_from(lines))
        name = data.draw(st.sampled_from([key for key in line if key not in ("seq", "prev")]))
        line[name] = _other(data, line[name], name)
    rewrite(run, lines)
    judged(run)
    status, out, err = shown("replay", str(run))
    assert status in (0, 1, 2) and err.count("\n") <= 1 and is_harmless(out) and is_harmless(err)
    assert "Traceback" not in err


def _other(data: st.DataObject, value: Any, name: str) -> Any:
    """Another value, or the same with one of its parts replaced."""
    if name == "at_s":
        return data.draw(st.floats(-1e9, 1e9))
    if name == "event":
        return data.draw(st.sampled_from(KINDS))
    if isinstance(value, list) and value and data.draw(st.booleans()):
        place = data.draw(st.integers(0, len(value) - 1))
        return [*value[:place], _other(data, value[place], ""), *value[place + 1 :]]
    if isinstance(value, dict) and value and data.draw(st.booleans()):
        key = data.draw(st.sampled_from(sorted(value)))
        return {**value, key: _other(data, value[key], "")}
    return data.draw(JSON)


KINDS = (
    "run-started", "run-finished", "noticed", "deviated", "diagnosed", "fallback-armed", "model-called", "attempted",
    "released", "state-entered", "fallback-activated", "write-intended", "write-ended", "read-back", "request-answered",
    "latched", "mode-entered", "guard-started", "signed", "nothing-known",
)  # fmt: skip
