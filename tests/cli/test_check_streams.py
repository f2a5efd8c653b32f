"""A check of a plant prints what it finds while it goes on, in the order in which it is in the JSON as well."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from homeostat.cli.commands.plant import check as command
from homeostat.evaluate.lint import check as lint
from homeostat.evaluate.lint.deep.faults import Outlook
from homeostat.evaluate.lint.finding import Finding, Place, Severity

TANKS = Path(__file__).parents[2] / "examples" / "two_tanks"
OUTLOOK = Outlook("V1_weak", None, (), "", None, (), ())


def finding(what: str, severity: Severity = Severity.ERROR) -> Finding:
    return Finding(severity, "loops", Place("process.py"), what, "mend it")


@pytest.fixture
def between(monkeypatch: pytest.MonkeyPatch) -> list[Callable[[], None]]:
    """What is done between two findings of the plant's code."""
    done: list[Callable[[], None]] = []

    def carried_out(*_: Any) -> Iterator[Finding | Outlook]:
        yield finding("the first")
        for each in done:
            each()
        yield OUTLOOK
        yield finding("the second", Severity.WARNING)

    monkeypatch.setattr(lint, "carried_out", carried_out)
    return done


def options(**given: bool) -> Namespace:
    return Namespace(**({"case": str(TANKS), "answers": False, "deep": True, "json": False} | given))


def told(out: str) -> list[str]:
    return [line for line in out.splitlines() if ": note: " not in line]


def test_a_finding_is_there_before_the_next_one(
    between: list[Callable[[], None]], capsys: pytest.CaptureFixture[str]
) -> None:
    seen: list[str] = []
    between.append(lambda: seen.append(capsys.readouterr().out))
    assert command.carry_out(options()) == 1
    first, *more = told(seen[0])
    assert first == "process.py: error: the first; mend it [loops]" and more == []
    second, fault, ending = told(capsys.readouterr().out)
    assert second == "process.py: warning: the second; mend it [loops]"
    assert fault.startswith("fault V1_weak: not noticed") and "2 findings" in ending


def test_json_is_one_document_at_the_end(between: list[Callable[[], None]], capsys: pytest.CaptureFixture[str]) -> None:
    seen: list[str] = []
    between.append(lambda: seen.append(capsys.readouterr().out))
    command.carry_out(options(json=True))
    assert seen == [""]
    found = json.loads(capsys.readouterr().out)["findings"]
    assert [each["what"] for each in found if each["severity"] != "note"] == ["the first", "the second"]


def test_a_terminal_sees_no_progress_behind_a_finding(
    between: list[Callable[[], None]], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    command.carry_out(options())
    shown = capsys.readouterr().err
    assert "checking tables" in shown and shown.endswith("\r\x1b[K")
