"""The page of an attached plant: what lasted, what was diagnosed, and what would have been done."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from homeostat.domain.alarm import Priority
from homeostat.domain.diagnosis import FaultState, Hypothesis
from homeostat.domain.events.foresight import Foreseen
from homeostat.domain.events.guard import GuardStarted, QualityChanged, RequestAnswered, Stopped, ThinkingEnded
from homeostat.domain.events.people import AlarmRaised, AlarmReturned, ModeEntered
from homeostat.domain.events.recovery import Diagnosed
from homeostat.journal import Event, Journal, Setting, Summary, read_events
from homeostat.service.attached.place import first_event
from homeostat.service.report.facts import Facts, condensed, facts_of
from homeostat.service.report.page import page
from tests.cli.command import homeostat, refused
from tests.journal.forgery import change

FAULT = Diagnosed((), (Hypothesis((FaultState("leak", 0.1, 90.0),), 0.8), Hypothesis((), 0.2)))
COURSE: tuple[tuple[float, Event], ...] = (
    (0.0, GuardStarted("tank", "c", "observe", "plant", False)),
    (0.0, ModeEntered("observe", "")),
    (10.0, AlarmRaised("link", "no sample <came>", Priority.HIGH)),
    (30.0, AlarmReturned("link")),
    (50.0, QualityChanged("T1", "bad", "frozen")),
    (90.0, QualityChanged("T1", "good", "")),
    (100.0, ModeEntered("advise", "Ada")),
    (100.0, AlarmRaised("link", "no sample came again", Priority.HIGH)),
    (120.0, AlarmReturned("link")),
    (130.0, FAULT),
    (131.0, FAULT),
    (140.0, RequestAnswered("search-1", "search", "d", "received")),
    (140.0, RequestAnswered("search-1", "search", "d", "advised")),
    (150.0, ThinkingEnded(7, "killed")),
    (200.0, QualityChanged("T1", "uncertain", "stale")),
)


def written(folder: Path, course: tuple[tuple[float, Event], ...]) -> Path:
    with Journal(folder) as journal:
        for at_s, event in course:
            journal.record(event, at_s)
    return folder


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return written(tmp_path / "run", COURSE)


def facts(run: Path, last_s: float = math.inf, until_s: float = math.inf) -> Facts:
    return facts_of(read_events(run), last_s, until_s)


def begun(restored: bool = True) -> tuple[Event, Event]:
    return GuardStarted("tank", "c", "observe", "plant", restored), ModeEntered("observe", "")


@pytest.mark.parametrize("killed", [False, True])
def test_what_a_guard_has_not_seen_end_does_not_last_over_a_restart(tmp_path: Path, killed: bool) -> None:
    course: list[tuple[float, Event]] = [
        *((0.0, event) for event in begun(restored=False)),
        (10.0, ModeEntered("advise", "Ada")),
        (20.0, AlarmRaised("link", "no sample", Priority.HIGH)),
        (20.0, QualityChanged("T1", "bad", "frozen")),
        (20.0, QualityChanged("T2", "uncertain", "stale")),
        (50.0, ThinkingEnded(7, "killed")),
        *(() if killed else ((50.0, Stopped("the service was stopped")),)),
        *((1050.0, event) for event in begun()),
        (1060.0, AlarmRaised("link", "no sample", Priority.HIGH)),
        (1100.0, ThinkingEnded(8, "killed")),
    ]
    run = written(tmp_path / "run", tuple(course))
    found = facts(run)
    assert {mode: x.lasted_s for mode, x in found.modes.items()} == {"observe": 60.0, "advise": 40.0}
    assert (found.unguarded.times, found.unguarded.lasted_s) == (1, 1000.0)
    assert (found.alarms["link"].times, found.alarms["link"].lasted_s) == (2, 70.0)
    assert (found.bad["T1"].lasted_s, found.uncertain["T2"].lasted_s) == (30.0, 30.0)
    assert "<td>no guard</td>" in page(found)
    late = facts(run, last_s=100.0)
    assert (late.from_s, late.unguarded.lasted_s, late.modes.keys()) == (1000.0, 50.0, {"observe"})
    assert (late.alarms["link"].lasted_s, late.bad, late.uncertain) == (40.0, {}, {})
    last = facts(run, last_s=20.0)
    assert last.unguarded.lasted_s == 0.0 and "no guard" not in page(last)
    assert last.modes["observe"].lasted_s == 20.0 == last.alarms["link"].lasted_s


def test_all_of_it(run: Path) -> None:
    found = facts(run)
    assert (found.plant, found.length_s) == ("tank", 200.0)
    assert {mode: x.lasted_s for mode, x in found.modes.items()} == {"observe": 100.0, "advise": 100.0}
    link = found.alarms["link"]
    assert (link.times, link.lasted_s, link.longest_s, link.text) == (2, 40.0, 20.0, "no sample came again")
    assert found.bad["T1"].lasted_s == 40.0 and found.uncertain["T1"].lasted_s == 0.0
    ((at_s, name, probability),) = found.diagnosed  # the same again is no news
    assert (at_s, name) == (130.0, "leak") and probability == pytest.approx(0.8)
    assert found.asked["search-1"].status == "advised" and found.counts["deaths of thinking"] == 1


def test_the_last_of_it_leaves_out_what_was_over_and_takes_what_lasted_from_its_begin(run: Path) -> None:
    found = facts(run, 90.0)
    assert (found.from_s, found.length_s) == (110.0, 90.0)
    assert {mode: x.lasted_s for mode, x in found.modes.items()} == {"advise": 90.0}
    assert found.alarms["link"].lasted_s == 10.0 and "T1" not in found.bad
    assert "starts of the guard" not in found.counts and found.plant == "tank"


def test_an_earlier_stretch_is_told_as_it_was_known_then(run: Path) -> None:
    found = facts(run, 40.0, 105.0)
    assert (found.from_s, found.to_s) == (65.0, 105.0) and not found.diagnosed and not found.asked
    assert {mode: x.lasted_s for mode, x in found.modes.items()} == {"observe": 35.0, "advise": 5.0}
    assert found.alarms["link"].lasted_s == 5.0 and found.bad["T1"].lasted_s == 25.0
    assert facts(run, until_s=1e6) == facts(run) and facts(run, until_s=-1.0).length_s == 0.0


def test_the_page_is_well_formed_and_says_it(run: Path) -> None:
    text = page(facts(run))
    ElementTree.fromstring(text.removeprefix("<!DOCTYPE html>\n"))
    for words in ("tank: 3.3 min attached", "no sample came again", "leak", "advised", "80 %", "50.0 %", "frozen"):
        assert words in text
    assert page(facts(run)) == text


def test_a_journal_without_anything_has_a_page(tmp_path: Path) -> None:
    assert "There was none." in page(facts_of(()))


def test_the_command_writes_it_once(run: Path, tmp_path: Path) -> None:
    done = homeostat("report", "run", "--last", "90s", "--out", "page.html", cwd=tmp_path)
    assert (done.status, done.err) == (0, "") and "1 alarms, 1 diagnoses, 1 requests in 90 s" in done.out
    refused(homeostat("report", "run", "--out", "page.html", cwd=tmp_path), "--force")
    refused(homeostat("report", "run", "--last", "soon", "--out", "p.html", cwd=tmp_path), "say 7d, 8h")
    refused(homeostat("report", "run", "--until", "noon", "--out", "p.html", cwd=tmp_path), "--until 'noon'")
    done = homeostat("report", "run", "--last", "40s", "--until", "105s", "--out", "p.html", cwd=tmp_path)
    assert (done.status, done.err) == (0, "") and "1 alarms, 0 diagnoses, 0 requests in 40 s" in done.out
    refused(homeostat("report", "nowhere", "--out", "p.html", cwd=tmp_path), "not a directory")


@pytest.mark.parametrize(
    ("left", "where"),
    [(lambda lines: lines[:-3], 12), (lambda lines: [*lines[:-2], lines[-2][:40]], 13), (lambda lines: [], 0)],
)
def test_a_finished_run_whose_journal_was_cut_says_so(
    left: Callable[[list[bytes]], list[bytes]], where: int, tmp_path: Path
) -> None:
    with Journal(tmp_path / "run") as journal:
        for at_s, event in COURSE:
            journal.record(event, at_s)
        journal.close(Summary(1, "held"))
    path = tmp_path / "run" / "events.jsonl"
    whole = homeostat("report", "run", "--out", "whole.html", cwd=tmp_path)
    assert (whole.status, whole.err) == (0, "") and "is missing" not in (tmp_path / "whole.html").read_text("utf-8")
    path.write_bytes(b"".join(left(path.read_bytes().splitlines(keepends=True))))
    done = homeostat("report", "run", "--out", "page.html", cwd=tmp_path)
    said = f"the journal ends after line {where}, {len(COURSE)} were written"
    assert done.status == 1 and done.err == f"homeostat: 'run': what came last is missing: {said}\n"
    assert "in " in done.out and said in (tmp_path / "page.html").read_text("utf-8")


def test_a_run_that_goes_on_or_was_killed_lacks_nothing_that_is_known(run: Path, tmp_path: Path) -> None:
    (run / "events.jsonl").write_bytes((run / "events.jsonl").read_bytes()[:-20])
    done = homeostat("report", "run", "--out", "page.html", cwd=tmp_path)
    assert (done.status, done.err) == (0, "")


def test_a_folder_in_which_no_history_ever_began_is_none(tmp_path: Path) -> None:
    with Journal(tmp_path / "live") as journal:
        journal.record(first_event("cstr", (Setting("pace", 1.0),), "", ()), 0.0)
    (tmp_path / "live.history").mkdir()
    assert homeostat("report", "live", "--out", "r.html", cwd=tmp_path).status == 0
    assert "There is no history" in (tmp_path / "r.html").read_text()
    named = homeostat("report", "live", "--out", "n.html", "--history", "live.history", cwd=tmp_path)
    refused(named, "'live.history' is no history")
    assert not (tmp_path / "n.html").exists()


def test_a_long_journal_takes_no_memory_for_what_no_fact_follows_from(tmp_path: Path) -> None:
    ends_s = tuple(float(second) for second in range(500))
    with Journal(tmp_path) as journal:
        for at_s, event in COURSE:
            journal.record(event, at_s)
        for number in range(200):
            journal.record(Foreseen("", 0.0, 500.0, 8, ends_s, (), None, (), ""), 1000.0 + number)
    tracemalloc.start()
    try:
        records = tuple(map(condensed, read_events(tmp_path)))
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(records) >= 200 and held < 1_000_000
    assert facts_of(records) == facts_of(read_events(tmp_path))


def test_what_another_version_wrote_of_something_else_keeps_no_report_from_being_made(tmp_path: Path) -> None:
    with Journal(tmp_path) as journal:
        for at_s, event in COURSE:
            journal.record(event, at_s)
        journal.record(Foreseen("", 0.0, 500.0, 8, (1.0,), (), None, (), ""), 1000.0)

    def make_unknown(lines: list[dict[str, object]]) -> None:
        del lines[-1]["members"]

    before = facts_of(read_events(tmp_path))
    change(tmp_path, make_unknown)
    assert facts_of(read_events(tmp_path)) == before
