"""What recoveries of an attached plant leave in its playbook, whatever becomes of the file and of whoever thinks."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from homeostat.domain.cost import Cost, CostItem
from homeostat.domain.events.recovery import Attempted, Diagnosed, Noticed, ReleasedActions
from homeostat.domain.events.trips import FallbackActivated, Tripped
from homeostat.domain.mode import Mode
from homeostat.domain.observation import Observation, Settled, Trouble
from homeostat.domain.plant.limits import Owner
from homeostat.domain.playbook import Ending, Entry
from homeostat.domain.recovery import ActionSet
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding
from homeostat.plants.wired.playbook import open_playbook
from homeostat.record import playbook
from homeostat.record.directory import RunDirectory
from homeostat.record.playbook import read_playbook
from homeostat.service.thinking import learning as under_test
from homeostat.service.thinking.consulted import Consulted
from homeostat.service.thinking.learning import Learning
from tests.agents.entries import COMMANDS, STANDS, situation, stuck
from tests.equipment.opcua.attached import until
from tests.twin.followed import reactor

SINCE = "2026-03-01T08:00:00.000+00:00"
SEEN = Observation(0.0, None, "normal", ActionSet((), "normal"), None, None, (), None, Mode.APPROVE, (), None)
MARGIN = Finding("LIM-T-HIGH", Owner.ACTION, 1.4, "K", 0.0, 0, "")
ATTEMPT = Attempted(
    1,
    "search",
    ("normal", "reduced_load"),
    COMMANDS,
    "d" * 64,
    True,
    (MARGIN,),
    8,
    Cost((CostItem("production", 0.39),), 1.0),
)
RELEASED = ReleasedActions("search", COMMANDS, "d" * 64, "reduced_load", 1.4, "reduced_load")


def tick(at_s: float, temperature_K: float = 311.0, latched: str | None = None) -> Observation:
    sample = Snapshot(
        at_s, {tag: float("nan") if v is None else v for tag, v in STANDS.items()} | {"T1": temperature_K}
    )
    return replace(SEEN, now_s=at_s, snapshot=sample, sample=sample, latched=latched)


class Attachment:
    """A thinking process's memory beside a journal of its own."""

    def __init__(self, folder: Path) -> None:
        self.file, self.told = folder / "book.jsonl", list[Trouble | Settled]()
        self.journal = RunDirectory(folder / "live") if not (folder / "live").exists() else None
        self.folder = folder / "live"
        self.begin()

    def begin(self) -> None:
        """As a process that has just been started, or started again."""
        self.book, content = open_playbook(self.file, reactor())
        self.learning = Learning(reactor(), self.book, self.file, self.folder, self.told.append)
        self.learning.begin(SINCE, content.entries)

    def note(self, event: object, at_s: float) -> None:
        """The guard journals ``event``."""
        assert self.journal is not None
        self.journal.record(event, at_s)  # type: ignore[arg-type]

    def recover(self, at_s: float = 1000.0) -> None:
        """A recovery, from what is noticed to a release at ``at_s`` [s]."""
        self.learning.see(tick(at_s - 5.0))
        for event in (Noticed(("SYM",)), Diagnosed((), (stuck(),)), ATTEMPT):
            self.learning.hear(event, at_s - 5.0)
            self.note(event, at_s - 5.0)
        self.learning.hear(RELEASED, at_s)
        self.note(RELEASED, at_s)

    def go_on(self, from_s: float, to_s: float, **seen: object) -> None:
        """Ticks of ten seconds."""
        for at_s in range(int(from_s), int(to_s) + 1, 10):
            self.learning.see(tick(float(at_s), **seen))  # type: ignore[arg-type]

    @property
    def entries(self) -> tuple[Entry, ...]:
        return read_playbook(self.file).entries


@pytest.fixture
def plant(tmp_path: Path) -> Iterator[Attachment]:
    yield Attachment(tmp_path)


def ended(entry: Entry) -> tuple[Ending, float] | None:
    return None if entry.aftermath is None else (entry.aftermath.ending, entry.aftermath.seconds)


def test_a_release_is_kept_at_once_and_told_of_again_once_it_has_held(plant: Attachment) -> None:
    plant.recover()
    (entry,) = until(lambda: plant.entries, "the entry")
    assert entry.answer is not None and entry.answer.commands == COMMANDS and entry.aftermath is None
    assert (entry.occasion.state, entry.occasion.mode, entry.occasion.hypotheses) == ("normal", "approve", (stuck(),))
    assert {s.tag: s.value for s in entry.occasion.setpoints} == STANDS
    assert entry.source == f"attached since {SINCE}, 1000.0 s" and len(plant.book) == 0
    plant.go_on(1010, 1600)
    (entry,) = until(lambda: [e for e in plant.entries if e.aftermath], "what came of it")
    assert ended(entry) == (Ending.HELD, 600.0) and entry.aftermath is not None and entry.aftermath.kept == 2.0
    assert len(plant.file.read_bytes().splitlines()) == 2 and len(plant.entries) == 1
    until(lambda: plant.book.near(situation()), "thinking knows of it without being started again")
    assert plant.told == []


