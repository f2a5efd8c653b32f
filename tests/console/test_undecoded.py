"""A journal that another version wrote a part of: what this one cannot read costs itself, and nothing that follows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from homeostat.console.opened import KnownPlant, OpenedRun
from homeostat.domain.alarm import Priority
from homeostat.domain.events.people import AlarmRaised
from homeostat.journal import Journal, RunStarted
from homeostat.plants.plant import load_plant
from tests.journal.forgery import change


def test_events_of_another_version_hide_nothing_that_comes_after_them(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        journal.record(RunStarted("cstr", (), 1), 0.0)
        for number in range(1, 7):
            journal.record(AlarmRaised(f"a{number}", "cold", Priority.LOW), float(number))

    def make_unknown(lines: list[dict[str, Any]]) -> None:
        for number in (2, 4, 5):
            lines[number]["priority"] = "UNHEARD_OF"

    change(tmp_path, make_unknown)
    run = OpenedRun(tmp_path, KnownPlant("cstr", load_plant("cstr").description))
    assert [entry.at_s for entry in run.entries] == [0.0, 1.0, 3.0, 6.0]
    assert "event 3 ('alarm-raised') cannot be read" in run.trouble and run.last_s == 6.0
    assert sorted(run.stands(6.0).alarms) == ["a1", "a3", "a6"]
