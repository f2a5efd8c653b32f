"""Runs whose first event does not say how they were begun, as one of another version: refused, and left as they are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.cli.main import main
from homeostat.evaluate.conditions import Conditions
from homeostat.evaluate.operation import Thinking
from homeostat.evaluate.recorded.run import run_started
from homeostat.evaluate.scenario import scenario
from homeostat.journal import Setting
from homeostat.journal.beside.files import JOURNAL
from homeostat.plants.plant import load_plant
from homeostat.record.directory import RunDirectory


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("proposer", None, "does not say 'proposer'"),
        ("protocol", None, "does not say 'protocol'"),
        ("thinking_scale", None, "does not say 'thinking_scale'"),
        ("thinking_scale", "much", "'much'"),
        ("thinking_declared_s", -1.0, "-1"),
        ("mode", "loud", "'loud'"),
        ("persons", "two", "'two'"),
        ("budget_s", "", "float"),
    ],
)
def test_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, value: str | float | None, told: str
) -> None:
    plant = load_plant("mixing_module")
    event = run_started(plant, scenario(plant, "none", 1), Thinking(), "search", Conditions().settings, None)
    others = (*(s for s in event.configuration if s.name != name), *([] if value is None else [Setting(name, value)]))
    with RunDirectory(tmp_path / "run") as directory:
        directory.record(replace(event, configuration=others), 0.0)
    before = (tmp_path / "run" / JOURNAL).read_bytes()
    assert main(["resume", str(tmp_path / "run")]) == 2
    err = capsys.readouterr().err
    assert err.startswith("homeostat: run ") and "cannot go on: its first event does not say " in err and told in err
    assert err.count("\n") == 1 and (tmp_path / "run" / JOURNAL).read_bytes() == before
