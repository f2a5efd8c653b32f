"""Options that name a language model: refused in one line before anything runs, or asked and recorded."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from homeostat.domain.alternative import AlternativeKind
from homeostat.domain.events.recovery import Compared
from homeostat.journal import read_events
from homeostat.llm.calls import read_calls
from homeostat.llm.model import Failure
from homeostat.record.run_record import RunRecord
from tests.cli.command import Done, homeostat, refused
from tests.llm.test_calls_file import CALL

REFUSED = [
    ("an unknown proposer", ("--proposer", "serch"), ("'serch'", "search", "openai:MODEL")),
    ("a server without model", ("--proposer", "http://127.0.0.1:8000/v1"), ("#MODEL",)),
    ("an address that is none", ("--proposer", "http://[::1/v1#m"), ("unknown proposer", "'http://[::1/v1#m'")),
    ("a server without host", ("--proposer", "http://#m"), ("not an http or https address",)),
    ("an unknown script", ("--proposer", "scripted:clever"), ("'scripted:clever'", "scripted:reasonable")),
    ("a recording of nobody", ("--record", "calls.jsonl"), ("--record", "--proposer")),
    ("a note to nobody", ("--note", "Pump: new"), ("--note", "--proposer")),
    ("local models only, of none", ("--local-only", "--allow-host", "h"), ("--local-only, --allow-host", "--proposer")),
    ("a temperature of nobody", ("--temperature", "0"), ("--temperature", "--proposer")),
    ("a seed of nobody", ("--model-seed", "0", "--proposer", "search"), ("--model-seed", "--proposer")),
    ("an address with a password", ("--proposer", "http://u:pw@127.0.0.1/v1#m"), ("HOMEOSTAT_LLM_KEY",)),
    ("a recording where there is no folder", ("--proposer", "scripted:stubborn", "--record", "no/calls"),
     ("no/calls",)),
    ("a replay of no file", ("--proposer", "replay:calls.jsonl"), ("calls.jsonl",)),
    ("a replay of nothing", ("--proposer", "replay:"), ("'.'",)),
    ("OpenAI with local models only", ("--local-only", "--proposer", "openai:gpt"), ("api.openai.com", "--allow-host")),
    ("another host than the one that is allowed",
     ("--local-only", "--allow-host", "llm.example", "--proposer", "http://evil.llm.example/v1#m"),
     ("evil.llm.example",)),
    ("a host that is none", ("--local-only", "--allow-host", "http://", "--proposer", "http://127.0.0.1/v1#m"),
     ("--allow-host: 'http://' is not a host",)),
    ("a host with a port", ("--local-only", "--allow-host", "llm:80", "--proposer", "http://llm:80/v1#m"),
     ("'llm:80'", "its name alone")),
    ("no key", ("--proposer", "openai:gpt"), ("OPENAI_API_KEY",)),
    ("a temperature too high", ("--temperature", "2.1"), ("--temperature", "2.1")),
    ("a temperature that is none", ("--temperature", "nan"), ("--temperature",)),
]  # fmt: skip


@pytest.fixture(autouse=True)
def no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "ANTHROPIC_API_KEY", "HOMEOSTAT_LLM_KEY"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(("arguments", "words"), [plant[1:] for plant in REFUSED], ids=[plant[0] for plant in REFUSED])
def test_refused_and_nothing_written(tmp_path: Path, arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    refused(homeostat("run", "cstr", "--fault", "fouling", *arguments, cwd=tmp_path), *words)
    assert list(tmp_path.iterdir()) == []


def test_a_refusal_leaves_no_empty_recording(tmp_path: Path) -> None:
    refused(homeostat("run", "cstr", "--proposer", "serch", "--record", "calls.jsonl", cwd=tmp_path), "'serch'")
    assert list(tmp_path.iterdir()) == []


BROKEN = {
    "words": ("not JSON\n", "line 1"), "another format": ('{"format": "homeostat-call/2"}\n', "line 1"),
    "a broken second line": (f"{CALL.to_json()}\n{CALL.to_json()[:50]}\n", "line 2"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "where"), BROKEN.values(), ids=BROKEN)
def test_a_broken_recording_is_refused(tmp_path: Path, text: str, where: str) -> None:
    (tmp_path / "calls.jsonl").write_text(text)
    refused(homeostat("run", "cstr", "--proposer", "replay:calls.jsonl", cwd=tmp_path), "'calls.jsonl'", where)
    assert [path.name for path in tmp_path.iterdir()] == ["calls.jsonl"]


# --- a run that asks --------------------------------------------------------------------------------------------

RUN = ("run", "cstr", "--fault", "cool_stuck_closed", "--onset", "900", "--end", "1050", "--thinking-declared", "1")


@pytest.fixture(scope="module")
def asked(tmp_path_factory: pytest.TempPathFactory) -> Done:
    """A run that a script recovers, with its calls in ``calls.jsonl`` and its record in ``run``."""
    arguments = ("--proposer", "scripted:reasonable", "--record", "calls.jsonl", "--out", "run", "--note", "Pump: new")
    return homeostat(*RUN, *arguments, "--json", cwd=tmp_path_factory.mktemp("asked"))


@pytest.mark.slow
def test_a_script_competes_with_the_search_and_the_cheapest_is_released(asked: Done) -> None:
    result = json.loads(asked.out)
    assert (asked.status, asked.err, result["outcome"]) == (0, "", "recovered")
    record = RunRecord.of(tuple(read_events(asked.cwd / "run")))
    found = next(c for c in record.of_kind(Compared) if c.chosen)
    released = [a for a in found.alternatives if a.kind is AlternativeKind.RELEASE]
    assert {a.proposer for a in released} == {"search", "language"}
    cheapest = min((a for a in released if a.admitted), key=lambda a: a.cost.total)
    assert cheapest.digest == found.chosen


def test_every_call_is_recorded_in_the_file_and_in_the_trace(asked: Done) -> None:
    calls = read_calls(asked.cwd / "calls.jsonl")
    assert {c.agent for c in calls} >= {"planning", "action"} and all(c.failure is None for c in calls)
    assert all("Operator's note: «Pump: new»" in c.prompt for c in calls if c.agent != "reprompting")
    journal = (asked.cwd / "run" / "events.jsonl").read_text()
    assert journal.count('"event":"model-called"') == len(calls)
    assert len(list((asked.cwd / "run" / "prompts").iterdir())) == len({(c.system, c.prompt) for c in calls})
    answers = {path.read_text() for path in (asked.cwd / "run" / "answers").iterdir()}
    assert {c.answer for c in calls} <= answers


@pytest.mark.slow
def test_what_was_recorded_replays_to_the_same_actions(asked: Done, tmp_path: Path) -> None:
    """Word for word the same questions: nothing needs to be guessed."""
    (tmp_path / "calls.jsonl").write_bytes((asked.cwd / "calls.jsonl").read_bytes())
    replay = ("--proposer", "replay:calls.jsonl", "--record", "again.jsonl", "--out", "run", "--note", "Pump: new")
    done = homeostat(*RUN, *replay, "--json", cwd=tmp_path)
    first, again = json.loads(asked.out), json.loads(done.out)
    assert (done.status, again["actor"], again["actions"]) == (0, first["actor"], first["actions"])
    before, after = read_calls(asked.cwd / "calls.jsonl"), read_calls(tmp_path / "again.jsonl")
    assert [(c.prompt, c.answer) for c in after] == [(c.prompt, c.answer) for c in before]


@pytest.mark.slow
def test_a_recording_that_runs_out_hands_over_to_the_search(tmp_path: Path) -> None:
    (tmp_path / "calls.jsonl").write_text("")
    arguments = ("--proposer", "replay:calls.jsonl", "--record", "again.jsonl", "--out", "run")
    done = homeostat(*RUN, *arguments, cwd=tmp_path)
    assert (done.status, done.err) == (0, "")
    assert "gave up" in done.out and "no more recorded answer" in done.out and "by search" in done.out
    assert {c.failure for c in read_calls(tmp_path / "again.jsonl")} == {Failure.EXHAUSTED}


@pytest.mark.slow
def test_a_recording_on_a_full_disk_is_told_once_and_ends_nothing(asked: Done, tmp_path: Path) -> None:
    arguments = ("--proposer", "scripted:reasonable", "--record", "/dev/full", "--out", "run", "--note", "Pump: new")
    done = homeostat(*RUN, *arguments, "--json", cwd=tmp_path)
    assert (done.status, json.loads(done.out)["actions"]) == (0, json.loads(asked.out)["actions"])
    assert done.err.startswith("homeostat: '/dev/full' cannot be written: ") and done.err.count("\n") == 1


@pytest.mark.wide
def test_a_server_that_is_not_there_hands_over_to_the_search(tmp_path: Path) -> None:
    arguments = ("--proposer", "http://127.0.0.1:9/v1#m", "--local-only", "--out", "run", "--json")
    done = homeostat(*RUN, *arguments, cwd=tmp_path)
    result = json.loads(done.out)
    assert (done.status, done.err, result["actor"]) == (0, "", "search")
    assert '"failure":"UNREACHABLE"' in (tmp_path / "run" / "events.jsonl").read_text()
