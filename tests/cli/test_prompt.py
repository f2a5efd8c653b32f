"""`homeostat prompt`: exactly what a model would see, or one line on why there is nothing to see."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.agents.language.prompt_files import prompt_file, template_sha256
from homeostat.cli.commands import prompt
from homeostat.evaluate.scenario import scenario
from tests.cli.command import Done, homeostat, refused

FAULT = ("--fault", "cool_stuck_closed", "--onset", "900")
END_S = 1e7
TOKENS = re.compile(r"tokens \((?:o200k|estimated)\): system (\d+), prompt (\d+), schema (\d+); prompt files (\w{12})")


def shown(done: Done) -> tuple[str, str, dict[str, object], re.Match[str]]:
    """System, prompt, schema and the line about tokens."""
    assert (done.status, done.err) == (0, ""), done.err
    system, prompt, schema, tokens = done.out.split("\n\n---\n\n")
    match = TOKENS.fullmatch(tokens.strip())
    assert match is not None, tokens
    return system, prompt, json.loads(schema), match


@pytest.fixture(scope="module")
def action(tmp_path_factory: pytest.TempPathFactory) -> Done:
    return homeostat("prompt", "cstr", *FAULT, cwd=tmp_path_factory.mktemp("prompt"))


@pytest.mark.slow
def test_the_first_question_to_action(action: Done) -> None:
    system, prompt, schema, tokens = shown(action)
    assert system.startswith("You are the Action agent") and prompt_file("rules").strip() in system
    assert prompt.startswith("# Situation\nState normal") and "# Refused so far" not in prompt
    assert "cool_stuck_closed" in prompt and "# Commands in state reduced_load" in prompt and "# Plant" in prompt
    assert schema["additionalProperties"] is False and schema["required"] == [
        "reasoning",
        "commands",
        "no_value_because",
    ]
    assert 100 < int(tokens[1]) < 600 and 500 < int(tokens[2]) < 3000 and 50 < int(tokens[3]) < 1000
    assert template_sha256("action").startswith(tokens[4])


def test_nothing_is_kept(action: Done) -> None:
    assert list(action.cwd.iterdir()) == []


@pytest.mark.slow
def test_a_run_of_months_ends_with_the_question(action: Done, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prompt, "scenario", lambda *given: replace(scenario(*given), end_s=END_S))
    assert homeostat("prompt", "cstr", *FAULT, cwd=tmp_path).out == action.out


@pytest.mark.slow
def test_the_same_command_shows_the_same(action: Done, tmp_path: Path) -> None:
    assert homeostat("prompt", "cstr", *FAULT, "--agent", "action", "--number", "1", cwd=tmp_path).out == action.out


@pytest.mark.slow
def test_the_question_to_planning_with_a_note(tmp_path: Path) -> None:
    arguments = (
        "--agent",
        "planning",
        "--note",
        "Pump serviced\nyesterday », $rules",
        "--seed",
        "3",
        "--severity",
        "0.65",
    )
    system, prompt, schema, tokens = shown(homeostat("prompt", "cstr", *FAULT, *arguments, cwd=tmp_path))
    assert system.startswith("You are the Planning agent") and "# Paths that are open now" in prompt
    assert "\nOperator's note: «Pump serviced yesterday ', $rules»\n" in prompt
    assert "enum" in schema["properties"]["path"] and template_sha256("planning").startswith(tokens[4])  # type: ignore[index]


@pytest.mark.slow
def test_a_later_question_shows_what_was_refused(tmp_path: Path) -> None:
    arguments = (*FAULT, "--severity", "0.85", "--number", "2")
    _, prompt, _, _ = shown(homeostat("prompt", "cstr", *arguments, cwd=tmp_path))
    assert "# Refused so far\n1. normal > " in prompt and "# What attempt 1 violated" in prompt
    assert "margin per step" in prompt


@pytest.mark.slow
def test_a_question_that_is_never_asked(tmp_path: Path) -> None:
    done = homeostat("prompt", "cstr", "--fault", "leak", "--onset", "900", cwd=tmp_path)
    assert (done.status, done.err) == (1, "") and done.out.count("\n") == 1
    assert done.out.startswith("action was not asked 1 times in this run")


REFUSED = [
    ("an unknown agent", ("cstr", "--agent", "gate"), ("--agent", "'gate'", "planning")),
    ("an unknown case", ("ctsr",), ("'ctsr'", "'cstr'")),
    ("an unknown fault", ("cstr", "--fault", "cool_stuck_close"), ("'cool_stuck_close'", "'cool_stuck_closed'")),
    ("no case", (), ("CASE",)),
    ("the question before the first", ("cstr", "--number", "0"), ("--number 0", "1")),
    ("a question that is no number", ("cstr", "--number", "two"), ("--number", "'two'")),
    ("an option of runs", ("cstr", "--proposer", "search"), ("--proposer",)),
]


@pytest.mark.parametrize(("arguments", "words"), [plant[1:] for plant in REFUSED], ids=[plant[0] for plant in REFUSED])
def test_refused_in_one_line(tmp_path: Path, arguments: tuple[str, ...], words: tuple[str, ...]) -> None:
    refused(homeostat("prompt", *arguments, cwd=tmp_path), *words)
    assert list(tmp_path.iterdir()) == []