def test_what_the_fallback_ended_is_never_proposed(plant: Attachment) -> None:
    plant.recover()
    plant.go_on(1010, 1100)
    plant.note(FallbackActivated("isolate", (), "too hot"), 1105.0)
    plant.learning.see(tick(1110.0, latched="too hot"))
    (entry,) = until(lambda: [e for e in plant.entries if e.aftermath], "its end")
    assert ended(entry) == (Ending.FELL_BACK, 105.0) and not entry.usable
    assert plant.book.near(situation()) == []


def test_a_trip_in_a_mode_that_does_not_write_counts_although_nothing_was_latched(plant: Attachment) -> None:
    plant.recover()
    plant.note(Tripped("LIM-T-HIGH", -1.0, "K", "too hot", False), 1200.0)
    plant.go_on(1010, 1600)
    (entry,) = until(lambda: [e for e in plant.entries if e.aftermath], "its end")
    assert ended(entry) == (Ending.FELL_BACK, 200.0)


def test_what_follows_replaces_what_was_before(plant: Attachment) -> None:
    plant.recover(1000.0)
    plant.go_on(1010, 1290)
    plant.recover(1300.0)
    first, second = until(lambda: len(plant.entries) == 2 and plant.entries, "both")
    assert {ended(first), ended(second)} == {(Ending.REPLACED, 300.0), None}


def test_thinking_that_is_started_again_watches_on_with_what_the_guard_tells_it(plant: Attachment) -> None:
    plant.recover()
    until(lambda: plant.entries, "the entry")
    plant.go_on(1010, 1200)
    plant.begin()  # and nobody ever hears of the one before
    plant.go_on(900, 1600, temperature_K=310.5)
    (entry,) = until(lambda: [e for e in plant.entries if e.aftermath], "what came of it")
    assert ended(entry) == (Ending.HELD, 600.0) and entry.aftermath is not None and entry.aftermath.kept == 2.5


def test_where_everything_was_stopped_meanwhile_the_journal_says_what_came_of_it(plant: Attachment) -> None:
    plant.recover()
    until(lambda: plant.entries, "the entry")
    plant.note(FallbackActivated("isolate", (), "too hot"), 1105.0)
    plant.begin()
    plant.learning.see(tick(90_000.0, latched="too hot"))
    (entry,) = until(lambda: [e for e in plant.entries if e.aftermath], "its end")
    assert ended(entry) == (Ending.FELL_BACK, 105.0)


def test_what_nobody_saw_is_not_said_to_have_held(plant: Attachment) -> None:
    plant.recover()
    until(lambda: plant.entries, "the entry")
    plant.go_on(1010, 1100)
    plant.learning.see(tick(90_000.0))
    (entry,) = until(lambda: [e for e in plant.entries if e.aftermath], "its end")
    assert ended(entry) == (Ending.CUT_SHORT, 100.0)


def test_a_file_that_takes_nothing_is_one_alarm_and_gets_the_entry_later(
    plant: Attachment, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(under_test, "AGAIN_S", 0.2)
    plant.file.mkdir()
    plant.recover()
    until(lambda: plant.told, "an alarm")
    until(lambda: plant.learning.writing._tried, "another try")
    (trouble,) = plant.told
    assert isinstance(trouble, Trouble) and trouble.name == "recovery:playbook" and "Is a directory" in trouble.cause
    assert plant.learning.writing.trouble == trouble, "a guard that begins again is told, too"
    plant.file.rmdir()
    until(lambda: plant.file.exists() and plant.entries, "the entry")
    until(lambda: plant.told == [trouble, Settled("recovery:playbook")], "it is over")


def test_a_file_that_another_process_keeps_holds_nobody(plant: Attachment, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(playbook, "WAIT_S", 0.3)
    monkeypatch.setattr(under_test, "AGAIN_S", 0.2)
    with plant.file.open("w") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        plant.recover()
        plant.go_on(1010, 1100)  # returns although the file is not free
        until(lambda: plant.told, "an alarm")
        assert "was in use" in plant.told[0].cause  # type: ignore[union-attr]
    until(lambda: plant.entries, "the entry")


def test_what_fails_in_here_costs_an_entry_and_no_recovery(plant: Attachment) -> None:
    plant.learning.hear(Noticed(("SYM",)), 995.0)
    plant.learning.hear(Diagnosed((), (stuck(),)), 995.0)
    plant.learning.hear(replace(ATTEMPT, cost=Cost((CostItem("production", float("nan")),), 1.0)), 995.0)
    plant.learning.hear(RELEASED, 1000.0)
    (trouble,) = plant.told
    assert isinstance(trouble, Trouble) and "an entry of the playbook was lost" in trouble.cause


def test_what_is_handed_on_arrives_as_it_was() -> None:
    told = Consulted(
        "http://h/v1#m", True, ("h",), 0.5, 7, ("Pump: new",), "c.jsonl", "none", 30.0, 2, 60.0, "route", "b"
    )
    assert Consulted.from_text(told.to_text()) == told
    assert Consulted.from_text(Consulted().to_text()) == Consulted() and Consulted().usual
    assert json.loads(told.elsewhere().to_text())["playbook"] == str(Path("b").absolute())
    assert {s.name: s.value for s in told.settings("f" * 64)} == {
        "proposer": "http://h/v1#m", "protocol": "route", "grounding": "none", "budget_s": 60.0, "playbook": "f" * 64
    }  # fmt: skip
