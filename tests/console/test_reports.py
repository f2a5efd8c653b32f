"""Reports of shifts and weeks at the page: one at a time, within bounds, and as the command makes them."""

from __future__ import annotations

import re
import threading
from pathlib import Path
from typing import Any

import pytest

from homeostat.console.opened import OpenedRun
from homeostat.console.reports.reports import Busy, NotReported, Report, Reports
from homeostat.console.trial.trials import Trials
from homeostat.domain.events.recovery import Attempted
from tests.cli.command import SOURCE, homeostat
from tests.console.served import Browser, Served


def test_a_report_is_what_the_command_makes(console: Served, recovered_run: Path, tmp_path: Path) -> None:
    answer = Browser(console).send("/api/report", {"last": "8h", "at_s": 1000})
    assert answer.status == 200 and answer.json["name"] == "report-8h-until-1000s.html"
    done = homeostat("report", str(recovered_run), "--last", "8h", "--until", "1000s", "--out", "r.html", cwd=tmp_path)
    assert done.status == 0 and answer.json["page"] == (tmp_path / "r.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("content", "headers", "status"),
    [
        ({"last": "9h", "at_s": 10}, {}, 400),
        ({"last": "8h; rm -rf /", "at_s": 10}, {}, 400),
        ({"last": "all", "at_s": -1}, {}, 400),
        ({"last": "all", "at_s": 1e9}, {}, 400),
        (b'{"last": "all", "at_s": NaN}', {}, 400),
        ({"last": "all", "at_s": 10, "out": "/etc/passwd"}, {}, 400),
        ({"last": "all", "at_s": 10}, {"Origin": "http://elsewhere.example"}, 403),
        ({"last": "all", "at_s": 10}, {"Content_Type": "text/plain"}, 415),
    ],
)
def test_nothing_else_makes_one(console: Served, content: Any, headers: dict[str, str], status: int) -> None:
    answer = Browser(console).send("/api/report", content, **headers)
    assert answer.status == status and "\n" not in answer.json["error"]


def test_what_happened_at_the_moment_itself_is_in_it_and_at_the_beginning_there_is_one(recovered: OpenedRun) -> None:
    last_s = recovered.entries[-1].at_s
    whole, most, less = (Reports(recovered).make("all", at_s).page for at_s in (last_s, last_s - 1e-4, last_s - 1.0))
    assert most == whole != less
    assert Reports(recovered).make("8h", 0.0).page.startswith("<!DOCTYPE html>")


@pytest.mark.parametrize("made", ["report", "trial"])
def test_no_file_where_the_console_was_started_is_run(
    recovered: OpenedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made: str
) -> None:
    for name in ("homeostat", "os", "runpy", "resource", "pickle", "json"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'owned')!r}, 'w').close()")
    monkeypatch.setenv("PYTHONPATH", str(SOURCE))
    monkeypatch.chdir(tmp_path)
    if made == "report":
        assert Reports(recovered).make("8h", 1000.0).page.startswith("<!DOCTYPE html>")
    else:
        at_s = next(e.at_s for e in recovered.entries if isinstance(e.event, Attempted))
        trials = Trials(recovered)
        assert trials.ask(at_s, trials.options(at_s)[0].state, {})
    assert not (tmp_path / "owned").exists()


def test_what_takes_too_long_or_too_much_is_ended_and_said_in_one_line(recovered: OpenedRun) -> None:
    for bounds, words in (((0, 3 << 30), "within 0 s"), ((120, 24 << 20), "report")):
        with pytest.raises(NotReported) as said:
            Reports(recovered, *bounds).make("all", 1000.0)
        assert words in str(said.value) and "\n" not in str(said.value) and "Traceback" not in str(said.value)


def test_one_is_made_at_a_time(recovered: OpenedRun) -> None:
    reports, made = Reports(recovered), list[Report]()
    first = threading.Thread(target=lambda: made.append(reports.make("24h", 900.0)))
    first.start()
    with pytest.raises(Busy, match="already"):
        while first.is_alive():
            reports.make("24h", 900.0)
    first.join()
    assert made[0].page.startswith("<!DOCTYPE html>")


def test_it_is_taken_away_from_the_page(page: Any, console: Served) -> None:
    page.goto(f"{console.address}#t=1000")
    page.wait_for_selector(".clock")
    page.keyboard.press("6")
    with page.expect_download() as taken:
        page.get_by_role("button", name="Last 24 h").click()
    assert re.fullmatch(r"report-24h-until-\d+s\.html", taken.value.suggested_filename)
    assert Path(taken.value.path()).read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    page.get_by_role("region", name="Reports").get_by_text("✓ report-24h").wait_for()
